// A built-in function leaves its operand, and one of several if it has more of its type.
// expect: 12 candidates
@fragment
fn fs_main(@location(0) normal: vec3f, @location(1) view: vec3f) -> @location(0) vec4f {
    let n = normalize(normal);
    let r = reflect(-view, n);
    return vec4f(r, dot(n, r));
}
