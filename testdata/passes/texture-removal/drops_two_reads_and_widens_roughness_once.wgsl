// expect: 7 candidates
// facts: texture bumps slopes 0.25 0.125
// facts: fs_main.coarse.sample mean 0.5 0.5 1.0 1.0
// facts: fs_main.fine.sample mean 0.5 0.5 1.0 1.0
// The map is read twice, and its slopes are added once. Each light squares the roughness twice, one keeps it off 0.
@group(0) @binding(0) var bumps: texture_2d<f32>;
@group(0) @binding(1) var smooth_sampler: sampler;
@group(0) @binding(2) var<uniform> perceptual_roughness: f32;
struct Input { @location(0) uv: vec2f, @location(1) first: vec3f, @location(2) second: vec3f }
fn highlight(cosine: f32, alpha: f32) -> f32 {
    let d = cosine * cosine * (alpha * alpha - 1.0) + 1.0;
    return alpha * alpha / (d * d);
}
@fragment
fn fs_main(in: Input) -> @location(0) vec4f {
    let coarse = textureSample(bumps, smooth_sampler, in.uv).xyz * 2.0 - 1.0;
    let fine = textureSample(bumps, smooth_sampler, in.uv * 8.0).xyz * 2.0 - 1.0;
    let normal = normalize(vec3f(coarse.xy + fine.xy, coarse.z * fine.z));
    let roughness = perceptual_roughness * in.uv.x;
    var light = 0.0;
    if in.first.z > 0.0 { light += highlight(dot(normal, in.first), max(roughness * roughness, 0.002)); }
    if in.second.z > 0.0 { light += highlight(dot(normal, in.second), pow(roughness, 2.0)); }
    return vec4f(vec3f(light), 1.0);
}
