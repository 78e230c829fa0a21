@group(0) @binding(0) var height: texture_2d<f32>;

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    for (var i = 0; i < 8; i++) {
        let depth = f32(i) / 8.0;
        for (var j = 0; j < 2; j++) {
            if textureLoad(height, vec2i(i, j), 0).r < depth {
                return vec4f(depth);
            }
        }
    }
    return vec4f(uv, 0.0, sin(uv.x));
}
