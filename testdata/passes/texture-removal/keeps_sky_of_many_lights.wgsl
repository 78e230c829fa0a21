// Four components of four lights would cost as much as the sample.
// expect: 2 candidates
// facts: texture sky lights 4
// facts: fs_main.shine min 0.0 max 4.0
@group(0) @binding(0) var sky: texture_cube<f32>;
@group(0) @binding(1) var smooth_sampler: sampler;

@fragment
fn fs_main(@location(0) mirrored: vec3f, @location(1) albedo: vec4f) -> @location(0) vec4f {
    let shine = textureSampleLevel(sky, smooth_sampler, mirrored, 4.0);
    return albedo * shine;
}
