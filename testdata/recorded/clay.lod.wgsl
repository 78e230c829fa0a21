// Levels of detail of clay.wgsl, by lodc (lock format 1). Made from clay.lod.toml: change that, not this.
// level  autoLOD  error  cost  time  what changed
// 0      0.00     -      1.00  1.00  the original
// 1      2.24     0.108  0.78  0.34  the same picture, without what the scene does not need

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

@vertex
fn vs_main(@location(0) position: vec3f, @location(1) normal: vec3f) -> Varyings {
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

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    if !(autoLOD >= 2.24) { return original_fs_main(in); }
    return lod_one_fs_main(in);
}

// Level 1. The same picture, without what the scene does not need.
fn lod_one_fs_main(in: Varyings) -> vec4f {
    let normal = normalize(in.world_normal);
    let to_eye = normalize(view.eye - in.world_position);
    let sky = mix(lights.ground, lights.sky, 0.5 + 0.5 * normal.y);
    var diffuse = sky;
    for (var i = 0u; i < 6u; i += 1u) {
        let towards = lights.lamps[i].position - in.world_position;
        let squared = dot(towards, towards);
        let at_reach = lights.lamps[i].reach;
        let falloff = 1.0 / (1.0 + squared / (at_reach * at_reach));
        let to_light = towards * inverseSqrt(squared);
        let wrapped = (dot(normal, to_light) + 0.4) / 1.4;
        let clamped = max(wrapped, 0.0);
        let diffuse_2_mul_5 = lights.lamps[i].colour * (falloff * (clamped * clamped * (3.0 - 2.0 * min(clamped, 1.0))));
        diffuse += diffuse_2_mul_5;
    }
    let sheen = clay.sheen * pow(1.0 - saturate(dot(normal, to_eye)), clay.sheen_width);
    let light = clay.colour * diffuse + sheen * sky;
    return vec4f(light, 1.0);
}
