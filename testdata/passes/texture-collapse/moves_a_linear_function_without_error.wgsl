// Filtering a weighted sum is the same as summing what is filtered.
// expect: 1 candidates
@group(1) @binding(0) var dust: texture_2d<f32>;
@group(1) @binding(4) var scratches: texture_2d<f32>;
@group(0) @binding(2) var smooth_sampler: sampler;

@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) light: f32) -> @location(0) vec4f {
    let dirt = 0.25 * textureSample(dust, smooth_sampler, uv).r - textureSample(scratches, smooth_sampler, uv).g / 2.0;
    return vec4f(vec3f(light - dirt), 1.0);
}
