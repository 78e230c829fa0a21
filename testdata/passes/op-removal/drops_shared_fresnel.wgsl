// Two products share the power: it dies only when both do without it.
// expect: 17 candidates
@fragment
fn fs_main(@location(0) cosine: f32, @location(1) sky: vec3f, @location(2) coat: vec3f) -> @location(0) vec4f {
    let fresnel = pow(saturate(1.0 - cosine), 5.0);
    let mirrored = sky * fresnel;
    let coated = coat * fresnel;
    return vec4f(mirrored + coated * coated.x, 1.0);
}
