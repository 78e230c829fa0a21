// Scales of 1 and 1.5, a sampler that does not repeat, and coordinates that have nothing to do with each other.
// expect: 0 candidates
@group(0) @binding(0) var dust: texture_2d<f32>;
@group(0) @binding(1) var scratches: texture_2d<f32>;
@group(0) @binding(2) var once: sampler;

@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) other: vec2f) -> @location(0) vec4f {
    let a = textureSample(dust, once, uv) * textureSample(scratches, once, uv * 1.5);
    let b = textureSample(dust, once, uv * 2.0) + textureSample(scratches, once, uv * 4.0 - 0.5);
    let c = textureSample(dust, once, uv) - textureSample(scratches, once, other);
    return a + b * uv.x + c * uv.y;
}
