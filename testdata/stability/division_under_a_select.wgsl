// A division by 0 that nobody sees, and a change elsewhere.
// innocent: op-removal fs_main.tint mean

struct Varyings {
    @location(0) uv: vec2f,
    @location(1) world_normal: vec3f,
    @location(2) world_position: vec3f,
}

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    let width = abs(in.uv.y);
    let haze = select(0.002 / width, 0.1, width < 0.02);
    let tint = 0.3 * in.uv.x;
    return vec4f(vec3f(0.4 + min(haze, 0.1)) + vec3f(tint, 0.0, 0.0), 1.0);
}
