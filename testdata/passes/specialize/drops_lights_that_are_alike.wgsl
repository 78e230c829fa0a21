// Every light has the same intensity; their colours differ.
// facts: fixed lights[0].intensity 2.0
// facts: fixed lights[1].intensity 2.0
// facts: fixed lights[0].colour 1.0 0.5 0.5
// facts: fixed lights[1].colour 0.5 0.5 1.0
// expect: 1 candidates
struct Light { colour: vec3f, intensity: f32 }
@group(0) @binding(0) var<storage, read> lights: array<Light, 2>;
@fragment
fn fs_main(@location(0) normal: vec3f) -> @location(0) vec4f {
    var colour = vec3f(0.25);
    for (var i = 0u; i < 2u; i++) {
        colour += lights[i].colour * sqrt(lights[i].intensity) * normal.x;
    }
    return vec4f(colour, 1.0);
}
