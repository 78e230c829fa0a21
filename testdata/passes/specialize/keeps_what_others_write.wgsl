// The buffer is written, so that what the scene states is what it held before.
// facts: fixed counter 1.0
// expect: 0 candidates
@group(0) @binding(0) var<storage, read_write> counter: f32;
@fragment
fn fs_main(@location(0) a: f32) -> @location(0) vec4f {
    counter += 1.0;
    return vec4f(a * counter);
}
