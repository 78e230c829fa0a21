// What two textures of the same image differ by, and one becomes its mean.
// trap: texture-removal fs_main.high.sample seen-mean

struct Varyings {
    @location(0) uv: vec2f,
    @location(1) world_normal: vec3f,
    @location(2) world_position: vec3f,
}

@group(0) @binding(0) var upper: texture_2d<f32>;
@group(0) @binding(1) var lower: texture_2d<f32>;
@group(0) @binding(2) var filtering: sampler;

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    let high = textureSample(upper, filtering, in.uv).g;
    let low = textureSample(lower, filtering, in.uv).g;
    let deep = sqrt(high - 0.9 * low);
    return vec4f(vec3f(0.3 + deep), 1.0);
}
