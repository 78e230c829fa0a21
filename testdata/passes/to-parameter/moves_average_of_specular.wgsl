// expect: 5 candidates
// facts: fs_main.normal mean 0.1 0.2 0.9
// facts: dynamic light.direction
struct Light { direction: vec3f, colour: vec3f }
@group(0) @binding(0) var<uniform> light: Light;
@group(0) @binding(1) var<uniform> eye: vec3f;
@group(0) @binding(2) var albedo: texture_2d<f32>;
@group(0) @binding(3) var filtering: sampler;

@fragment fn fs_main(
    @location(0) normal: vec3f,
    @location(1) at: vec3f,
    @location(2) uv: vec2f,
) -> @location(0) vec4f {
    let halfway = normalize(normalize(eye - at) - light.direction);
    let specular = pow(max(dot(normal, halfway), 0.0), 32.0);
    let colour = textureSample(albedo, filtering, uv).rgb;
    return vec4f(colour * light.colour * specular, 1.0);
}
