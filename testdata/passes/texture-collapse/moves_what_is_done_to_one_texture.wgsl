// One sample and what is done to it, in a function and through a variable.
// expect: 1 candidates
@group(0) @binding(0) var heights: texture_2d<f32>;
@group(0) @binding(1) var smooth_sampler: sampler;

fn steep(h: f32) -> f32 {
    var sum = 0.0;
    for (var i = 1; i < 4; i++) {
        sum += sin(h * f32(i)) / f32(i);
    }
    return sum;
}

@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) light: f32) -> @location(0) vec4f {
    let h = pow(textureSample(heights, smooth_sampler, uv).r, 2.2);
    return vec4f(vec3f(light), 1.0) * (steep(h) + 0.5);
}
