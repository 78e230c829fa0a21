// Each read may go, and all three at once, which frees the texture.
// expect: 8 candidates
// facts: fs_main.side mean 0.25 0.25 0.25 1.0
@group(0) @binding(0) var rock: texture_2d<f32>;
@group(0) @binding(1) var smooth_sampler: sampler;

@fragment
fn fs_main(@location(0) p: vec3f, @location(1) blend: vec3f) -> @location(0) vec4f {
    let side = textureSample(rock, smooth_sampler, p.yz);
    let top = textureSample(rock, smooth_sampler, p.xz);
    let front = textureSample(rock, smooth_sampler, p.xy);
    return side * blend.x + top * blend.y + front * blend.z;
}
