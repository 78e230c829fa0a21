// Levels of detail of ivy.wgsl, by lodc (lock format 1). Made from ivy.lod.toml: change that, not this.
// level  autoLOD  error  cost  what changed
// 0      0.00     -      1.00  the original
// 1      1.42     0.071  0.50  around.fit replaced by a constant; 5 operations keep one operand; 3 operations fitted to an operand; l per vertex; relief.sample replaced by a constant; vs_main.l per draw
// 2      2.59     0.091  0.37  relief.sample replaced by a constant; light_3.mul replaced by a constant; 8 operations keep one operand; light.add fitted to light.mul; gloss_of.h averaged per draw
// 3      3.67     0.112  0.31  9 operations keep one operand; light.add fitted to light.mul; light_3 fitted to light
// 4      4.71     0.138  0.11  relief.sample and leaf replaced by constants; light_3.pow replaced by a constant; 9 operations keep one operand; 3 operations fitted to an operand; v averaged per draw

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


fn original_vs_main(position: vec3f, normal: vec3f, uv: vec2f) -> VertexOutput {
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


fn original_fs_main(in: VertexOutput, front: bool) -> vec4f {
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

// Halvings of scale on screen since the nearest view; 0, the default, is the original.
override autoLOD: f32 = 0.0;

// What the vertex stage hands over: zeros where a level has no use for them.
struct VertexOutputOfLevels {
    @builtin(position) clip: vec4f,
    @location(0) world_position: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
    @location(3) @interpolate(flat) l: vec3f,
}

@vertex
fn vs_main(@location(0) position: vec3f, @location(1) normal: vec3f, @location(2) uv: vec2f) -> VertexOutputOfLevels {
    if !(autoLOD >= 1.42) {
        let original = original_vs_main(position, normal, uv);
        return VertexOutputOfLevels(original.clip, original.world_position, original.normal, original.uv, vec3f());
    }
    if !(autoLOD >= 2.59) { return lod_one_vs_main(position, normal, uv); }
    let original = original_vs_main(position, normal, uv);
    return VertexOutputOfLevels(original.clip, original.world_position, original.normal, original.uv, vec3f());
}

@fragment
fn fs_main(in: VertexOutput, @builtin(front_facing) front: bool, @location(3) @interpolate(flat) l: vec3f) -> @location(0) vec4f {
    if !(autoLOD >= 1.42) { return original_fs_main(in, front); }
    if !(autoLOD >= 2.59) { return lod_one_fs_main(in, front, l); }
    if !(autoLOD >= 3.67) { return lod_two_fs_main(in, front); }
    if !(autoLOD >= 4.71) { return lod_three_fs_main(in, front); }
    return lod_four_fs_main(in, front);
}

// Level 1. around.fit replaced by a constant; 5 operations keep one operand; 3 operations fitted to an operand; l per vertex; relief.sample replaced by a constant; vs_main.l per draw.
fn lod_one_vs_main(position: vec3f, normal: vec3f, uv: vec2f) -> VertexOutputOfLevels {
    return VertexOutputOfLevels(camera.view_proj * vec4f(position, 1.0), position, normal, uv, parameters.l);
}

fn lod_one_fs_main(in: VertexOutput, front: bool, l: vec3f) -> vec4f {
    let uv = in.uv * ivy.tiling;
    let leaf = textureSample(ivy_leaves, leaf_sampler, uv);
    var n = in.normal;
    if !front {
        n = -in.normal;
    }
    let v = normalize(camera.position - in.world_position);
    let direct = saturate(dot(n, l));
    let light = leaf.xyz * (vec3f(0.23006895, 0.31139487, 0.076173514) + sun.colour * direct);
    let h = normalize(l + v);
    let edge = pow(1.0 - saturate(dot(n, v)), 5.0);
    let light_3_mul_2 = ivy.gloss * (edge * 0.76102304 + 0.05107153) * pow(saturate(dot(n, h)), 31.983116);
    let light_2 = light + sun.colour * light_3_mul_2;
    let alpha = leaf.w;
    return vec4f(light_2, alpha * 1.0396962 + -0.040960778);
}

// Level 2. relief.sample replaced by a constant; light_3.mul replaced by a constant; 8 operations keep one operand; light.add fitted to light.mul; gloss_of.h averaged per draw.
fn lod_two_fs_main(in: VertexOutput, front: bool) -> vec4f {
    let uv = in.uv * ivy.tiling;
    let leaf = textureSample(ivy_leaves, leaf_sampler, uv);
    var n = in.normal;
    if !front {
        n = -in.normal;
    }
    let direct = saturate(dot(n, sun.direction));
    let light = leaf.xyz * (sun.colour * direct + vec3f(0.19849582, 0.25220978, 0.03577588));
    let light_2 = light + sun.colour * (0.031970125 * pow(saturate(dot(n, parameters.gloss_of_h)), 30.350582));
    let alpha = leaf.w;
    return vec4f(light_2, alpha);
}

// Level 3. 9 operations keep one operand; light.add fitted to light.mul; light_3 fitted to light.
fn lod_three_fs_main(in: VertexOutput, front: bool) -> vec4f {
    let uv = in.uv * ivy.tiling;
    let leaf = textureSample(ivy_leaves, leaf_sampler, uv);
    var n = in.normal;
    if !front {
        n = -in.normal;
    }
    let direct = saturate(dot(n, sun.direction));
    let light = leaf.xyz * (sun.colour * direct + vec3f(0.19849582, 0.25220978, 0.03577588));
    let alpha = leaf.w;
    return vec4f(light, alpha);
}

// Level 4. relief.sample and leaf replaced by constants; light_3.pow replaced by a constant; 9 operations keep one operand; 3 operations fitted to an operand; v averaged per draw.
fn lod_four_fs_main(in: VertexOutput, front: bool) -> vec4f {
    var n = in.normal;
    if !front {
        n = -in.normal;
    }
    let direct = saturate(dot(n, sun.direction));
    let thick = vec3f(0.10362024, 0.11221206, 0.05841404);
    let light = thick * (sun.colour * direct + vec3f(0.17793453, 0.2337728, 0.111448646));
    let edge = pow(1.0 - saturate(dot(n, parameters.v)), 5.0);
    let light_2 = light * vec3f(0.91390675, 1.0093151, 0.72838885) + sun.colour * (edge * 0.12115905);
    return vec4f(light_2, 0.694391);
}

// What is computed once a draw: by this entry point, or by the host.
struct LodParameters {
    l: vec3f,
    gloss_of_h: vec3f,
    v: vec3f,
}
@group(1) @binding(4) var<uniform> parameters: LodParameters;
@group(1) @binding(5) var<storage, read_write> parameters_stored: LodParameters;

@compute @workgroup_size(1)
fn lod_parameters() {
    lod_one_parameters();
    lod_two_parameters();
    lod_four_parameters();
}

fn lod_one_parameters() {
    parameters_stored.l = normalize(sun.direction);
}

fn lod_two_parameters() {
    let v = normalize(camera.position - vec3f(0.042845897, 0.4527219, -0.020062601));
    parameters_stored.gloss_of_h = normalize(sun.direction + v);
}

fn lod_four_parameters() {
    parameters_stored.v = normalize(camera.position - vec3f(-1.9397024, 8.478871, -3.5162716));
}
