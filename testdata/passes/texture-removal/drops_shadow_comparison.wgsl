// How much light came through has a mean over the samples; the depths' mean means nothing.
// expect: 3 candidates
@group(0) @binding(0) var shadow_map: texture_depth_2d;
@group(0) @binding(1) var shadow_sampler: sampler_comparison;

@fragment
fn fs_main(@location(0) place: vec3f) -> @location(0) vec4f {
    let near = textureSampleCompare(shadow_map, shadow_sampler, place.xy, place.z);
    let far = textureSampleCompare(shadow_map, shadow_sampler, place.xy * 0.5, place.z);
    return vec4f(vec3f(near + far), 1.0);
}
