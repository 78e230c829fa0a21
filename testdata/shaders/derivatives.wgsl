// Derivatives of inputs and of computed values, before a discard and after it, and inside functions.
fn stripes(x: f32) -> f32 {
    let width = fwidth(x);
    return saturate((abs(fract(x) - 0.5) - 0.2) / max(width, 1e-4));
}

fn bumped(height: f32, position: vec3f, n: vec3f) -> vec3f {
    let dx = dpdx(position);
    let dy = dpdy(position);
    let r1 = cross(dy, n);
    let r2 = cross(n, dx);
    let area = dot(dx, r1);
    let slope = sign(area) * (dpdx(height) * r1 + dpdy(height) * r2);
    return normalize(abs(area) * n - slope + n * 1e-9);
}

@fragment
fn fs_main(@builtin(position) at: vec4f, @location(0) uv: vec2f, @location(1) normal: vec3f, @location(2) position: vec3f)
    -> @location(0) vec4f {
    let height = sin(uv.x * 40.0) * cos(uv.y * 30.0) * 0.02;
    let n = bumped(height, position, normalize(normal));
    if fract(uv.x * 5.0 + uv.y) < 0.15 {
        discard;
    }
    let lines = stripes(uv.y * 12.0 + uv.x * uv.x);
    let fine = dpdxFine(at.x * uv.y) + dpdyFine(uv.x * 3.0) + fwidthFine(uv.y);
    let coarse = dpdxCoarse(uv.x) + dpdyCoarse(uv.y * at.y) + fwidthCoarse(uv.x * uv.y);
    return vec4f(saturate(n * 0.5 + 0.5) * lines, 1.0) + vec4f(fract(vec2f(fine, coarse) * 9.0) * 0.1, 0.0, 0.0);
}
