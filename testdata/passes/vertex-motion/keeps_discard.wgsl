// expect: 3 candidates
@group(0) @binding(0) var<uniform> waves: vec4f;

struct Vertex { @builtin(position) clip: vec4f, @location(0) at: vec3f }

@vertex fn vs_main(@location(0) position: vec3f) -> Vertex {
    return Vertex(vec4f(position, 1.0), position);
}

@fragment fn fs_main(in: Vertex) -> @location(0) vec4f {
    let hole = sin(in.at.x * waves.x) * sin(in.at.y * waves.y);
    if hole > 0.9 {
        discard;
    }
    let light = exp(-dot(in.at, in.at)) * sin(in.at.z);
    return vec4f(vec3f(light), 1.0);
}
