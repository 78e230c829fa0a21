// A guard before a sum that is far from 0.
// innocent: op-removal fs_main.far keep

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
    let along = length(camera.eye - in.world_position);
    let far = max(along, 0.001);
    let glow = 0.2 / (1.0 + far);
    return vec4f(vec3f(0.4, 0.5, 0.6) + glow * in.uv.x, 1.0);
}
