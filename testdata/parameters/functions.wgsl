// The functions of floats: those that are exact, and those that are not.
struct Given {
    a: vec4f,
    b: vec4f,
    c: vec4f,
    n: vec3f,
    m: vec3f,
}
@group(0) @binding(0) var<uniform> given: Given;

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    let a = given.a;
    let b = given.b;
    let c = given.c;
    let exact_steps = floor(a) + ceil(b) - round(a) * trunc(b) + fract(c) * sign(a) + a % b;
    let exact_bounds = min(a, b) + max(b, c) * clamp(a, b, c) - saturate(c) + abs(b) - step(a, b);
    let exact_blends = mix(a, b, c) + mix(b, c, a.x) - smoothstep(a, b, c) + fma(a, b, c) + radians(a) - degrees(b);
    let exact_roots = sqrt(a) + inverseSqrt(b) + vec4f(modf(a.x).fract, modf(b.y).whole, length(c.x), distance(a, b));
    let exact_ways = reflect(given.n, given.m) + cross(given.n, given.m) * dot(given.n, given.m) + normalize(given.n);
    let exact_bends = refract(given.n, given.m, a.x) + faceForward(given.n, given.m, c.xyz) - length(given.m);
    let exact_tests = select(a, b, a < b) + select(b, c, a.x >= b.x && !(c.x != a.y));
    let powers = vec4f(exp(a.x), exp2(a.y), exp(b.z), exp2(b.w));
    let logarithms = vec4f(log(a.x), log2(a.y), log(b.z), log2(b.w));
    let turns = vec4f(sin(a.x), cos(a.y), sin(b.z), cos(b.w));
    let slopes = vec4f(tan(a.x), tan(b.y), atan(a.z), atan(b.w));
    let angles = vec4f(asin(a.x), acos(a.y), asin(b.z), acos(b.w));
    let quadrants = atan2(a, b);
    let hyperbolas = vec4f(sinh(a.x), cosh(a.y), tanh(a.z), sinh(b.w));
    let areas = vec4f(asinh(a.x), acosh(a.y), atanh(a.z), acosh(b.w));
    let raised = pow(a, b);
    let left = exact_steps * uv.x + exact_bounds * uv.y + exact_blends + exact_roots * uv.xyxy + exact_tests * uv.x;
    let right = vec4f((exact_ways * uv.x + exact_bends) * uv.y, 1.0) + quadrants * uv.y + raised * uv.x;
    let others = powers * uv.x + logarithms * uv.y + turns * uv.x + slopes * uv.y + angles * uv.x;
    return left + right + others + hyperbolas * uv.x + areas * uv.y;
}
