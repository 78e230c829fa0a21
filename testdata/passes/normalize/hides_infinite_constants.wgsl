fn inverse_of(x: f32) -> f32 {
    return 1.0 / x;
}

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    return vec4f(uv, inverse_of(0.0), inverse_of(4.0));
}
