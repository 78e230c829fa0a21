@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    let glow = pow(uv.x, 4.0);
    return vec4f(glow);
}
