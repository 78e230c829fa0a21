// A changed depth would change what is hidden, here and in other draws.
// expect: 1 candidates
struct Output {
    @location(0) colour: vec4f,
    @builtin(frag_depth) depth: f32,
}

@fragment
fn fs_main(@location(0) depth: f32, @location(1) colour: vec4f) -> Output {
    let pushed = depth * 0.5 + sqrt(depth);
    return Output(colour, pushed);
}
