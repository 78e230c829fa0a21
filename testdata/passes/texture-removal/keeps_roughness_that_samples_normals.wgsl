// expect: 2 candidates
// facts: texture bumps slopes 0.04
// facts: fs_main.normal.sample mean 0.5 0.5 1.0 1.0
// Rough places read smoother normals.

@group(0) @binding(0) var bumps: texture_2d<f32>;
@group(0) @binding(1) var smooth_sampler: sampler;
@group(0) @binding(2) var<uniform> roughness: f32;

@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) light: vec3f) -> @location(0) vec4f {
    let alpha = roughness * roughness;
    let normal = normalize(textureSampleLevel(bumps, smooth_sampler, uv, 4.0 * alpha).xyz * 2.0 - 1.0);
    let d = dot(normal, light);
    return vec4f(vec3f(alpha * alpha / (d * d * (alpha * alpha - 1.0) + 1.0)), 1.0);
}
