@group(0) @binding(0) var<uniform> pick: u32;

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    var weights: array<f32, 3>;

    weights[0] = uv.x;
    weights[1] = uv.y;
    weights[2] = uv.x * uv.y;
    let picked = weights[pick];
    return vec4f(uv, picked, 1.0);
}
