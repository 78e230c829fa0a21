// A root whose operand is made positive after the clamp.
// innocent: op-removal fs_main.rest keep

struct Varyings {
    @location(0) uv: vec2f,
    @location(1) world_normal: vec3f,
    @location(2) world_position: vec3f,
}

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    let left = 1.5 - in.world_normal.x;
    let rest = max(left, 0.0);
    let up = sqrt(abs(rest));
    return vec4f(vec3f(0.2 + 0.4 * up), 1.0);
}
