// The author's own functions, types and locals take the names of built-in ones, as WGSL allows.
alias float3 = vec3f;

fn saturate(x: f32) -> f32 {
    return x / (1.0 + abs(x));
}

fn select(a: f32, b: f32, t: f32) -> f32 {
    return a + (b - a) * t;
}

fn reflect(v: float3, n: float3) -> float3 {
    return v + n * 0.25;
}

fn pick(x: f32, y: f32) -> f32 {
    // Normal form likes to merge this with a select of its own.
    var result = x;
    if y > 0.5 {
        result = y * 2.0;
    }
    return result;
}

@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) normal: vec3f) -> @location(0) vec4f {
    let max = max(uv.x, uv.y);
    let length = length(uv) * max;
    var min = min(length, 0.75);
    min += pick(uv.x, uv.y) * 0.1;
    let normalize = normalize(normal);
    let clamped = clamp(min * 2.0, 0.0, 1.0);
    let mixed = select(saturate(uv.x * 4.0 - 2.0), clamped, uv.y);
    return vec4f(reflect(normalize, float3(0.5)) * 0.5 + mixed * 0.3, 1.0);
}
