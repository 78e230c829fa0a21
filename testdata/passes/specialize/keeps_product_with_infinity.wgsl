// One is infinite in places, and the other was never computed.
// facts: fs_main.endless max inf
// facts: fs_main.rare unseen
// expect: 0 candidates
const OFF = 0.0;
@fragment
fn fs_main(@location(0) a: f32, @location(1) b: f32) -> @location(0) vec4f {
    let endless = 1.0 / a;
    let rare = exp(b);
    return vec4f(endless * OFF, mix(a, rare, 0.0), 0.0, 1.0);
}
