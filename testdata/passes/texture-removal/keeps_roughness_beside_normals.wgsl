// expect: 2 candidates
// facts: texture bumps slopes 0.04
// facts: fs_main.surface.normal mean 0.5 0.5 1.0 1.0
// Normals are one output and the square of the roughness is another: nothing here is made of both.

@group(0) @binding(0) var bumps: texture_2d<f32>;
@group(0) @binding(1) var smooth_sampler: sampler;
@group(0) @binding(2) var<uniform> roughness: f32;

struct Surface {
    @location(0) normal: vec4f,
    @location(1) glow: vec4f,
}

@fragment
fn fs_main(@location(0) uv: vec2f) -> Surface {
    var surface: Surface;
    surface.normal = textureSample(bumps, smooth_sampler, uv);
    let alpha = roughness * roughness;
    surface.glow = vec4f(uv, alpha * alpha, 1.0);
    return surface;
}
