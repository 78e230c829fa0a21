// A lobe of a roughness that is almost 0.
// stiff: nothing

struct Varyings {
    @location(0) uv: vec2f,
    @location(1) world_normal: vec3f,
    @location(2) world_position: vec3f,
}

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    let cosine = normalize(in.world_normal).z;
    let alpha = 0.0001;
    let spread = cosine * cosine * (alpha - 1.0) + 1.0;
    let lobe = alpha / spread;
    return vec4f(vec3f(lobe), 1.0);
}
