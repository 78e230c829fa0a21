// Cells are counted, angles are turned by, and what is compared decides: none of them has a mean.
// expect: 16 candidates
@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) turn: f32, @location(2) height: f32) -> @location(0) vec4f {
    let cell = floor(uv * 4.0);
    let angle = turn * height;
    let level = height * height;
    if level > 0.5 { discard; }
    return vec4f(sin(cell.x), sin(angle), height, 1.0);
}
