// The lobe is multiplied by 0; each step that follows from it is a change of its own.
// expect: 2 candidates
const COAT = 0.0;
@fragment
fn fs_main(@location(0) cosine: f32, @location(1) base: vec3f) -> @location(0) vec4f {
    let lobe = pow(saturate(cosine), 64.0);
    let coated = COAT * lobe;
    let rest = dot(base, vec3f(0.0));
    return vec4f(base + coated, rest);
}
