// expect: 7 candidates
// in turn: fs_main.diffuse_3 fs_main.specular_3 fs_main.all_3
struct Light { at: vec3f, reach: f32, colour: vec3f }
@group(0) @binding(0) var<uniform> lights: array<Light, 4>;
@group(0) @binding(1) var<uniform> count: u32;

@vertex fn vs_main(@location(0) position: vec3f, @location(1) normal: vec3f) -> Surface { return Surface(vec4f(position, 1.0), position, normal); }
struct Surface { @builtin(position) clip: vec4f, @location(0) at: vec3f, @location(1) normal: vec3f }
@fragment fn fs_main(in: Surface) -> @location(0) vec4f {
    var diffuse = vec3f();
    for (var i = 0u; i < count; i++) {
        diffuse += lights[i].colour * max(dot(in.normal, lights[i].at - in.at), 0.0);
    }
    var specular = vec3f();
    for (var i = 0u; i < 4u; i++) {
        specular += lights[i].colour * pow(dot(in.normal, lights[i].at - in.at), 16.0);
    }
    var all = vec3f();
    for (var i = 0u; i < count; i++) {
        all += lights[i].colour * max(dot(in.normal, lights[i].at - in.at), 0.0);
        if all.x > 1.0 { break; }
    }
    return vec4f(sin(diffuse) * specular * cos(all), 1.0);
}
