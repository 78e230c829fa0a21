// Constant edges are not kept: the mean is the better constant.
// expect: 16 candidates
@fragment
fn fs_main(@location(0) distance: f32, @location(1) width: f32) -> @location(0) vec4f {
    let edge = smoothstep(0.25, width, distance);
    let band = fma(edge, distance, step(0.5, width));
    return vec4f(band);
}
