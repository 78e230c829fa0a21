// A band of paint with a hard edge, and then its mean.
// stiff: op-removal fs_main.return.add mean

struct Varyings {
    @location(0) uv: vec2f,
    @location(1) world_normal: vec3f,
    @location(2) world_position: vec3f,
}

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    let band = step(0.4, in.uv.x);
    return vec4f(vec3f(0.2 + 0.6 * band), 1.0);
}
