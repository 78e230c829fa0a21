// A layer that is known is a texture like any other.
// expect: 1 candidates
@group(0) @binding(0) var tiles: texture_2d_array<f32>;
@group(0) @binding(1) var grime: texture_2d<f32>;
@group(0) @binding(2) var smooth_sampler: sampler;

@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) light: f32) -> @location(0) vec4f {
    let mixed = mix(textureSample(tiles, smooth_sampler, uv, 2), textureSample(tiles, smooth_sampler, uv, 3), 0.5);
    return vec4f(mixed.rgb * textureSample(grime, smooth_sampler, uv).rgb * light, 1.0);
}
