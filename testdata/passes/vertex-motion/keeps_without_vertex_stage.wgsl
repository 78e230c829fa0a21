// expect: 0 candidates
@fragment fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    let ring = exp(-8.0 * dot(uv, uv));
    return vec4f(vec3f(ring * 0.7), 1.0);
}
