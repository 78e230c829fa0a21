// expect: 1 candidates
@group(0) @binding(0) var<uniform> lights: array<vec4f, 4>;
@group(0) @binding(1) var<uniform> strength: f32;

@fragment fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    var sum = vec4f();
    for (var i = 0u; i < 4u; i++) {
        let towards = normalize(lights[i]);
        sum += towards * fract(uv.x * f32(i));
        if fract(sum.x) > uv.y { break; }
    }
    var weight = strength;
    for (var i = 0u; i < 4u; i++) {
        weight = sqrt(weight);
        if weight * uv.x > 0.5 { break; }
    }
    if uv.x > 0.5 {
        sum /= uv.y - strength;
    }
    return sum * weight;
}
