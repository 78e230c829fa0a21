// expect: 0 candidates
@fragment
fn fs_main(@location(0) a: vec3f, @location(1) s: f32) -> @location(0) vec4f {
    let masked = a * vec3f(1.0, 0.0, 1.0);
    let wide = vec3f(1.0) * s;
    return vec4f(masked + wide + 0.0 / a, 1.0 - s);
}
