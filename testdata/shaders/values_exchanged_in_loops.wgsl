// Variables that trade values every round: forwarding one store too far breaks them.
@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    var a = uv.x;
    var b = uv.y;
    var c = 0.5;
    let rounds = 2 + i32(uv.x * 4.0);
    for (var i = 0; i < rounds; i++) {
        let old = a;
        a = b;
        b = c;
        c = old;
        if i == 1 {
            let t = a;
            a = b * 0.9;
            b = t;
        }
    }
    var previous = 0.0;
    var current = uv.y;
    var n = 0;
    loop {
        let next = fract(current * 1.7 + previous);
        previous = current;
        current = next;
        n++;
        if n > 5 {
            break;
        }
        if current < 0.1 {
            current = previous;
            continue;
        }
    }
    // Read before and after a write in the same expression's neighbourhood.
    var v = vec2f(a, b);
    let w = v;
    v = v.yx;
    v.x = w.x + v.y;
    v = vec2f(v.y, v.x);
    return vec4f(v, (c + current + previous) * 0.33, 1.0);
}
