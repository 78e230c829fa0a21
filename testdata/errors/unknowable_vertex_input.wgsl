struct Varyings {
    @builtin(position) clip: vec4f,
    @location(0) wobble: vec3f,
}

@vertex
fn vs_main(@location(0) position: vec3f, @location(1) wibble: vec3f) -> Varyings {
    return Varyings(vec4f(position, 1.0), wibble);
}

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    return vec4f(in.wobble, 1.0);
}
