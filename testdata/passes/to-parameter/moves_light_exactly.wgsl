// expect: 2 candidates
struct Light { direction: vec3f, strength: f32 }
@group(0) @binding(0) var<uniform> light: Light;
@group(0) @binding(1) var<uniform> tint: vec3f;

@fragment fn fs_main(@location(0) normal: vec3f) -> @location(0) vec4f {
    let towards = normalize(-light.direction);
    let doubled = tint * 2.0;
    return vec4f(doubled * dot(normal, towards), 1.0);
}
