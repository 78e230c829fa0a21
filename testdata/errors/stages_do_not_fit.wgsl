struct Varyings {
    @builtin(position) clip: vec4f,
    @location(0) uv: vec2f,
}

@vertex
fn vs_main(@location(0) position: vec3f, @location(1) uv: vec2f) -> Varyings {
    return Varyings(vec4f(position, 1.0), uv);
}

@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) shade: f32) -> @location(0) vec4f {
    return vec4f(uv * shade, 0.0, 1.0);
}
