// expect: 2 candidates
// facts: texture ramp polynomial 1
// facts: fs_main.uv min 0 max 8 mean 4
@group(0) @binding(0) var ramp: texture_2d<f32>;
@group(0) @binding(1) var smooth_sampler: sampler;
@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    return textureSample(ramp, smooth_sampler, uv);
}
