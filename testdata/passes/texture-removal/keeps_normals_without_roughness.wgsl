// expect: 2 candidates
// facts: texture bumps slopes 0.04
// facts: fs_main.normal.sample mean 0.5 0.5 1.0 1.0
// The only roughness is that of a coat, and `alpha` is how much of what is behind is covered.

@group(0) @binding(0) var bumps: texture_2d<f32>;
@group(0) @binding(1) var smooth_sampler: sampler;

struct Material {
    coat_roughness: f32,
    alpha: f32,
}
@group(0) @binding(2) var<uniform> material: Material;

@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) light: vec3f) -> @location(0) vec4f {
    let normal = normalize(textureSample(bumps, smooth_sampler, uv).xyz * 2.0 - 1.0);
    let coat_roughness = material.coat_roughness * material.coat_roughness;
    let shine = pow(saturate(dot(normal, light)), 2.0 / (coat_roughness * coat_roughness) - 2.0);
    let alpha = material.alpha * uv.x;
    return vec4f(vec3f(shine * alpha * alpha), alpha);
}
