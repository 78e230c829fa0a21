// No sample came to the branch, so the read has no seen mean; the texture has one.
// expect: 1 candidates
// facts: fs_main.rare unseen
@group(0) @binding(0) var ice: texture_2d<f32>;
@group(0) @binding(1) var smooth_sampler: sampler;

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    let rare = textureSample(ice, smooth_sampler, uv);
    return rare;
}
