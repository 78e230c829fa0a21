var<private> seed: u32 = 7u;
var<private> tint: vec3f;

fn next() -> f32 {
    seed = seed * 1664525u + 1013904223u;
    return f32(seed >> 8u) / 16777216.0;
}

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    seed += u32(uv.x * 64.0);
    tint.x = next();
    tint.y = next();
    return vec4f(tint, 1.0);
}
