// An angle whose cosine is clamped twice.
// innocent: op-removal fs_main.once keep

struct Varyings {
    @location(0) uv: vec2f,
    @location(1) world_normal: vec3f,
    @location(2) world_position: vec3f,
}

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    let along = in.world_normal.y * 0.3;
    let once = min(along, 1.0);
    let inside = clamp(once, -1.0, 1.0);
    let angle = acos(inside);
    return vec4f(vec3f(0.2 + 0.2 * angle), 1.0);
}
