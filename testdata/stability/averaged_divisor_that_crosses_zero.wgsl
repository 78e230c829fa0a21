// A square that is written out: whatever is averaged in it, it may fall below 0.
// trap: op-removal fs_main.first mean

struct Varyings {
    @location(0) uv: vec2f,
    @location(1) world_normal: vec3f,
    @location(2) world_position: vec3f,
}

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    let a = sin(in.uv.x * 9.0);
    let b = sin(in.uv.y * 7.0);
    let first = a * a;
    let apart = first - 2.0 * a * b + b * b + 0.05;
    let near = 0.02 / apart;
    return vec4f(vec3f(0.3 + clamp(near, 0.0, 0.4)), 1.0);
}
