// expect: 0 candidates
// facts: fixed light.strength 2.0
struct Light { colour: vec3f, strength: f32 }
@group(0) @binding(0) var<uniform> light: Light;

struct Target { @location(0) colour: vec3f, @location(1) weight: f32 }

@fragment fn fs_main(@location(0) uv: vec2f) -> Target {
    return Target(light.colour * uv.y, pow(uv.x, light.strength));
}
