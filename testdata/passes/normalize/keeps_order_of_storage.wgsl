@group(0) @binding(0) var<storage, read_write> counter: array<u32, 2>;

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    let before = counter[0];
    counter[0] = before + 1u;
    let after = counter[0];
    counter[1] = after;
    return vec4f(f32(before), f32(after), uv);
}
