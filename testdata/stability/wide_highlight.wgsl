// A highlight of a usual width.
// smooth: nothing

struct Varyings {
    @location(0) uv: vec2f,
    @location(1) world_normal: vec3f,
    @location(2) world_position: vec3f,
}

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    let cosine = max(normalize(in.world_normal).y, 0.0);
    return vec4f(vec3f(0.2 + 0.5 * pow(cosine, 24.0)), 1.0);
}
