// What the loop adds up has a mean as a whole.
// expect: 9 candidates
@group(0) @binding(0) var<uniform> weights: array<vec4f, 4>;

@fragment
fn fs_main(@location(0) level: vec4f) -> @location(0) vec4f {
    var sum = vec4f(0.0);
    for (var i = 0u; i < 4u; i++) {
        sum += weights[i] * level;
    }
    return sum;
}
