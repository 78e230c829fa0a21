// Twice and three times as fine: nobody samples once over the surface, but there both repeat. It is 48 texels along an edge.
// expect: 1 candidates
// facts: sampler smooth_sampler repeats
@group(0) @binding(0) var dust: texture_2d<f32>;
@group(0) @binding(1) var scratches: texture_2d<f32>;
@group(0) @binding(2) var smooth_sampler: sampler;

@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) light: f32) -> @location(0) vec4f {
    let dirt = textureSample(dust, smooth_sampler, uv * 2.0).rgb * textureSample(scratches, smooth_sampler, uv * 3.0).rgb;
    return vec4f(dirt * light, 1.0);
}
