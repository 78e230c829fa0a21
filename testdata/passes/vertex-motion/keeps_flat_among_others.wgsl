// expect: 1 candidates
@group(0) @binding(0) var<uniform> lights: array<vec4f, 8>;

struct Vertex {
    @builtin(position) clip: vec4f,
    @location(0) normal: vec3f,
    @location(1) @interpolate(flat) light: u32,
}

@vertex fn vs_main(@location(0) normal: vec3f, @location(1) light: u32) -> Vertex {
    return Vertex(vec4f(normal, 1.0), normal, light);
}

@fragment fn fs_main(in: Vertex) -> @location(0) vec4f {
    let light = normalize(lights[in.light & 7u].xyz);
    let facing = pow(max(dot(in.normal, light), 0.0), 8.0);
    return vec4f(vec3f(facing), 1.0);
}
