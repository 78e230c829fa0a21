// The early break reads floats, but the counter ends the loop without it.
// expect: 11 candidates
@group(0) @binding(0) var<uniform> steps: i32;

@fragment
fn fs_main(@location(0) slope: f32) -> @location(0) vec4f {
    var height = 1.0;
    for (var i = 0; i < steps; i += 1) {
        if height * slope > 8.0 { break; }
        height += slope;
    }
    return vec4f(height);
}
