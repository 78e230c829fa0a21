// Discards in functions, loops and switches, with work before and after.
var<private> visited: i32;

fn cut(x: f32) -> f32 {
    visited += 1;
    if x < 0.1 {
        discard;
    }
    visited += 1;
    return x * 0.9;
}

fn cut_in_loop(x: f32) -> f32 {
    var y = x;
    for (var i = 0; i < 4; i++) {
        y = fract(y * 1.7 + 0.1);
        if y > 0.93 {
            if x > 0.5 {
                discard;
            }
            return y * 0.5;
        }
    }
    return y;
}

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    let a = cut(uv.x) + cut(uv.y);
    switch i32(uv.x * 6.0) {
        case 2: {
            if uv.y < 0.3 {
                discard;
            }
        }
        case 4: {
            let b = cut_in_loop(uv.y);
            return vec4f(a * 0.4, b, f32(visited) * 0.1, 1.0);
        }
        default: {}
    }
    return vec4f(a * 0.5, cut_in_loop(uv.x), f32(visited) * 0.1, 1.0);
}
