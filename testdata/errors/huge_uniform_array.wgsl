struct Many {
    items: array<vec4f, 10000000>,
}

@group(0) @binding(0) var<uniform> many: Many;

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    return many.items[u32(uv.x)];
}
