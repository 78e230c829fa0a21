fn octave(p: vec2f) -> f32 {
    var value: f32;
    value += sin(p.x);
    value += cos(p.y);
    return value;
}

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    var sum = 0.0;
    var scale = 1.0;
    for (var i = 0; i < 4; i++) {
        sum += octave(uv * scale) / scale;
        scale *= 2.0;
    }
    return vec4f(sum);
}
