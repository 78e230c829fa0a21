// The scene may change `tint` at any time: what depends on it stays, and stays dependent on it.
// facts: dynamic draw.tint
// expect: 4 candidates
struct Draw {
    tint: vec3f,
    gain: f32,
}

@group(0) @binding(0) var<uniform> draw: Draw;

@fragment
fn fs_main(@location(0) colour: vec3f) -> @location(0) vec4f {
    let lit = colour * draw.gain;
    let tinted = lit * draw.tint;
    if draw.tint.x > 0.5 { discard; }
    return vec4f(tinted, 1.0);
}
