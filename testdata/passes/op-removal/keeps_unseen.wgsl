// No sample computed the square, so it has no mean.
// expect: 1 candidates
// facts: fs_main.squared unseen
// facts: fs_main.level unseen

@fragment
fn fs_main(@location(0) level: f32) -> @location(0) vec4f {
    let squared = level * level;
    return vec4f(squared, 0.0, 0.0, 1.0);
}
