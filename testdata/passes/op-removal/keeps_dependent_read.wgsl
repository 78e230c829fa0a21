// A coordinate never becomes the same everywhere: that would be a texture removed the slow way.
// expect: 1 candidates
@group(0) @binding(0) var albedo: texture_2d<f32>;
@group(0) @binding(1) var smooth_sampler: sampler;
@group(0) @binding(2) var<uniform> tiling: vec2f;

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    return textureSample(albedo, smooth_sampler, uv * tiling);
}
