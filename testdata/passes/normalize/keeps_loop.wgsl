@group(0) @binding(0) var<uniform> count: u32;

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    var sum: f32 = 0.0;

    for (var i = 0u; i < count; i += 1u) {
        sum += sin(uv.x * f32(i));
    }
    return vec4f(uv, sum, 1.0);
}
