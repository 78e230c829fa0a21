// Returns at several depths of nested loops, with values that differ by path.
fn first_over(limit: f32, start: f32) -> f32 {
    var x = start;
    for (var i = 0; i < 4; i++) {
        var y = x;
        for (var j = 0; j < 5; j++) {
            y = y * 1.3 + 0.05 * f32(j);
            if y > limit * 3.0 {
                return y - limit;
            }
            if y < 0.05 {
                break;
            }
            if j == 3 && x > limit {
                return x + y;
            }
            if fract(y * 7.0) < 0.2 {
                continue;
            }
            y += 0.01;
        }
        x = y * 0.5;
        if x > limit {
            return x;
        }
    }
    return x * 0.25;
}

fn nothing_after(x: f32) -> f32 {
    if x > 0.5 {
        return 1.0 - x;
    } else {
        return x;
    }
}

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    let a = first_over(uv.x, uv.y);
    // Once more with other arguments: the copies must not share their locals.
    let b = first_over(uv.y * 0.5, uv.x);
    for (var i = 0; i < 3; i++) {
        if first_over(uv.x * f32(i), 0.3) > 0.9 {
            return vec4f(a, b, f32(i) * 0.25, 1.0);
        }
    }
    return vec4f(a, b, nothing_after(uv.x), 1.0);
}
