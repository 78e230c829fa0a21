// One colour everywhere: the constant is exact.
// expect: 2 candidates
// facts: texture white flat
@group(0) @binding(0) var white: texture_2d<f32>;
@group(0) @binding(1) var smooth_sampler: sampler;

@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) tint: vec4f) -> @location(0) vec4f {
    return textureSample(white, smooth_sampler, uv) * tint;
}
