// Fog as a share: an exponential over itself and 1.
// trap: op-removal fs_main.thick keep

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
    let along = 0.2 * length(camera.eye - in.world_position);
    let thick = min(along, 20.0);
    let grown = exp(thick);
    let fog = grown / (1.0 + grown);
    return vec4f(mix(vec3f(0.3, 0.4, 0.2), vec3f(0.7, 0.8, 0.9), fog), 1.0);
}
