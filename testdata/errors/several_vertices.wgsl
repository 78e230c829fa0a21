struct Varyings {
    @builtin(position) clip: vec4f,
    @location(0) uv: vec2f,
}

@vertex
fn vs_flat(@location(0) position: vec3f, @location(1) uv: vec2f) -> Varyings {
    return Varyings(vec4f(position, 1.0), uv);
}

@vertex
fn vs_waving(@location(0) position: vec3f, @location(1) uv: vec2f) -> Varyings {
    return Varyings(vec4f(position.xy, sin(position.x), 1.0), uv);
}

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    return vec4f(in.uv, 0.0, 1.0);
}
