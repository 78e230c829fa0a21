@group(0) @binding(0) var detail: texture_2d<f32>;
@group(0) @binding(1) var smooth_sampler: sampler;

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    var height: f32;

    if uv.x > 0.5 {
        height = textureSampleLevel(detail, smooth_sampler, uv, 0.0).x;
    } else {
        height = pow(uv.y, 3.0);
    }
    return vec4f(uv, height, 1.0);
}
