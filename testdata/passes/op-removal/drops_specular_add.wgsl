// Either side of a sum or product may go.
// expect: 8 candidates
@group(0) @binding(0) var<uniform> shine: f32;

@fragment
fn fs_main(@location(0) albedo: vec3f, @location(1) lobe: f32) -> @location(0) vec4f {
    let specular = lobe * shine;
    return vec4f(albedo + specular, 1.0);
}
