// A root as a power: the slope at 0 has no limit.
// stiff: nothing

struct Varyings {
    @location(0) uv: vec2f,
    @location(1) world_normal: vec3f,
    @location(2) world_position: vec3f,
}

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    let near = max(in.uv.x - 0.3, 0.0);
    let ramp = pow(near, 0.05);
    return vec4f(vec3f(ramp), 1.0);
}
