// An index that is held within its table twice.
// innocent: op-removal fs_main.inside keep

struct Varyings {
    @location(0) uv: vec2f,
    @location(1) world_normal: vec3f,
    @location(2) world_position: vec3f,
}

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    var shades = array<f32, 6>(0.2, 0.3, 0.5, 0.6, 0.7, 3e38);
    let along = 5.0 * in.uv.x;
    let inside = clamp(along, 0.0, 4.0);
    let shade = 2.0 * shades[min(u32(inside), 4u)];
    return vec4f(vec3f(shade), 1.0);
}
