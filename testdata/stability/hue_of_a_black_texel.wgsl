// The hue of a texture: black texels have none.
// trap: op-removal fs_main.shown keep fs_main.hue

struct Varyings {
    @location(0) uv: vec2f,
    @location(1) world_normal: vec3f,
    @location(2) world_position: vec3f,
}

@group(0) @binding(0) var albedo: texture_2d<f32>;
@group(0) @binding(1) var filtering: sampler;

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    let texel = textureSample(albedo, filtering, in.uv).rgb;
    let sum = texel.r + texel.g + texel.b;
    let hue = texel / sum;
    let shown = select(hue, vec3f(0.3), sum < 0.01);
    return vec4f(shown, 1.0);
}
