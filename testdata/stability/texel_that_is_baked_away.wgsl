// A ratio of texels that never is infinite keeps what it is when it is baked.
// innocent: texture-collapse fs_main.ratio

struct Varyings {
    @location(0) uv: vec2f,
    @location(1) world_normal: vec3f,
    @location(2) world_position: vec3f,
}

@group(0) @binding(0) var packed: texture_2d<f32>;
@group(0) @binding(1) var filtering: sampler;

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    let texel = textureSample(packed, filtering, in.uv);
    let ratio = (texel.r + 0.5) / (texel.g * texel.b + 0.5);
    let gloss = (0.2 + 0.1 * in.world_normal.y) / ratio;
    return vec4f(vec3f(gloss), 1.0);
}
