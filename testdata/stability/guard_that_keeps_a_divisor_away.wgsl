// Light around the eye, whose divisor is kept away from 0. Without that it comes near, though it never is.
// trap: op-removal fs_main.away keep

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
    let along = distance(camera.eye, in.world_position);
    let near = along * along + 0.000000000001;
    let away = max(near, 0.001);
    let glow = 0.0005 / away;
    return vec4f(vec3f(0.4, 0.5, 0.6) + min(glow, 0.1) * in.uv.x, 1.0);
}
