// Fog that is thick within a hand of where it begins.
// stiff: nothing

struct Varyings {
    @location(0) uv: vec2f,
    @location(1) world_normal: vec3f,
    @location(2) world_position: vec3f,
}

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    let deep = max(in.world_position.y, 0.0);
    let fog = exp(-2000.0 * deep);
    return vec4f(mix(vec3f(0.8), vec3f(0.1), fog), 1.0);
}
