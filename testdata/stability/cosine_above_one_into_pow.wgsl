// Fresnel by a cosine that is clamped, since normals are not of length 1: Bevy pull request 8926.
// trap: op-removal fs_main.facing keep

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
    let cosine = dot(in.world_normal, vec3f(0.3, 0.5, 0.1));
    let facing = min(cosine, 1.0);
    let fresnel = pow(1.0 - facing, 5.0);
    return vec4f(vec3f(0.3 + 0.05 * fresnel), 1.0);
}
