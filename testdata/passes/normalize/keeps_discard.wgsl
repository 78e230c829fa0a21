@group(0) @binding(0) var mask: texture_2d<f32>;
@group(0) @binding(1) var smooth_sampler: sampler;

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    let cut = textureSample(mask, smooth_sampler, uv);
    if cut.w < 0.5 {
        discard;
    }
    return cut;
}
