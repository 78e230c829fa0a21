// expect: 0 candidates
// facts: texture dirt dynamic
@group(0) @binding(0) var shadow: texture_depth_2d;
@group(0) @binding(1) var compare: sampler_comparison;
@group(0) @binding(2) var dirt: texture_2d<f32>;
@group(0) @binding(3) var linearly: sampler;

struct Vertex { @builtin(position) clip: vec4f, @location(0) at: vec3f }

@vertex fn vs_main(@location(0) position: vec3f) -> Vertex {
    return Vertex(vec4f(position, 1.0), position);
}

@fragment fn fs_main(in: Vertex) -> @location(0) vec4f {
    let light = textureSampleCompare(shadow, compare, in.at.xy, in.at.z);
    let colour = textureSample(dirt, linearly, in.at.xy);
    return vec4f(colour.xyz, light);
}
