// A choice comes down to either side; the condition is no float.
// expect: 5 candidates
@fragment
fn fs_main(@location(0) day: vec4f, @location(1) night: vec4f, @location(2) hour: f32) -> @location(0) vec4f {
    return select(day, night, hour > 0.75);
}
