diagnostic(off, derivative_uniformity);

// Samples under a branch that not every pixel takes: the directive allows it, and has to survive.
@group(0) @binding(0) var flat: texture_2d<f32>;
@group(0) @binding(1) var smooth_sampler: sampler;

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    if uv.x > 0.5 {
        return textureSample(flat, smooth_sampler, uv);
    }
    let width = fwidth(uv.y * 10.0);
    return vec4f(textureSample(flat, smooth_sampler, uv * 2.0).rgb * (0.5 + width), 1.0);
}
