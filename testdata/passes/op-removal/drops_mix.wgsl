// A mix comes down to either end; its weight has another type here.
// expect: 9 candidates
@fragment
fn fs_main(@location(0) moss: vec3f, @location(1) rock: vec3f, @location(2) wet: f32) -> @location(0) vec4f {
    let ground = mix(rock, moss, wet);
    return vec4f(ground, 1.0);
}
