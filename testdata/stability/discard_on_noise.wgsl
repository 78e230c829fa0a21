// Holes where a noise is low; what it is made of is simplified.
// stiff: op-removal fs_main.waves keep

struct Varyings {
    @location(0) uv: vec2f,
    @location(1) world_normal: vec3f,
    @location(2) world_position: vec3f,
}

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    let waves = sin(7.0 * in.uv.x) * sin(5.0 * in.uv.y);
    if waves < 0.1 {
        discard;
    }
    return vec4f(vec3f(0.6), 1.0);
}
