// Light that has no edge and is moved to the vertices.
// smooth: vertex-motion fs_main.shade interpolate

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
    let bend = dot(in.world_normal, vec3f(0.2, 0.8, 0.3));
    let shade = 0.5 + 0.4 * bend * bend;
    return vec4f(vec3f(shade), 1.0);
}
