// expect: 0 candidates
struct Vertex { @builtin(position) clip: vec4f, @location(0) at: vec3f }

@vertex fn vs_main(@location(0) position: vec3f) -> Vertex {
    return Vertex(vec4f(position, 1.0), position);
}

@fragment fn fs_main(in: Vertex) -> @location(0) vec4f {
    let normal = normalize(cross(dpdx(in.at), dpdy(in.at)));
    return vec4f(normal * 0.5 + 0.5, 1.0);
}
