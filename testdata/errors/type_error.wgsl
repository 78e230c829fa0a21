@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    let tint = vec3f(1.0, 0.5, 0.2);
    return vec4f(tint + uv, 1.0);
}
