// Samples stay between 0.5 and 0.9, far above 0.0001.
// expect: 4 candidates
// facts: fs_main.size min 0.5 max 0.9

@fragment
fn fs_main(@location(0) size: f32) -> @location(0) vec4f {
    return vec4f(1.0 / max(size, 0.0001));
}
