// expect: 2 candidates
@group(0) @binding(0) var<uniform> lights: array<vec4f, 4>;
@group(0) @binding(1) var<uniform> lit: u32;

struct Vertex { @builtin(position) clip: vec4f, @location(0) normal: vec3f }

@vertex fn vs_main(@location(0) position: vec3f, @location(1) normal: vec3f) -> Vertex {
    return Vertex(vec4f(position, 1.0), normal);
}

@fragment fn fs_main(in: Vertex) -> @location(0) vec4f {
    var colour = fract(in.clip.x);
    if lit != 0u {
        var sum = 0.0;
        for (var i = 0; i < 4; i++) { sum += max(dot(in.normal, lights[i].xyz), 0.0); }
        let light = sqrt(sum);
        colour *= light;
    }
    return vec4f(vec3f(colour), 1.0);
}
