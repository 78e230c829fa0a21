// expect: 1 candidates
@group(0) @binding(0) var<uniform> turn: mat2x2f;
@group(0) @binding(1) var image: texture_2d<f32>;
@group(0) @binding(2) var linearly: sampler;

struct Vertex { @builtin(position) clip: vec4f, @location(0) uv: vec2f }

@vertex fn vs_main(@location(0) position: vec4f, @location(1) uv: vec2f) -> Vertex {
    return Vertex(position, uv);
}

@fragment fn fs_main(in: Vertex) -> @location(0) vec4f {
    let turned = turn * in.uv + vec2f(0.5);
    return textureSample(image, linearly, turned);
}
