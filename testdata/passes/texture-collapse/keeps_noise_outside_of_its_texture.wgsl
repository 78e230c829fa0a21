// Coordinates that leave 0..1, a branch, in which there is no implicit level of detail, and little work.
// expect: 0 candidates
// facts: texture albedo dynamic
// facts: fs_main.far min -3.0 max 3.0
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
fn fs_main(@location(0) uv: vec2f, @location(1) far: vec2f, @location(2) light: f32) -> @location(0) vec4f {
    var shade = light * waves(far);
    if light > 0.5 {
        shade += waves(uv);
    }
    return textureSample(albedo, smooth_sampler, far) * shade * sin(uv.x);
}
