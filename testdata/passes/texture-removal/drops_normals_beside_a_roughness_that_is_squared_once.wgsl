// expect: 6 candidates
// facts: texture bumps slopes 0.04
// facts: texture scratches slopes 0.02
// facts: fs_main.bump.sample mean 0.5 0.5 1.0 1.0
// facts: fs_main.scratch.sample mean 0.5 0.5 1.0 1.0
// The roughness is alpha itself, and some of it is added to it already.

@group(0) @binding(0) var bumps: texture_2d<f32>;
@group(0) @binding(1) var scratches: texture_2d<f32>;
@group(0) @binding(2) var smooth_sampler: sampler;
@group(0) @binding(3) var<uniform> scale: f32;

@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) light: vec3f) -> @location(0) vec4f {
    let bump = textureSample(bumps, smooth_sampler, uv).xyz * 2.0 - 1.0;
    let scratch = textureSample(scratches, smooth_sampler, uv * 4.0).xyz * 2.0 - 1.0;
    let normal = normalize(vec3f(bump.xy + scratch.xy, bump.z * scratch.z));
    let roughness = saturate(scale * uv.x);
    let wide = sqrt(min(roughness * roughness + 0.0625, 1.0));
    let d = dot(normal, light);
    return vec4f(vec3f(wide * wide / (d * d * (wide * wide - 1.0) + 1.0)), 1.0);
}
