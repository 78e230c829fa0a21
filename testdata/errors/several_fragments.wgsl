@fragment
fn fs_opaque(@location(0) uv: vec2f) -> @location(0) vec4f {
    return vec4f(uv, 0.0, 1.0);
}

@fragment
fn fs_masked(@location(0) uv: vec2f) -> @location(0) vec4f {
    if uv.x < 0.5 {
        discard;
    }
    return vec4f(uv, 0.0, 1.0);
}
