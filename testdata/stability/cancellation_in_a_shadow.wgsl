// How far a surface is behind what shades it: almost nothing, but for a bias.
// trap: op-removal fs_main.behind keep

struct Varyings {
    @location(0) uv: vec2f,
    @location(1) world_normal: vec3f,
    @location(2) world_position: vec3f,
}

struct Camera {
    view_proj: mat4x4f,
    eye: vec3f,
}

@group(0) @binding(0) var<uniform> camera: Camera;

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    let there = dot(in.world_position, vec3f(0.3, 0.5, 0.8)) + 7.0;
    let stored = 7.0 + (0.3 * in.world_position.x + 0.5 * in.world_position.y + 0.8 * in.world_position.z);
    let gap = there - stored;
    let behind = gap + 0.0001;
    let soft = sqrt(behind);
    return vec4f(vec3f(0.5 + 0.3 * soft + 0.1 * in.uv.x), 1.0);
}
