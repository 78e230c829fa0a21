// The guard's value reaches the root through a sum, a product and a vector.
// expect: 8 candidates
@fragment
fn fs_main(@location(0) light: vec3f, @location(1) glow: vec3f) -> @location(0) vec4f {
    let lit = max(light, vec3f(0.0)) * 0.8 + glow;
    return vec4f(sqrt(lit), 1.0);
}
