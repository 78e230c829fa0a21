// expect: 8 candidates
struct Camera { view_projection: mat4x4f, eye: vec3f, sun: vec3f }
@group(0) @binding(0) var<uniform> camera: Camera;

struct Surface {
    @builtin(position) clip: vec4f,
    @location(0) at: vec3f,
    @location(1) normal: vec3f,
}

@vertex fn vs_main(@location(0) position: vec3f, @location(1) normal: vec3f) -> Surface {
    return Surface(camera.view_projection * vec4f(position, 1.0), position, normal);
}

@fragment fn fs_main(in: Surface) -> @location(0) vec4f {
    let normal = normalize(in.normal);
    let half_way = normalize(camera.sun + normalize(camera.eye - in.at));
    let specular = pow(max(dot(normal, half_way), 0.0), 32.0);
    let diffuse = max(dot(normal, camera.sun), 0.0);
    return vec4f(vec3f(diffuse + specular), 1.0);
}
