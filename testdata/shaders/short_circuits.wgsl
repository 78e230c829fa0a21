// The right side of && and || runs only when it is asked, and here that can be seen.
var<private> asked: i32;

fn ask(answer: bool) -> bool {
    asked += 1;
    return answer;
}

fn ask_early(x: f32) -> bool {
    if x > 0.7 {
        asked += 10;
        return true;
    }
    return ask(x > 0.3);
}

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    let left = uv.x > 0.5;
    let right = uv.y > 0.5;
    let a = left && ask(right);
    let b = right || ask_early(uv.x);
    var c = (left || ask(right)) && (ask_early(uv.y) || ask(left));
    if !(a || ask(b)) && ask(c) {
        c = !c;
    }
    while ask(left) && asked < 20 {
        asked += 5;
    }
    // The operators that always take both sides.
    let d = a | ask(b);
    let e = c & ask(a);
    return vec4f(f32(asked) * 0.04, select(0.0, 0.5, d) + select(0.0, 0.25, e), select(0.2, 0.8, b), 1.0);
}
