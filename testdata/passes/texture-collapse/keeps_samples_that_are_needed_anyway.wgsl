// Both textures are read by something else too, so that a new one would be one access more; and two samplers differ.
// expect: 0 candidates
@group(0) @binding(0) var albedo: texture_2d<f32>;
@group(0) @binding(1) var occlusion: texture_2d<f32>;
@group(0) @binding(2) var smooth_sampler: sampler;
@group(0) @binding(3) var sharp: sampler;

@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) light: vec4f) -> @location(0) vec4f {
    let a = textureSample(albedo, smooth_sampler, uv);
    let o = textureSample(occlusion, smooth_sampler, uv);
    let mixed = textureSample(albedo, sharp, uv) + textureSample(occlusion, smooth_sampler, uv + 0.5);
    return a * o + a * light.x + o * light.y + mixed * light.z;
}
