// expect: 0 candidates
// facts: texture detail dynamic
// facts: fs_main.rare unseen
struct Waves { speed: f32, height: f32, length: f32 }
@group(0) @binding(0) var<uniform> waves: Waves;
@group(0) @binding(1) var detail: texture_2d<f32>;
@group(0) @binding(2) var filtering: sampler;

@fragment fn fs_main(@location(0) uv: vec2f, @location(1) rare: f32) -> @location(0) vec4f {
    let phase = sin(atan2(uv.y, uv.x) * waves.length);
    let cell = floor(uv.x * 8.0) / waves.length;
    let map = textureSample(detail, filtering, uv).r / waves.height;
    let unseen = rare / waves.speed;
    return vec4f(phase, cell, map, unseen);
}
