// A read in a branch leaves the branch in place.
// expect: 2 candidates
@group(0) @binding(0) var sky: texture_cube<f32>;
@group(0) @binding(1) var smooth_sampler: sampler;

@fragment
fn fs_main(@location(0) r: vec3f, @location(1) gloss: f32) -> @location(0) vec4f {
    var colour = vec3f(0.0);
    if gloss > 0.5 {
        colour = textureSampleLevel(sky, smooth_sampler, r, 2.0).rgb * gloss;
    }
    return vec4f(colour, 1.0);
}
