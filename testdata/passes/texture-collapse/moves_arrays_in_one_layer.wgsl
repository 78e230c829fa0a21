// Both arrays are read in the layer of the tile, and the grime is the same in each: every layer is made.
// expect: 1 candidates
@group(0) @binding(0) var tiles: texture_2d_array<f32>;
@group(0) @binding(1) var shades: texture_2d_array<f32>;
@group(0) @binding(2) var grime: texture_2d<f32>;
@group(0) @binding(3) var smooth_sampler: sampler;

@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) light: f32, @location(2) @interpolate(flat) tile: u32) -> @location(0) vec4f {
    let tinted = textureSample(tiles, smooth_sampler, uv, tile).rgb * textureSample(shades, smooth_sampler, uv, tile).rgb;
    let dirty = tinted * textureSample(grime, smooth_sampler, uv).rgb;
    return vec4f(dirty * light, 1.0);
}
