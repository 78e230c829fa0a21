// A root that has no value for lengths in a band, which no picture has and no corner of the interface: a hunt has to find it.
// trap: op-removal fs_main.low keep

struct Varyings {
    @location(0) uv: vec2f,
    @location(1) world_normal: vec3f,
}

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    let square = dot(in.world_normal, in.world_normal);
    let left = abs(square - 20.0) - 3.0;
    let low = max(left, 0.0);
    let up = sqrt(low);
    return vec4f(vec3f(0.3, 0.2, 0.1) + 0.02 * up * in.uv.x, 1.0);
}
