// Every way to read a texture that has an image, also through functions that take it as an argument.
@group(0) @binding(0) var flat: texture_2d<f32>;
@group(0) @binding(1) var layers: texture_2d_array<f32>;
@group(0) @binding(2) var sky: texture_cube<f32>;
@group(0) @binding(3) var smooth_sampler: sampler;
@group(0) @binding(4) var clamped_sampler: sampler;

fn blurred(t: texture_2d<f32>, s: sampler, uv: vec2f) -> vec4f {
    let texel = 1.0 / vec2f(textureDimensions(t));
    var sum = vec4f(0.0);
    for (var y = -1; y <= 1; y++) {
        for (var x = -1; x <= 1; x++) {
            sum += textureSampleLevel(t, s, uv + vec2f(f32(x), f32(y)) * texel, 0.0);
        }
    }
    return sum / 9.0;
}

fn texel_at(t: texture_2d<f32>, uv: vec2f, level: i32) -> vec4f {
    let size = vec2f(textureDimensions(t, level));
    return textureLoad(t, vec2i(clamp(uv * size, vec2f(0.0), size - 1.0)), level);
}

@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) normal: vec3f) -> @location(0) vec4f {
    let dx = dpdx(uv);
    let dy = dpdy(uv);
    var sum = textureSample(flat, smooth_sampler, uv * 2.0);
    sum += textureSampleBias(flat, smooth_sampler, uv, 1.5);
    sum += textureSample(flat, clamped_sampler, uv * 1.5 - 0.2, vec2i(2, -3));
    sum += textureSample(layers, smooth_sampler, uv, i32(uv.x * 2.99));
    sum += textureSample(sky, smooth_sampler, normal);
    sum += textureSampleBias(sky, smooth_sampler, normal.zxy, -0.5);
    if uv.y > 0.5 {
        sum += textureSampleGrad(flat, smooth_sampler, uv * 3.0, dx * 3.0, dy * 3.0);
        sum += textureSampleLevel(layers, clamped_sampler, uv, 1, uv.x * 3.0);
        sum += textureSampleGrad(layers, smooth_sampler, uv, 2, dx, dy * 4.0);
        sum += textureSampleLevel(sky, smooth_sampler, normal, uv.y * 4.0);
    }
    sum += blurred(flat, clamped_sampler, uv);
    sum += texel_at(flat, uv, 0) + texel_at(flat, uv.yx, 2);
    sum += textureLoad(layers, vec2u(uv * 7.0), 1u, 3u);
    sum += textureGather(1, flat, smooth_sampler, uv) * 0.5 + textureGather(0, flat, clamped_sampler, uv, vec2i(1, 1)) * 0.5;
    let sizes = f32(textureNumLevels(flat)) * 0.01 + f32(textureNumLayers(layers)) * 0.02 + f32(textureDimensions(sky).x) * 0.001;
    return vec4f(fract(sum.rgb * 0.2 + sizes), 1.0);
}
