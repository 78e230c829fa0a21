@group(0) @binding(0) var mask: texture_2d<f32>;

@fragment
fn fs_main(@location(0) uv: vec2f, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    var shade = 0.0;
    if front && uv.x > 0.5 || uv.y > 0.75 {
        shade = 1.0;
    }
    if front || textureLoad(mask, vec2i(1, 2), 0).x > 0.5 {
        shade += sin(uv.x);
    }
    return vec4f(shade);
}
