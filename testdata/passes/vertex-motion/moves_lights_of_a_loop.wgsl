// expect: 1 candidates
struct Light { at: vec3f, colour: vec3f }
@group(0) @binding(0) var<uniform> lights: array<Light, 4>;
@group(0) @binding(1) var<uniform> count: u32;

@vertex fn vs_main(@location(0) position: vec3f, @location(1) normal: vec3f) -> Surface {
    return Surface(vec4f(position, 1.0), position, normal);
}
struct Surface { @builtin(position) clip: vec4f, @location(0) at: vec3f, @location(1) normal: vec3f }

@fragment fn fs_main(in: Surface) -> @location(0) vec4f {
    var light = vec3f();
    for (var i = 0u; i < min(count, 4u); i++) {
        light += lights[i].colour * max(dot(in.normal, lights[i].at - in.at), 0.0);
    }
    return vec4f(light, 1.0);
}
