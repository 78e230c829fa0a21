// Two layers that are chosen apart, and arrays of which one has more layers than the other.
// expect: 0 candidates
// facts: texture few layers 2
@group(0) @binding(0) var tiles: texture_2d_array<f32>;
@group(0) @binding(1) var shades: texture_2d_array<f32>;
@group(0) @binding(2) var few: texture_2d_array<f32>;
@group(0) @binding(3) var smooth_sampler: sampler;

@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) @interpolate(flat) tile: u32, @location(2) @interpolate(flat) shade: u32) -> @location(0) vec4f {
    let a = textureSample(tiles, smooth_sampler, uv, tile) * textureSample(shades, smooth_sampler, uv, shade);
    let b = textureSample(shades, smooth_sampler, uv, tile) + textureSample(few, smooth_sampler, uv, tile);
    return a * uv.x + b * uv.y;
}
