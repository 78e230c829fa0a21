@group(0) @binding(0) var<uniform> steps: f32;

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    var edge: f32 = 1.0;

    let width = fwidth(uv.x);
    if steps > 0.0 {
        edge = dpdxCoarse(uv.x * steps) + dpdyFine(uv.y);
    }
    return vec4f(uv, edge / width, 1.0);
}
