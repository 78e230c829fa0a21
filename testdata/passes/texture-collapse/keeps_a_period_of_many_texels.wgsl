// Textures of 128 texels that repeat 49 and 50 times, at coordinates of which nobody knows how large they are on the screen.
// expect: 0 candidates
// facts: sampler smooth_sampler repeats
// facts: texture scratches size 128
@group(0) @binding(0) var dust: texture_2d<f32>;
@group(0) @binding(1) var scratches: texture_2d<f32>;
@group(0) @binding(2) var smooth_sampler: sampler;

@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) light: f32) -> @location(0) vec4f {
    let bent = sin(uv);
    let dirt = textureSample(dust, smooth_sampler, bent * 49.0).rgb * textureSample(scratches, smooth_sampler, bent * 50.0).rgb;
    return vec4f(dirt * light, 1.0);
}
