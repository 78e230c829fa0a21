// expect: 0 candidates
struct Vertex {
    @builtin(position) clip: vec4f,
    @location(0) at: vec3f,
    @location(1) a: f32, @location(2) b: f32, @location(3) c: f32, @location(4) d: f32, @location(5) e: f32,
    @location(6) f: f32, @location(7) g: f32, @location(8) h: f32, @location(9) i: f32, @location(10) j: f32,
    @location(11) k: f32, @location(12) l: f32, @location(13) m: f32, @location(14) n: f32,
}

@vertex fn vs_main(@location(0) at: vec3f) -> Vertex {
    return Vertex(vec4f(at, 1.0), at, at.x, at.y, at.z, at.x, at.y, at.z, at.x, at.y, at.z, at.x, at.y, at.z, at.x, at.y);
}

@fragment fn fs_main(in: Vertex, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    let light = exp(-dot(in.at, in.at)) * in.n;
    return vec4f(vec3f(light), select(0.5, 1.0, front));
}
