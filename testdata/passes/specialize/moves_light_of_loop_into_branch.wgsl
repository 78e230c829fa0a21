// A light that is switched off, for the draw, in a loop over lights; what the loop shares with no light stays before it.
// expect: 1 candidates
struct Light { direction: vec3f, intensity: f32 }
@group(0) @binding(0) var<uniform> lights: array<Light, 8>;
@group(0) @binding(1) var<uniform> count: u32;
@fragment
fn fs_main(@location(0) normal: vec3f, @location(1) view: vec3f) -> @location(0) vec4f {
    var sum = 0.0;
    for (var i = 0u; i < count; i += 1u) {
        let half_way = normalize(lights[i].direction + view);
        sum += pow(max(dot(normal, half_way), 0.0), 32.0) * lights[i].intensity;
    }
    return vec4f(vec3f(sum), 1.0);
}
