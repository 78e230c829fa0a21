// expect: 4 candidates
// facts: texture bumps slopes 0.04
// facts: fs_main.normal.sample mean 0.5 0.5 1.0 1.0
// Nobody knows whether a row of the table stands for perceptual roughness or for its square.

@group(0) @binding(0) var bumps: texture_2d<f32>;
@group(0) @binding(1) var lobes: texture_2d<f32>;
@group(0) @binding(2) var smooth_sampler: sampler;
@group(0) @binding(3) var<uniform> roughness: f32;

@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) light: vec3f) -> @location(0) vec4f {
    let normal = normalize(textureSample(bumps, smooth_sampler, uv).xyz * 2.0 - 1.0);
    let row = vec2f(saturate(dot(normal, light)), roughness);
    return vec4f(textureSampleLevel(lobes, smooth_sampler, row, 0.0).xyz, 1.0);
}
