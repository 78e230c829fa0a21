// expect: 4 candidates
@group(0) @binding(0) var<uniform> to_world: mat3x3f;
@group(0) @binding(1) var sky: texture_cube<f32>;
@group(0) @binding(2) var linearly: sampler;

struct Vertex { @builtin(position) clip: vec4f, @location(0) normal: vec3f, @location(1) at: vec3f }

@vertex fn vs_main(@location(0) position: vec3f, @location(1) normal: vec3f) -> Vertex {
    return Vertex(vec4f(position, 1.0), normal, position);
}

@fragment fn fs_main(in: Vertex, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    let mirrored = reflect(normalize(in.at), normalize(to_world * in.normal));
    return textureSampleBias(sky, linearly, select(mirrored, -mirrored, front), 2.0);
}
