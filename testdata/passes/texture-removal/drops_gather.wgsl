// Four texels of one channel: only what was seen stands for them.
// expect: 3 candidates
@group(0) @binding(0) var heights: texture_2d<f32>;
@group(0) @binding(1) var smooth_sampler: sampler;

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    let corners = textureGather(0, heights, smooth_sampler, uv);
    let middle = textureSample(heights, smooth_sampler, uv);
    return corners * middle;
}
