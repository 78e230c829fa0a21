// Stripes that are far from where texture coordinates begin.
// stiff: nothing

struct Varyings {
    @location(0) uv: vec2f,
    @location(1) world_normal: vec3f,
    @location(2) world_position: vec3f,
}

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    let along = in.uv.x * 8.0;
    let stripe = fract(along);
    return vec4f(vec3f(0.2 + 0.6 * stripe), 1.0);
}
