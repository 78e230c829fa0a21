// A hull of ivy leaves with soft edges, lit from both sides, that lets what is behind it through: drawn blended.

struct Camera {
    view_proj: mat4x4f,
    position: vec3f,
}

struct Sun {
    direction: vec3f,
    colour: vec3f,
    sky: vec3f,
    ground: vec3f,
}

struct Ivy {
    tiling: vec2f,
    // How much of the light on the other side comes through a leaf.
    translucency: f32,
    gloss: f32,
    // How much of the leaves is gone, 0..1.
    thinned: f32,
}

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<uniform> sun: Sun;
@group(1) @binding(0) var<uniform> ivy: Ivy;
@group(1) @binding(1) var ivy_leaves: texture_2d<f32>;
@group(1) @binding(2) var wrinkle_height: texture_2d<f32>;
@group(1) @binding(3) var leaf_sampler: sampler;

struct VertexOutput {
    @builtin(position) clip: vec4f,
    @location(0) world_position: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
}

@vertex
fn vs_main(@location(0) position: vec3f, @location(1) normal: vec3f, @location(2) uv: vec2f) -> VertexOutput {
    return VertexOutput(camera.view_proj * vec4f(position, 1.0), position, normal, uv);
}

// Leaves overlap: where they are thinned out, the thin ones go first.
fn cover(alpha: f32, relief: f32) -> f32 {
    let left = smoothstep(ivy.thinned - 0.3, ivy.thinned + 0.3, 0.6 * relief + 0.4 * alpha);
    return alpha * left;
}

fn gloss_of(n: vec3f, l: vec3f, v: vec3f, relief: f32) -> f32 {
    let h = normalize(l + v);
    let edge = pow(1.0 - saturate(dot(n, v)), 5.0);
    return ivy.gloss * mix(0.05, 0.7, edge) * pow(saturate(dot(n, h)), mix(12.0, 48.0, relief));
}

@fragment
fn fs_main(in: VertexOutput, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    let uv = in.uv * ivy.tiling;
    let leaf = textureSample(ivy_leaves, leaf_sampler, uv);
    let relief = textureSample(wrinkle_height, leaf_sampler, uv * 1.7).r;
    let slope = vec2f(dpdx(relief), dpdy(relief));

    var n = normalize(in.normal);
    if !front {
        n = -n;
    }
    let v = normalize(camera.position - in.world_position);
    let l = normalize(sun.direction);

    let facing = dot(n, l) - 0.3 * (slope.x + slope.y);
    let direct = saturate(facing);
    // Light that falls on the other side shines through the colour of the leaf, deeper green.
    let through = saturate(-facing) * ivy.translucency * (1.0 - 0.5 * relief);
    let around = mix(sun.ground, sun.sky, n.y * 0.5 + 0.5);

    let thick = leaf.rgb * (0.75 + 0.5 * relief);
    var light = thick * (around + sun.colour * direct);
    light += thick * thick * vec3f(0.9, 1.6, 0.5) * sun.colour * through;
    light += sun.colour * gloss_of(n, l, v, relief) * step(0.0, facing);
    return vec4f(light, cover(leaf.a, relief));
}
