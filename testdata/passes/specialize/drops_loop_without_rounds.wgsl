// No light is there.
// facts: fixed lighting.count 0
// expect: 1 candidates
struct Lighting { count: u32, lights: array<vec4f, 4> }
@group(0) @binding(0) var<uniform> lighting: Lighting;
@fragment
fn fs_main(@location(0) normal: vec3f) -> @location(0) vec4f {
    var colour = vec3f(0.25);
    for (var i = 0u; i < min(lighting.count, 4u); i++) {
        colour += lighting.lights[i].rgb * max(dot(normal, lighting.lights[i].rgb), 0.0);
    }
    return vec4f(colour, 1.0);
}
