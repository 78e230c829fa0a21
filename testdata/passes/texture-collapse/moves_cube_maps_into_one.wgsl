// Two skies in one direction are one sky.
// expect: 1 candidates
@group(0) @binding(0) var day: texture_cube<f32>;
@group(0) @binding(1) var stars: texture_cube<f32>;
@group(0) @binding(2) var smooth_sampler: sampler;

@fragment
fn fs_main(@location(0) r: vec3f, @location(1) shine: f32) -> @location(0) vec4f {
    let sky = mix(textureSample(day, smooth_sampler, r), textureSample(stars, smooth_sampler, r), 0.25);
    return sky * shine;
}
