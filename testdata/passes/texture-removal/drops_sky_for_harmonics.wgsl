// expect: 3 candidates
// facts: texture sky harmonics 1
// Alpha is not used, so that it is not computed.
@group(0) @binding(0) var sky: texture_cube<f32>;
@group(0) @binding(1) var smooth_sampler: sampler;
@fragment
fn fs_main(@location(0) normal: vec3f, @location(1) albedo: vec3f) -> @location(0) vec4f {
    let light = textureSampleLevel(sky, smooth_sampler, normal, 5.0).rgb;
    return vec4f(albedo * light, 1.0);
}
