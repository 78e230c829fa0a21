// expect: 2 candidates
// facts: dynamic wind
@group(0) @binding(0) var<uniform> wind: vec3f;

struct Vertex { @builtin(position) clip: vec4f, @location(0) at: vec3f }

@vertex fn vs_main(@location(0) position: vec3f) -> Vertex {
    return Vertex(vec4f(position, 1.0), position);
}

@fragment fn fs_main(in: Vertex) -> @location(0) vec4f {
    let sway = sin(dot(wind, in.at));
    return vec4f(sway, in.at.x, 0.0, 1.0);
}
