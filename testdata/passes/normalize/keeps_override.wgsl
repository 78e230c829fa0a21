override detail: f32 = 2.0;
@id(7) override quality: i32 = 1;

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    var shade = uv.x;
    if quality > 0 {
        shade = sin(uv.x * detail);
    }
    return vec4f(uv, shade, 1.0);
}
