// Surroundings with two lamps that a rough surface mirrors: an ambient light and two lobes, which cost less than the sample.
// expect: 3 candidates
// facts: texture sky lights 2
// facts: fs_main.shine min 0.0 max 4.0
@group(0) @binding(0) var sky: texture_cube<f32>;
@group(0) @binding(1) var smooth_sampler: sampler;

@fragment
fn fs_main(@location(0) mirrored: vec3f, @location(1) albedo: vec3f) -> @location(0) vec4f {
    let shine = textureSampleLevel(sky, smooth_sampler, mirrored, 4.0).rgb;
    return vec4f(albedo * shine, 1.0);
}
