// A band of paint with a hard edge; its middle is moved.
// stiff: op-removal fs_main.band.add mean

struct Varyings {
    @location(0) uv: vec2f,
    @location(1) world_normal: vec3f,
    @location(2) world_position: vec3f,
}

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    let far = 0.02 * in.uv.y;
    let band = step(0.4 + far, in.uv.x);
    return vec4f(vec3f(0.2 + 0.6 * band), 1.0);
}
