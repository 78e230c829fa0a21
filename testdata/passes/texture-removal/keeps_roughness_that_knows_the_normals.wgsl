// expect: 2 candidates
// facts: texture bumps slopes 0.04
// facts: fs_main.mean.sample mean 0.5 0.5 1.0 1.0
// The shader measures by itself how far the normals of a texel are apart (Toksvig).

@group(0) @binding(0) var bumps: texture_2d<f32>;
@group(0) @binding(1) var smooth_sampler: sampler;
@group(0) @binding(2) var<uniform> roughness: f32;

@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) light: vec3f) -> @location(0) vec4f {
    let mean = textureSample(bumps, smooth_sampler, uv).xyz * 2.0 - 1.0;
    let apart = 1.0 - length(mean);
    let alpha_roughness = saturate(roughness + apart);
    let a2 = alpha_roughness * alpha_roughness;
    let d = dot(normalize(mean), light);
    return vec4f(vec3f(a2 / (d * d * (a2 - 1.0) + 1.0)), 1.0);
}
