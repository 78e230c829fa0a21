// A lobe and a mix that a number of the draw switches off at times: each goes into a branch on it.
// expect: 2 candidates
struct Material { sheen: f32, tint: vec3f, frost: f32, gloss: f32 }
@group(0) @binding(0) var<uniform> material: Material;
@group(0) @binding(1) var frost_texture: texture_2d<f32>;
@group(0) @binding(2) var surface_sampler: sampler;
@fragment
fn fs_main(@location(0) cosine: f32, @location(1) base: vec3f, @location(2) uv: vec2f) -> @location(0) vec4f {
    let rim = pow(1.0 - saturate(cosine), 5.0) + exp(-3.0 * cosine);
    let sheen = material.sheen * material.tint * rim;
    let frost = textureSample(frost_texture, surface_sampler, uv).rgb;
    let frosted = mix(base, frost * frost, material.frost);
    return vec4f(frosted + sheen, 1.0);
}
