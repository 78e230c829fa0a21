// What is drawn into a texture while the application runs is not known.
// expect: 0 candidates
// facts: texture decals dynamic
@group(0) @binding(0) var paint: texture_2d<f32>;
@group(0) @binding(1) var decals: texture_2d<f32>;
@group(0) @binding(2) var smooth_sampler: sampler;

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    return textureSample(paint, smooth_sampler, uv) * textureSample(decals, smooth_sampler, uv);
}
