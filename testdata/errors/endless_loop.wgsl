@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    var x = uv.x;
    for (var i = 0; i < 4; i++) {
        x += 0.25;
    }
    loop {
        x += 1.0;
        if x < -1.0 {
            break;
        }
    }
    return vec4f(x);
}
