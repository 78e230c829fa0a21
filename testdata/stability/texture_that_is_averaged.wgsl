// A texture that only scales a light.
// innocent: texture-removal fs_main.texel.sample seen-mean

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
    let light = 0.4 + 0.4 * in.world_normal.y;
    return vec4f(texel * light, 1.0);
}
