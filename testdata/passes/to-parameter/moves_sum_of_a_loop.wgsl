// expect: 3 candidates
struct Light { direction: vec3f, colour: vec3f }
@group(0) @binding(0) var<uniform> lights: array<Light, 4>;
@group(0) @binding(1) var<uniform> count: u32;

@fragment fn fs_main(@location(0) normal: vec3f, @location(1) albedo: vec3f) -> @location(0) vec4f {
    var ambient = vec3f();
    var diffuse = vec3f();
    for (var i = 0u; i < min(count, 4u); i++) {
        ambient += lights[i].colour * 0.1;
        if dot(normal, lights[i].direction) > 0.0 {
            diffuse += lights[i].colour * dot(normal, lights[i].direction);
        }
    }
    return vec4f(albedo * (ambient + diffuse), 1.0);
}
