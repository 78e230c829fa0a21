// expect: 2 candidates
// facts: texture heights polynomial 1
// facts: fs_main.height.sample min -1 max 1 mean 0.5
@group(0) @binding(0) var heights: texture_2d<f32>;
@group(0) @binding(1) var smooth_sampler: sampler;
@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    let height = textureSample(heights, smooth_sampler, uv).x;
    return vec4f(height * 0.5 + 0.5);
}
