// The mean of an input spares the interpolation, all uses at once.
// expect: 13 candidates
struct Input {
    @builtin(position) pixel: vec4f,
    @location(0) tangent: vec3f,
    @location(1) tint: vec3f,
}

@fragment
fn fs_main(in: Input) -> @location(0) vec4f {
    return vec4f(cross(in.tangent, in.tint) + in.tangent * in.pixel.z, 1.0);
}
