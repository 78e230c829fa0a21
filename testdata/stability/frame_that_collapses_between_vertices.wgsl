// A direction that is guarded at each pixel, and may be opposite at two vertices.
// trap: vertex-motion fs_main.side interpolate

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
    let long = dot(in.world_normal, in.world_normal);
    let scale = inverseSqrt(max(long, 0.00000001));
    let side = select(vec3f(1.0, 0.0, 0.0), in.world_normal * scale, long > 0.000001);
    let shade = normalize(side);
    return vec4f(shade * 0.5 + 0.5, 1.0);
}
