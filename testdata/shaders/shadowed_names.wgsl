// The same name for a global, parameters, locals and loop variables.
const x = 0.25;
var<private> y: f32 = 0.5;

fn f(x: f32) -> f32 {
    let y = x * 2.0;
    var z = y;
    if y > 0.5 {
        let y = y - 0.5;
        var z = y;
        z += x;
        {
            let x = z * 0.5;
            z = x + y;
        }
        return z;
    }
    for (var y = 0; y < 3; y++) {
        let x = f32(y);
        for (var y = 0; y < 2; y++) {
            z += x * f32(y) * 0.1;
        }
    }
    return z;
}

fn g() -> f32 {
    y += x;
    let x = y;
    return x;
}

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    let f0 = f(uv.x);
    let x = g() + x;
    var y = y * uv.y;
    y += x;
    return vec4f(f0, x * 0.5, y * 0.5, 1.0);
}
