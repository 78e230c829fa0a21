// Every way to loop and to leave a loop.
fn with_break_if(x: f32) -> f32 {
    var a = x;
    var n = 0;
    loop {
        a = a * 1.5 + 0.01;
        if n == 3 && a < 0.3 {
            continue;
        }
        let step = 1 + n / 4;
        a -= 0.05;
        continuing {
            n += 1;
            a += 0.001 * f32(n);
            break if a > 2.0 || n >= 7;
        }
    }
    return a + f32(n) * 0.01;
}

fn with_while(x: f32) -> f32 {
    var a = 1.0;
    // Beside a triangle, where helper lanes are, the coordinates may be negative.
    while a > abs(x) + 0.1 {
        a *= 0.7;
        while fract(a * 3.0) > 0.8 {
            a -= 0.07;
        }
    }
    return a;
}

fn only_leaves_by_return(x: f32) -> f32 {
    var a = x;
    loop {
        a += 0.3;
        if a > 1.0 {
            return a - 1.0;
        }
    }
    // Never reached; naga asks for it.
    return a;
}

fn never_entered(x: f32) -> f32 {
    var a = x;
    for (var i = 5; i < 5; i++) {
        a = 99.0;
    }
    while false {
        a = 98.0;
    }
    loop {
        break;
    }
    return a;
}

fn two_variables(x: f32) -> f32 {
    var low = 0.0;
    var high = 1.0;
    for (var i = 0; i < 6; i++) {
        let middle = (low + high) * 0.5;
        if middle * middle < x {
            low = middle;
        } else {
            high = middle;
        }
    }
    return (low + high) * 0.5;
}

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    var last = 0.0;
    var i = 0u;
    for (;;) {
        if i > 4u {
            break;
        }
        last = last * 0.5 + two_variables(uv.x * f32(i) * 0.25);
        i += 1u;
    }
    let r = with_break_if(uv.x) * 0.3 + only_leaves_by_return(uv.y) * 0.2;
    return vec4f(r, with_while(uv.y) * 0.5 + last * 0.2, never_entered(uv.x), 1.0);
}
