// A ramp, and then its mean: less steep is no finding.
// smooth: op-removal fs_main.return.add mean

struct Varyings {
    @location(0) uv: vec2f,
    @location(1) world_normal: vec3f,
    @location(2) world_position: vec3f,
}

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    let ramp = 0.3 * in.uv.x;
    return vec4f(vec3f(0.3 + ramp), 1.0);
}
