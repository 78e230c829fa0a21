// A lookup table that is read by texel goes like any texture; its size is still asked for.
// expect: 2 candidates
@group(0) @binding(0) var ramp: texture_1d<f32>;

@fragment
fn fs_main(@location(0) level: f32) -> @location(0) vec4f {
    let last = f32(textureDimensions(ramp) - 1u);
    let colour = textureLoad(ramp, i32(level * last), 0);
    return vec4f(colour.rgb, level * last);
}
