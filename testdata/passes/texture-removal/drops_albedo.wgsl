// The mean that was seen, or the whole texture's.
// expect: 2 candidates
// facts: fs_main.albedo mean 0.6 0.5 0.4 1.0
@group(0) @binding(0) var albedo_map: texture_2d<f32>;
@group(0) @binding(1) var smooth_sampler: sampler;

@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) light: f32) -> @location(0) vec4f {
    let albedo = textureSample(albedo_map, smooth_sampler, uv);
    return vec4f(albedo.rgb * light, albedo.a);
}
