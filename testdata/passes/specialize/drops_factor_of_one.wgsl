// expect: 9 candidates
@fragment
fn fs_main(@location(0) a: vec3f, @location(1) b: vec3f, @location(2) c: f32) -> @location(0) vec4f {
    let one = a * vec3f(1.0);
    let scaled = 1.0 * c;
    let divided = one / vec3f(1.0, 1.0, 1.0);
    let moved = vec3f(0.0) + divided;
    let back = moved - vec3f(0.0);
    let first = mix(back, b, 0.0);
    let second = mix(a, first, vec3f(1.0));
    let sum = fma(b, vec3f(0.0), second);
    let sums = fma(vec3f(), a, sum);
    return vec4f(sums, scaled);
}
