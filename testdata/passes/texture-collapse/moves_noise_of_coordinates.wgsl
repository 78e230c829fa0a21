// Nothing but coordinates and numbers is in it: it costs a sample, and spares the rounds of the loop.
// expect: 2 candidates
@group(0) @binding(0) var albedo: texture_2d<f32>;
@group(0) @binding(1) var smooth_sampler: sampler;

fn waves(p: vec2f) -> f32 {
    var sum = 0.0;
    for (var i = 1; i < 6; i++) {
        sum += sin(p.x * 7.0 * f32(i)) * cos(p.y * 9.0 * f32(i)) / f32(i);
    }
    return sum;
}

@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) light: f32) -> @location(0) vec4f {
    let marble = 0.5 + 0.25 * waves(uv + 0.1 * waves(uv.yx));
    return textureSample(albedo, smooth_sampler, uv) * (marble * light);
}
