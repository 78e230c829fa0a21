@group(0) @binding(0) var layers: texture_2d_array<f32>;
@group(0) @binding(1) var sky: texture_cube<f32>;
@group(0) @binding(2) var shadow: texture_depth_2d;
@group(0) @binding(3) var smooth_sampler: sampler;
@group(0) @binding(4) var compare: sampler_comparison;

@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) @interpolate(flat) layer: i32) -> @location(0) vec4f {
    let a = textureSample(layers, smooth_sampler, uv, layer);
    let b = textureSampleBias(sky, smooth_sampler, vec3f(uv, 1.0), 0.5);
    let c = textureSampleCompareLevel(shadow, compare, uv, 0.5);
    let d = textureLoad(layers, vec2i(3, 4), layer, textureNumLevels(sky));
    let e = textureGather(1, layers, smooth_sampler, uv, layer);
    let f = textureSampleGrad(sky, smooth_sampler, vec3f(1.0, uv), a.xyz, b.xyz);
    return (a + b) * c + d * e - f;
}
