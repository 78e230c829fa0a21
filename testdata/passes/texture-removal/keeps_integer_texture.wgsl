// The number of a material has no mean.
// expect: 0 candidates
@group(0) @binding(0) var materials: texture_2d<u32>;

@fragment
fn fs_main(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    let id = textureLoad(materials, vec2i(pixel.xy), 0).r;
    return select(vec4f(0.2), vec4f(0.8), id == 3u);
}
