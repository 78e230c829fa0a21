// The loop ends when a float says so: every value that leads to it stays.
// expect: 1 candidates
@group(0) @binding(0) var<uniform> step_size: f32;

@fragment
fn fs_main(@location(0) depth: f32) -> @location(0) vec4f {
    var height = 0.0;
    loop {
        if height * 2.0 > depth { break; }
        height = height + abs(step_size) * 0.5;
    }
    return vec4f(depth);
}
