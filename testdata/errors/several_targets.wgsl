struct Targets {
    @location(0) albedo: vec4f,
    @location(1) normal: vec2f,
}

@fragment
fn fs_main(@location(0) normal: vec3f) -> Targets {
    return Targets(vec4f(0.5), normal.xy);
}
