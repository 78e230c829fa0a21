// The third component of a vector, from the two others.
// trap: op-removal fs_main.rest keep

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
    let bend = in.world_normal.xz * 0.6;
    let left = 1.0 - bend.x * bend.x - bend.y * bend.y;
    let rest = max(left, 0.0);
    let up = sqrt(rest);
    return vec4f(vec3f(0.4 + 0.4 * up), 1.0);
}
