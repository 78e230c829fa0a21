// The author has an autoLOD already, and uses it.
struct Draw {
    tint: vec3f,
    autoLOD: f32,
}

@group(0) @binding(0) var<uniform> draw: Draw;
override autoLOD: f32 = 0.0;

@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) normal: vec3f) -> @location(0) vec4f {
    var shade = dot(normalize(normal), vec3f(0.3, 0.8, 0.5)) * 0.5 + 0.5;
    if autoLOD < 2.0 {
        shade += 0.1 * sin(uv.x * 80.0) * sin(uv.y * 60.0);
    }
    return vec4f(draw.tint * shade, 1.0);
}
