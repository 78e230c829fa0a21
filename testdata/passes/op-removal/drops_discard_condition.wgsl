// What is discarded shows in the picture, so its condition may change and is measured.
// expect: 4 candidates
@fragment
fn fs_main(@location(0) alpha: f32, @location(1) colour: vec4f) -> @location(0) vec4f {
    if alpha * alpha < 0.25 { discard; }
    return colour;
}
