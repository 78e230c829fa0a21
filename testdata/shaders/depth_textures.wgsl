// Shadow maps: comparison in two dimensions, in an array and in a cube, and depth read as a number.
@group(0) @binding(0) var shadow: texture_depth_2d;
@group(0) @binding(1) var cascades: texture_depth_2d_array;
@group(0) @binding(2) var point_shadow: texture_depth_cube;
@group(0) @binding(3) var compare: sampler_comparison;
@group(0) @binding(4) var plain: sampler;

fn softened(uv: vec2f, depth: f32) -> f32 {
    var sum = 0.0;
    for (var i = 0; i < 4; i++) {
        let offset = vec2f(f32(i & 1), f32(i >> 1u)) - 0.5;
        sum += textureSampleCompareLevel(shadow, compare, uv + offset * 0.01, depth);
    }
    return sum * 0.25;
}

@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) normal: vec3f) -> @location(0) vec4f {
    let hard = textureSampleCompare(shadow, compare, uv, 0.5);
    let cascade = textureSampleCompareLevel(cascades, compare, uv, i32(uv.y * 1.9), uv.x);
    let around = textureSampleCompareLevel(point_shadow, compare, normal, 0.4);
    let stored = textureSample(shadow, plain, uv) + textureLoad(shadow, vec2i(1, 2), 0);
    return vec4f(hard * 0.5 + around * 0.2, softened(uv, uv.y) * 0.6 + cascade * 0.2, fract(stored), 1.0);
}
