// The test keeps the division from 0, and not all samples passed it.
// expect: 6 candidates
// facts: fs_main.share count 16

@fragment
fn fs_main(@location(0) size: f32) -> @location(0) vec4f {
    var colour = 0.0;
    if size > 0.0 {
        let share = 1.0 / size;
        colour = share;
    }
    return vec4f(colour);
}
