// The scratches are three times as fine, and turned by a right angle: they are resampled into one period of the dust.
// expect: 1 candidates
// facts: sampler smooth_sampler repeats
@group(0) @binding(0) var dust: texture_2d<f32>;
@group(0) @binding(1) var scratches: texture_2d<f32>;
@group(0) @binding(2) var smooth_sampler: sampler;

@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) light: f32) -> @location(0) vec4f {
    let fine = vec2f(-uv.y, uv.x) * 3.0 + vec2f(0.25, 0.0);
    let dirt = textureSample(dust, smooth_sampler, uv).rgb * textureSample(scratches, smooth_sampler, fine).rgb;
    return vec4f(dirt * light, 1.0);
}
