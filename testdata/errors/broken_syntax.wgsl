@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    let colour = vec3f(uv, 0.0;
    return vec4f(colour, 1.0);
}
