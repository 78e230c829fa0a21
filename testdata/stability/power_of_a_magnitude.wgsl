// A power whose base cannot be negative.
// innocent: op-removal fs_main.facing keep

struct Varyings {
    @location(0) uv: vec2f,
    @location(1) world_normal: vec3f,
    @location(2) world_position: vec3f,
}

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    let facing = saturate(in.world_normal.y);
    let rim = pow(abs(1.0 - facing), 3.0);
    return vec4f(vec3f(0.3 + 0.4 * rim), 1.0);
}
