// Light without an edge.
// smooth: nothing

struct Varyings {
    @location(0) uv: vec2f,
    @location(1) world_normal: vec3f,
    @location(2) world_position: vec3f,
}

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    let light = 0.5 + 0.4 * normalize(in.world_normal).y;
    return vec4f(vec3f(light), 1.0);
}
