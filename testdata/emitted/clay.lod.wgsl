// Levels of detail of clay.wgsl, by lodc (lock format 1). Made from clay.lod.toml: change that, not this.
// level  autoLOD  error  cost  what changed
// 0      0.00     -      1.00  the original
// 1      1.10     0.036  0.25  light per vertex
// 2      2.87     0.060  0.46  falloff.mul replaced by a constant; normal keeps in.world_normal; light keeps light.mul; sky fitted to sky.add; diffuse_2.mul_4 fitted to falloff
// 3      3.67     0.085  0.38  3 operations keep one operand; 4 operations fitted to an operand

// Unglazed clay under a row of soft lamps: no texture, all the work is in the light.

const LAMPS = 6u;

struct View {
    view_proj: mat4x4f,
    eye: vec3f,
}

struct Object {
    model: mat4x4f,
}

struct Lamp {
    position: vec3f,
    // The distance at which half of its light is left.
    reach: f32,
    colour: vec3f,
}

struct Lamps {
    lamps: array<Lamp, 6>,
    sky: vec3f,
    ground: vec3f,
}

struct Clay {
    colour: vec3f,
    // How far light creeps around the edge, 0 to 1.
    softness: f32,
    sheen: vec3f,
    sheen_width: f32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> lights: Lamps;
@group(1) @binding(0) var<uniform> object: Object;
@group(1) @binding(1) var<uniform> clay: Clay;

struct Varyings {
    @builtin(position) clip_position: vec4f,
    @location(0) world_position: vec3f,
    @location(1) world_normal: vec3f,
}


fn original_vs_main(position: vec3f, normal: vec3f) -> Varyings {
    let world = object.model * vec4f(position, 1.0);
    var out: Varyings;
    out.clip_position = view.view_proj * world;
    out.world_position = world.xyz;
    out.world_normal = (object.model * vec4f(normal, 0.0)).xyz;
    return out;
}

// Light that is scattered below the surface comes out beyond the edge of the shadow too.
fn scattered(normal: vec3f, to_light: vec3f) -> f32 {
    let wrapped = (dot(normal, to_light) + clay.softness) / (1.0 + clay.softness);
    let clamped = max(wrapped, 0.0);
    return clamped * clamped * (3.0 - 2.0 * min(clamped, 1.0));
}


fn original_fs_main(in: Varyings) -> vec4f {
    let normal = normalize(in.world_normal);
    let to_eye = normalize(view.eye - in.world_position);
    let sky = mix(lights.ground, lights.sky, 0.5 + 0.5 * normal.y);
    var diffuse = sky;
    for (var i = 0u; i < LAMPS; i++) {
        let lamp = lights.lamps[i];
        let towards = lamp.position - in.world_position;
        let squared = dot(towards, towards);
        let falloff = 1.0 / (1.0 + squared / (lamp.reach * lamp.reach));
        diffuse += lamp.colour * (falloff * scattered(normal, towards * inverseSqrt(squared)));
    }
    // Dust catches the light at grazing angles.
    let sheen = clay.sheen * pow(1.0 - saturate(dot(normal, to_eye)), clay.sheen_width);
    let light = clay.colour * diffuse + sheen * sky;
    return vec4f(light, 1.0);
}

// Halvings of scale on screen since the nearest view; 0, the default, is the original.
override autoLOD: f32 = 0.0;

// What the vertex stage hands over: zeros where a level has no use for them.
struct VaryingsOfLevels {
    @builtin(position) clip_position: vec4f,
    @location(0) world_position: vec3f,
    @location(1) world_normal: vec3f,
    @location(2) light: vec3f,
}

@vertex
fn vs_main(@location(0) position: vec3f, @location(1) normal: vec3f) -> VaryingsOfLevels {
    if !(autoLOD >= 1.1) {
        let original = original_vs_main(position, normal);
        return VaryingsOfLevels(original.clip_position, original.world_position, original.world_normal, vec3f());
    }
    if !(autoLOD >= 2.87) { return lod_one_vs_main(position, normal); }
    let original = original_vs_main(position, normal);
    return VaryingsOfLevels(original.clip_position, original.world_position, original.world_normal, vec3f());
}

@fragment
fn fs_main(in: Varyings, @location(2) light: vec3f) -> @location(0) vec4f {
    if !(autoLOD >= 1.1) { return original_fs_main(in); }
    if !(autoLOD >= 2.87) { return lod_one_fs_main(in, light); }
    if !(autoLOD >= 3.67) { return lod_two_fs_main(in); }
    return lod_three_fs_main(in);
}

// Level 1. Light per vertex.
fn lod_one_vs_main(position: vec3f, normal: vec3f) -> VaryingsOfLevels {
    let world = object.model * vec4f(position, 1.0);
    let out_clip_position = view.view_proj * world;
    let out_world_position = world.xyz;
    let out_world_normal = (object.model * vec4f(normal, 0.0)).xyz;
    let normal_2 = normalize(out_world_normal);
    let to_eye = normalize(view.eye - out_world_position);
    let sky = mix(lights.ground, lights.sky, 0.5 + 0.5 * normal_2.y);
    var diffuse = sky;
    for (var i = 0u; i < 6u; i += 1u) {
        let towards = lights.lamps[i].position - out_world_position;
        let squared = dot(towards, towards);
        let at_reach = lights.lamps[i].reach;
        let falloff = 1.0 / (1.0 + squared / (at_reach * at_reach));
        let to_light = towards * inverseSqrt(squared);
        let wrapped = (dot(normal_2, to_light) + 0.4) / 1.4;
        let clamped = max(wrapped, 0.0);
        let diffuse_2_mul_5 = lights.lamps[i].colour * (falloff * (clamped * clamped * (3.0 - 2.0 * min(clamped, 1.0))));
        diffuse += diffuse_2_mul_5;
    }
    let sheen = clay.sheen * pow(1.0 - saturate(dot(normal_2, to_eye)), clay.sheen_width);
    let light = clay.colour * diffuse + sheen * sky;
    return VaryingsOfLevels(out_clip_position, out_world_position, out_world_normal, light);
}

fn lod_one_fs_main(in: Varyings, light: vec3f) -> vec4f {
    return vec4f(light, 1.0);
}

// Level 2. falloff.mul replaced by a constant; normal keeps in.world_normal; light keeps light.mul; sky fitted to sky.add; diffuse_2.mul_4 fitted to falloff.
fn lod_two_fs_main(in: Varyings) -> vec4f {
    var diffuse = (0.5 + 0.5 * in.world_normal.y) * vec3f(0.057026163, 0.11488805, 0.1897318) + vec3f(0.099070035, 0.080752924, 0.07161564);
    for (var i = 0u; i < 6u; i += 1u) {
        let towards = lights.lamps[i].position - in.world_position;
        let squared = dot(towards, towards);
        let falloff = 1.0 / (1.0 + squared / 2.7443864);
        diffuse += lights.lamps[i].colour * (falloff * 1.6040248 + -0.26748827);
    }
    return vec4f(clay.colour * diffuse, 1.0);
}

// Level 3. 3 operations keep one operand; 4 operations fitted to an operand.
fn lod_three_fs_main(in: Varyings) -> vec4f {
    var diffuse = (0.5 + 0.5 * in.world_normal.y) * vec3f(0.057026163, 0.11488805, 0.1897318) + vec3f(0.099070035, 0.080752924, 0.07161564);
    for (var i = 0u; i < 6u; i += 1u) {
        let towards = lights.lamps[i].position - in.world_position;
        let squared = dot(towards, towards);
        let diffuse_2_mul_5 = lights.lamps[i].colour * (((1.0 + squared * 0.36420417) * -0.04155139 + 0.4270646) * 1.6040248 + -0.26748827);
        diffuse += diffuse_2_mul_5;
    }
    return vec4f(clay.colour * diffuse, 1.0);
}
