// expect: 5 candidates
// in turn: fs_main.behind_3 fs_main.colour_3
struct Light { at: vec3f, reach: f32, colour: vec3f }
@group(0) @binding(0) var<uniform> lights: array<Light, 4>;
@group(0) @binding(1) var<uniform> count: u32;

@vertex fn vs_main(@location(0) position: vec3f, @location(1) normal: vec3f) -> Surface { return Surface(vec4f(position, 1.0), position, normal); }
struct Surface { @builtin(position) clip: vec4f, @location(0) at: vec3f, @location(1) normal: vec3f }
@fragment fn fs_main(in: Surface) -> @location(0) vec4f {
    var colour = vec3f();
    var behind = 1.0;
    for (var i = 0u; i < 4u; i++) {
        let thick = exp(-distance(in.at, lights[i].at));
        colour += lights[i].colour * (behind * thick);
        behind *= 1.0 - thick;
        if behind < 0.01 {
            break;
        }
    }
    return vec4f(sin(colour), cos(behind));
}
