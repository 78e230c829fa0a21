// Code that cannot run or does not matter, mixed with code that does.
struct Unused {
    a: f32,
    b: vec3f,
}

@group(0) @binding(7) var<uniform> unused_uniform: vec4f;
var<private> effect: f32;

fn never_called(x: f32) -> f32 {
    return x / unused_uniform.x;
}

fn with_effect(x: f32) -> f32 {
    effect += 0.25;
    return x * 1000.0;
}

fn returns_twice(x: f32) -> f32 {
    return x;
}

fn after_break(x: f32) -> f32 {
    var y = x;
    loop {
        y += 0.1;
        if true {
            break;
        }
        y = 50.0;
    }
    if false {
        y = 60.0;
        return y;
    }
    return y;
}

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    let unused = uv.x * 3.0;
    var written: f32;
    written = uv.y;
    written = uv.x;
    _ = with_effect(written);
    with_effect(2.0);
    var stored: array<Unused, 2>;
    stored[1].b = vec3f(uv, 1.0);
    stored[0].a = returns_twice(uv.y);
    if uv.x > 2.0 {
        written = with_effect(uv.y);
    } else {
    }
    var overwritten = vec3f(1.0);
    overwritten.x = 2.0;
    overwritten = vec3f(written, after_break(uv.y), effect);
    return vec4f(overwritten * 0.7, 1.0);
}
