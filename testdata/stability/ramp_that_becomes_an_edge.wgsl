// A ramp whose end is cut off, so that all of it is at one place.
// stiff: op-removal fs_main.wide keep fs_main.slope

struct Varyings {
    @location(0) uv: vec2f,
    @location(1) world_normal: vec3f,
    @location(2) world_position: vec3f,
}

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    let slope = 400.0 * (in.uv.x - 0.5);
    let wide = slope * 0.01;
    return vec4f(vec3f(clamp(0.5 + wide, 0.1, 0.9)), 1.0);
}
