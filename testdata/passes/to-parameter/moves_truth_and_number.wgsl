// expect: 4 candidates
struct Sky { sun: vec3f, up: vec3f, steps: f32 }
@group(0) @binding(0) var<uniform> sky: Sky;

@fragment fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    let rounds = u32(sqrt(sky.steps) * 4.0);
    var sum = 0.0;
    for (var i = 0u; i < min(rounds, 8u); i++) {
        sum += fract(uv.x * f32(i));
    }
    if dot(sky.sun, sky.up) > 0.0 {
        sum *= uv.y;
    }
    return vec4f(sum);
}
