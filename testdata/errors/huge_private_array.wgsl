var<private> table: array<f32, 100000000>;

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    table[u32(uv.x)] = 1.0;
    return vec4f(table[u32(uv.y)]);
}
