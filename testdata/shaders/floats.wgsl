// Every built-in function on floats, with arguments on both sides of zero.
@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) normal: vec3f) -> @location(0) vec4f {
    let x = uv.x * 4.0 - 2.0;
    let y = uv.y * 3.0 - 1.5;
    let v = vec3f(x, y, x * y);
    var sum = vec3f(0.0);
    sum += floor(v) + ceil(v) + round(v * 2.0) * 0.5 + trunc(v) + fract(v);
    sum += sign(v) * abs(v) + (v % vec3f(0.7)) - (v % vec3f(-0.6));
    sum += step(vec3f(0.3), v) + smoothstep(vec3f(-1.0), vec3f(1.0), v) + smoothstep(vec3f(1.0), vec3f(0.2), v);
    sum += clamp(v, vec3f(-0.5), vec3f(0.75)) + saturate(v) + mix(v, normal, 0.3) + mix(v, normal, abs(normal));
    sum += vec3f(sin(x), cos(y), tan(x * 0.5)) + vec3f(asin(uv.x), acos(uv.y), atan(x)) + vec3f(atan2(y, x), atan2(-x, y), 0.0);
    sum += vec3f(sinh(x), cosh(y), tanh(x)) + vec3f(asinh(x), acosh(1.0 + uv.y), atanh(uv.x * 0.9));
    sum += vec3f(exp(x), exp2(y), log(1.1 + uv.x)) + vec3f(log2(1.5 + uv.y), pow(uv.x + 0.1, y), sqrt(uv.y));
    sum += vec3f(inverseSqrt(uv.x + 0.2), fma(x, y, 0.5), degrees(x) * 0.01 + radians(y * 50.0));
    let parts = modf(x * 1.7);
    let vparts = modf(v);
    let split = frexp(y * 5.0 + 0.1);
    sum += vec3f(parts.fract, parts.whole, split.fract + f32(split.exp)) + vparts.whole * vparts.fract;
    sum += vec3f(ldexp(x, 2), ldexp(y, i32(uv.x * 4.0) - 2), quantizeToF16(x * 1.001));
    let n = normalize(normal);
    sum += reflect(v, n) + refract(normalize(v + vec3f(0.0, 0.0, 3.0)), n, 0.8) + faceForward(n, v, normal);
    sum += cross(v, n) + vec3f(dot(v, n), length(v), distance(v, n));
    sum += max(min(v, n), vec3f(-0.2)) + -v * 0.5;
    let order = select(vec3f(0.1), vec3f(0.9), v < n) + select(0.0, 0.5, all(v <= n)) + select(0.0, 0.25, any(v != n));
    return vec4f(fract(sum * 0.173 + order), 1.0);
}
