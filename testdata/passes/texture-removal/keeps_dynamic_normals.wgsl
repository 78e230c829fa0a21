// expect: 0 candidates
// facts: texture bumps dynamic

@group(0) @binding(0) var bumps: texture_2d<f32>;
@group(0) @binding(1) var smooth_sampler: sampler;
@group(0) @binding(2) var<uniform> roughness: f32;

@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) light: vec3f) -> @location(0) vec4f {
    let normal = normalize(textureSample(bumps, smooth_sampler, uv).xyz * 2.0 - 1.0);
    let alpha = roughness * roughness;
    let d = dot(normal, light);
    return vec4f(vec3f(alpha * alpha / (d * d * (alpha * alpha - 1.0) + 1.0)), 1.0);
}
