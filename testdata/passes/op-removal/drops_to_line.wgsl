// A curve that samples saw fall as its operand rises becomes a line; before a root it stays in the range that was seen.
// expect: 14 candidates
@fragment
fn fs_main(@location(0) cosine: f32, @location(1) rough: f32) -> @location(0) vec4f {
    let fresnel = exp(cosine);
    let soft = sqrt(exp(rough) + cosine);
    return vec4f(fresnel, soft, 0.0, 1.0);
}
