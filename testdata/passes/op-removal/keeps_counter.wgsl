// The counter's test has two sides, but only one end.
// expect: 2 candidates
@group(0) @binding(0) var<uniform> weights: array<vec4f, 4>;

@fragment
fn fs_main() -> @location(0) vec4f {
    var i = 0u;
    loop {
        if i > 2u { break; }
        if weights[i].x > 0.5 { break; }
        i += 1u;
    }
    return weights[i];
}
