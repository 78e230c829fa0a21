// What is painted loses its shade, the edge of the paint stays.
// smooth: op-removal fs_main.shade mean

struct Varyings {
    @location(0) uv: vec2f,
    @location(1) world_normal: vec3f,
    @location(2) world_position: vec3f,
}

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    let shade = 0.5 + 0.05 * in.world_normal.y;
    let band = step(0.4, in.uv.x);
    return vec4f(vec3f(0.2 + band * shade), 1.0);
}
