// One function, called with several textures and samplers, through another function and with early returns.
@group(0) @binding(0) var first: texture_2d<f32>;
@group(0) @binding(1) var second: texture_2d<f32>;
@group(0) @binding(2) var linear: sampler;
@group(0) @binding(3) var nearest: sampler;

fn read(t: texture_2d<f32>, s: sampler, uv: vec2f, level: f32) -> vec3f {
    if level < 0.0 {
        return vec3f(0.5);
    }
    let value = textureSampleLevel(t, s, uv, level).rgb;
    if value.g > 0.6 {
        return value.bgr;
    }
    return value;
}

fn slope(height: texture_2d<f32>, s: sampler, uv: vec2f) -> vec2f {
    let step = 1.0 / f32(textureDimensions(height).x);
    let here = read(height, s, uv, 0.0).g;
    return vec2f(read(height, s, uv + vec2f(step, 0.0), 0.0).g, read(height, s, uv + vec2f(0.0, step), 0.0).g) - here;
}

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    let a = slope(first, linear, uv);
    let b = slope(second, nearest, uv * 2.0);
    var sum = read(second, linear, uv, uv.x * 4.0 - 1.0) + read(first, nearest, uv.yx, 2.0);
    for (var i = 0; i < 2; i++) {
        sum += read(first, linear, uv * f32(i + 1), f32(i)) * 0.2;
    }
    return vec4f(sum * 0.4 + vec3f(a + b, 0.0), 1.0);
}
