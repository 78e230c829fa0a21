// A normal that may vanish, in the original as in the variant.
// innocent: op-removal fs_main.tint mean

struct Varyings {
    @location(0) uv: vec2f,
    @location(1) world_normal: vec3f,
    @location(2) world_position: vec3f,
}

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    let normal = normalize(in.world_normal);
    let tint = 0.3 * in.uv.x;
    return vec4f(normal * 0.4 + 0.5 + vec3f(tint, 0.0, 0.0), 1.0);
}
