struct Scene {
    view_projection: mat4x4f,
    eye: vec3f,
}

@group(0) @binding(0) var<uniform> scene: Scene;
@group(0) @binding(1) var<uniform> model: mat4x4f;
@group(1) @binding(0) var silk: texture_2d<f32>;
@group(1) @binding(1) var cone: texture_2d<f32>;
@group(1) @binding(2) var flowers: texture_cube<f32>;
@group(1) @binding(3) var smooth_sampler: sampler;

struct Surface {
    @builtin(position) clip: vec4f,
    @location(0) uv: vec2f,
    @location(1) normal: vec3f,
    @location(2) position: vec3f,
}

@vertex
fn vs_main(@location(0) position: vec3f, @location(1) normal: vec3f, @location(2) uv: vec2f) -> Surface {
    let world = model * vec4f(position, 1.0);
    return Surface(scene.view_projection * world, uv, (model * vec4f(normal, 0.0)).xyz, world.xyz);
}

@fragment
fn fs_main(in: Surface) -> @location(0) vec4f {
    var colour = textureSample(silk, smooth_sampler, in.uv);
    colour *= textureSample(cone, smooth_sampler, in.uv);
    colour += vec4f(0.1, 0.0, 0.0, 0.0);
    colour *= textureSample(flowers, smooth_sampler, reflect(in.position - scene.eye, in.normal));
    return colour;
}
