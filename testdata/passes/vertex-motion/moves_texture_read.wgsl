// expect: 2 candidates
@group(0) @binding(0) var cloud: texture_2d<f32>;
@group(0) @binding(1) var linearly: sampler;

struct Vertex { @builtin(position) clip: vec4f, @location(0) uv: vec2f }

@vertex fn vs_main(@location(0) position: vec3f, @location(1) uv: vec2f) -> Vertex {
    return Vertex(vec4f(position, 1.0), uv);
}

@fragment fn fs_main(in: Vertex) -> @location(0) vec4f {
    let thick = textureSample(cloud, linearly, in.uv).x;
    return vec4f(vec3f(exp(-thick)), 1.0);
}
