// A lamp at the eye in a target of half floats, which end at 65504.
// trap: op-removal fs_main.bright keep

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
    let along = length(camera.eye - in.world_position) + 0.002;
    let light = 1.0 / (along * along * along);
    let bright = min(light, 1000.0);
    return vec4f(vec3f(0.1 + 0.5 * bright), 1.0);
}
