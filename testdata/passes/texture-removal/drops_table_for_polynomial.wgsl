// expect: 3 candidates
// facts: texture reflectance polynomial 1
// facts: texture reflectance polynomial 3
// A simpler sum goes first; one of a higher degree that is hardly nearer is left out.
@group(0) @binding(0) var reflectance: texture_2d<f32>;
@group(0) @binding(1) var smooth_sampler: sampler;
@fragment
fn fs_main(@location(0) angle: f32, @location(1) roughness: f32) -> @location(0) vec4f {
    let scale = textureSample(reflectance, smooth_sampler, vec2f(angle, roughness));
    return vec4f(0.04 * scale.x + scale.y);
}
