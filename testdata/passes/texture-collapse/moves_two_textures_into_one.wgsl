// A product is no linear function: it is the same texel by texel, at each MIP level.
// expect: 1 candidates
@group(0) @binding(0) var silk: texture_2d<f32>;
@group(0) @binding(1) var cone: texture_2d<f32>;
@group(0) @binding(2) var smooth_sampler: sampler;

@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) light: f32) -> @location(0) vec4f {
    let woven = textureSample(silk, smooth_sampler, uv).rgb * textureSample(cone, smooth_sampler, uv).rgb;
    return vec4f((woven + vec3f(0.1, 0.0, 0.0)) * light, 1.0);
}
