// A highlight so narrow that a small turn of the surface is all of it.
// stiff: nothing

struct Varyings {
    @location(0) uv: vec2f,
    @location(1) world_normal: vec3f,
    @location(2) world_position: vec3f,
}

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    let cosine = normalize(in.world_normal).y;
    let highlight = pow(max(cosine, 0.0), 5000.0);
    return vec4f(vec3f(highlight), 1.0);
}
