// Once the index is a constant, the array is taken apart.
// expect: 10 candidates
@fragment
fn fs_main(@location(0) x: f32, @location(1) y: f32) -> @location(0) vec4f {
    var shades = array<f32, 3>(x, y, 0.7);
    var at = 0u;
    for (var i = 0u; i < 3u; i += 1u) {
        if y > 0.5 { at += i; }
        shades[at % 3u] *= 0.5;
    }
    return vec4f(shades[0], shades[1], shades[2], 1.0);
}
