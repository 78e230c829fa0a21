// expect: 1 candidates
struct Vertex { @builtin(position) clip: vec4f, @location(0) at: vec3f }

@vertex fn vs_main(@location(0) position: vec3f) -> Vertex {
    return Vertex(vec4f(position, 1.0), position);
}

@fragment fn fs_main(in: Vertex, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    var sum = 0.0;
    for (var i = 0; i < 3; i++) {
        sum += exp(in.at.x * f32(i));
    }
    if in.at.y > 0.0 {
        sum *= log(in.at.y) * sin(in.at.x);
    }
    return vec4f(vec3f(sum), select(0.0, 1.0, front));
}
