// What is written to memory, and whether it is, is nobody's picture.
// expect: 0 candidates
@group(0) @binding(0) var<storage, read_write> log: array<f32, 4>;

@fragment
fn fs_main(@location(0) heat: f32) -> @location(0) vec4f {
    if heat * heat > 0.5 {
        log[0] = sqrt(heat);
    }
    return vec4f(0.0, 0.0, 0.0, 1.0);
}
