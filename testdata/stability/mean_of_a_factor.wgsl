// A pattern that is averaged, and nothing divides by it.
// innocent: op-removal fs_main.wave mean

struct Varyings {
    @location(0) uv: vec2f,
    @location(1) world_normal: vec3f,
    @location(2) world_position: vec3f,
}

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    let wave = 0.5 + 0.4 * sin(in.uv.x * 9.0);
    let tone = wave * in.uv.y;
    return vec4f(vec3f(0.3 + 0.2 * tone), 1.0);
}
