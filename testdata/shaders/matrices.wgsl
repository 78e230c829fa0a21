// Products both ways, columns and elements by varying index, every shape that is not square.
fn turned(angle: f32) -> mat3x3f {
    let c = cos(angle);
    let s = sin(angle);
    return mat3x3f(c, s, 0.0, -s, c, 0.0, 0.0, 0.0, 1.0);
}

@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) normal: vec3f) -> @location(0) vec4f {
    var m = turned(uv.x * 3.0);
    let i = u32(uv.y * 2.99);
    m[i] = normal;
    m[2 - i32(i)].y += 0.25;
    m[1][i] = uv.x;
    let n = transpose(m) * m + m * 0.5 - turned(0.3);
    let v = normal * n;
    let w = n * normal;

    let wide = mat3x2f(uv, uv.yx, vec2f(0.3, 0.6));
    let tall = transpose(wide);
    let square = wide * tall;
    let other = tall * wide;
    let long = mat4x2f(uv, uv * 2.0, uv * 3.0, uv * 4.0) * vec4f(0.1, 0.2, 0.3, 0.4);
    let high = mat2x4f(vec4f(uv, uv), vec4f(0.1, 0.2, 0.3, 0.4)) * uv;
    let shape = vec3f(determinant(square), determinant(other), determinant(m));
    let full = mat4x4f(high, vec4f(v, 1.0), vec4f(w, 1.0), vec4f(shape, 2.0));
    var rows: array<mat2x2f, 2>;
    rows[i & 1u] = square;
    rows[0][1] = long;
    rows[1] += rows[0];
    let folded = full * vec4f(rows[1] * uv, determinant(full) * 0.01, 1.0);
    return vec4f(fract(abs(folded.xyz) * 0.2), 1.0);
}
