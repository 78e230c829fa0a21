// A divisor that is averaged, and far from 0 either way.
// innocent: op-removal fs_main.tone.mul mean

struct Varyings {
    @location(0) uv: vec2f,
    @location(1) world_normal: vec3f,
    @location(2) world_position: vec3f,
}

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    let wave = 0.4 * sin(in.uv.x * 9.0);
    let tone = 0.5 / (1.0 + wave + in.uv.y * in.uv.y);
    return vec4f(vec3f(0.3 + tone * 0.5), 1.0);
}
