// An override is the host's to set: what is made of overrides alone is not averaged.
// expect: 0 candidates
override gain: f32 = 2.0;

@fragment
fn fs_main() -> @location(0) vec4f {
    return vec4f(sqrt(gain * 3.0));
}
