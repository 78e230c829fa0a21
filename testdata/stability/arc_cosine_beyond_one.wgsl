// An angle from a part of a direction.
// trap: op-removal fs_main.inside keep

struct Camera {
    view_proj: mat4x4f,
    eye: vec3f,
}

@group(0) @binding(0) var<uniform> camera: Camera;

struct Varyings {
    @builtin(position) clip_position: vec4f,
    @location(0) uv: vec2f,
    @location(1) world_normal: vec3f,
}

@vertex
fn vs_main(@location(0) position: vec3f, @location(1) normal: vec3f, @location(2) uv: vec2f) -> Varyings {
    var out: Varyings;
    out.clip_position = camera.view_proj * vec4f(position, 1.0);
    out.uv = uv;
    out.world_normal = normal;
    return out;
}

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    let along = abs(in.world_normal.y) * 0.3;
    let inside = min(along, 1.0);
    let angle = acos(inside);
    return vec4f(vec3f(0.2 + 0.2 * angle), 1.0);
}
