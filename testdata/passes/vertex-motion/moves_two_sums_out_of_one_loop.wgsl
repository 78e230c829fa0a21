// expect: 4 candidates
// in turn: fs_main.diffuse_3 fs_main.specular_3
struct Light { at: vec3f, reach: f32, colour: vec3f }
@group(0) @binding(0) var<uniform> lights: array<Light, 4>;
@group(0) @binding(1) var<uniform> count: u32;

@vertex fn vs_main(@location(0) position: vec3f, @location(1) normal: vec3f) -> Surface { return Surface(vec4f(position, 1.0), position, normal); }
struct Surface { @builtin(position) clip: vec4f, @location(0) at: vec3f, @location(1) normal: vec3f }
@fragment fn fs_main(in: Surface) -> @location(0) vec4f {
    var diffuse = vec3f();
    var specular = vec3f();
    for (var i = 0u; i < min(count, 4u); i++) {
        let towards = lights[i].at - in.at;
        let squared = dot(towards, towards);
        if squared > lights[i].reach {
            continue;
        }
        let lambert = max(dot(in.normal, towards), 0.0) / squared;
        diffuse += lights[i].colour * lambert;
        specular += lights[i].colour * pow(lambert, 16.0);
    }
    return vec4f(sin(diffuse) * specular, 1.0);
}
