// Samples reach 0, where the guards are: without them the power and the division have holes.
// expect: 7 candidates
@fragment
fn fs_main(@location(0) n_dot_h: f32, @location(1) size: f32) -> @location(0) vec4f {
    let lobe = pow(max(n_dot_h, 0.0), 32.0);
    let share = 1.0 / (abs(size) + 0.001);
    return vec4f(lobe, share, 0.0, 1.0);
}
