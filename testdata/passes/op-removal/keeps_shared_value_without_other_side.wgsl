// The sine has no other side to keep, so the product that it shares cannot simply go.
// expect: 17 candidates
@fragment
fn fs_main(@location(0) a: f32, @location(1) b: f32) -> @location(0) vec4f {
    let wave = exp(a) * sqrt(a);
    return vec4f(wave * b, sin(wave), 0.0, 1.0);
}
