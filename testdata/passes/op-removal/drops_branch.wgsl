// Either side of an `if` may be taken always; the side that discards may not.
// expect: 10 candidates
@fragment
fn fs_main(@location(0) light: f32, @location(1) colour: vec4f) -> @location(0) vec4f {
    if colour.a < 0.5 { discard; }
    var lit = colour * 0.1;
    if light > 0.0 {
        lit = colour * light;
    }
    return lit;
}
