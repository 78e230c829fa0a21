const TAU = 6.28318;
const WEIGHTS = array<vec2f, 2>(vec2f(0.25, 0.5), vec2f(0.75, 1.0));

fn power(x: f32, n: i32) -> f32 {
    var result = x;
    if n > 2 {
        result *= x * f32(n + 1);
    }
    return result;
}

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    let zoom = vec2f(power(3.0, 1), 2.0).yx;
    let quiet = saturate(power(TAU, 4));
    return vec4f(uv * zoom * WEIGHTS[1].x, power(uv.x, 2), quiet);
}
