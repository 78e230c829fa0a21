// Without an image the texture may hold anything.
// expect: 0 candidates
// facts: texture video dynamic
@group(0) @binding(0) var video: texture_2d<f32>;
@group(0) @binding(1) var smooth_sampler: sampler;

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    return textureSample(video, smooth_sampler, uv);
}
