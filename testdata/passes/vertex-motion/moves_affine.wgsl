// expect: 2 candidates
@group(0) @binding(0) var<uniform> turn: mat3x3f;

struct Vertex { @builtin(position) clip: vec4f, @location(0) at: vec3f, @location(1) @interpolate(linear) edge: vec3f }

@vertex fn vs_main(@location(0) position: vec3f) -> Vertex {
    return Vertex(vec4f(position, 1.0), position, position.zyx);
}

@fragment fn fs_main(in: Vertex, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    let turned = turn * (in.at - vec3f(0.5, 0.0, 0.0));
    let beside = turn * in.edge;
    return vec4f(select(turned, beside, front), 1.0);
}
