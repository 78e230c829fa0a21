// expect: 2 candidates
// facts: texture bumps slopes 0.04
// facts: fs_main.normal.sample mean 0.5 0.5 1.0 1.0

@group(0) @binding(0) var bumps: texture_2d<f32>;
@group(0) @binding(1) var smooth_sampler: sampler;

struct Material {
    roughness_across: f32,
    roughness_along: f32,
}
@group(0) @binding(2) var<uniform> material: Material;

@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) light: vec3f) -> @location(0) vec4f {
    let normal = normalize(textureSample(bumps, smooth_sampler, uv).xyz * 2.0 - 1.0);
    let across = normal.x * light.x / (material.roughness_across * material.roughness_across);
    let along = normal.y * light.y / (material.roughness_along * material.roughness_along);
    return vec4f(vec3f(exp(-across - along)), 1.0);
}
