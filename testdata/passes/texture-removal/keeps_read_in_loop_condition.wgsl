// The height decides when the march ends.
// expect: 0 candidates
@group(0) @binding(0) var heights: texture_2d<f32>;
@group(0) @binding(1) var smooth_sampler: sampler;

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    var depth = 1.0;
    loop {
        let height = textureSampleLevel(heights, smooth_sampler, uv * depth, 0.0).r;
        if height > depth { break; }
        depth -= 0.1;
    }
    return vec4f(depth);
}
