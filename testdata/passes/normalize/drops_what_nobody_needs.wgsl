@group(0) @binding(0) var albedo: texture_2d<f32>;
@group(0) @binding(1) var smooth_sampler: sampler;
var<private> unused: f32;

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    var kept = uv.x;
    let sampled = textureSample(albedo, smooth_sampler, uv);
    var sum = 0.0;
    for (var i = 0; i < 4; i++) {
        sum += sampled.x;
        unused = sum;
    }
    if false {
        kept = sum;
    }
    kept = uv.y;
    return vec4f(kept);
}
