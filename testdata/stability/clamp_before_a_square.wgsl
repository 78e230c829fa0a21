// A cosine that is squared: above 1 or below 0 does no harm.
// innocent: op-removal fs_main.facing keep

struct Varyings {
    @location(0) uv: vec2f,
    @location(1) world_normal: vec3f,
    @location(2) world_position: vec3f,
}

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    let facing = min(in.world_normal.y, 0.9);
    let square = facing * facing;
    return vec4f(vec3f(0.3 + 0.4 * square), 1.0);
}
