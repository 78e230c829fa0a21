// Both uses of the read's parts have something else to keep, so it goes at once.
// expect: 10 candidates
@group(0) @binding(0) var dirt: texture_2d<f32>;
@group(0) @binding(1) var smooth_sampler: sampler;

@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) base: vec3f, @location(2) gloss: f32) -> @location(0) vec4f {
    let grime = textureSample(dirt, smooth_sampler, uv);
    return vec4f(base * grime.rgb, gloss - grime.a);
}
