// Levels of detail of board.wgsl, by lodc (lock format 1). Made from board.lod.toml: change that, not this.
// level  autoLOD  error  cost  what changed
// 0      0.00     -      1.00  the original
// 1      2.42     0.095  0.47  lamps_3 replaced by a constant; sky fitted to sky.add; base.mix fitted to dirt; dirt.sample replaced by a constant; to_sun per draw
// 2      4.25     0.190  0.07  lamps_3, base and sky.fit replaced by constants; 6 operations keep one operand; 4 operations fitted to an operand; to_eye averaged per draw

// A lacquered board under lamps: two textures, three lamps, what a host knows of them computed once a draw.

struct Camera {
    view_proj: mat4x4f,
    eye: vec3f,
}

struct Paint {
    tint: vec3f,
    gloss: f32,
    sun: vec3f,
    // How much of the sky is seen at grazing angles.
    rim: f32,
    lamps: array<Lamp, 3>,
}

struct Lamp {
    position: vec3f,
    strength: f32,
}

@group(0) @binding(0) var<uniform> camera: Camera;
@group(1) @binding(0) var<uniform> paint: Paint;
@group(1) @binding(1) var albedo: texture_2d<f32>;
@group(1) @binding(2) var grime: texture_2d<f32>;
@group(1) @binding(3) var filtering: sampler;

struct Varyings {
    @builtin(position) clip: vec4f,
    @location(0) at: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
}

@vertex
fn vs_main(@location(0) position: vec3f, @location(1) normal: vec3f, @location(2) uv: vec2f) -> Varyings {
    return Varyings(camera.view_proj * vec4f(position, 1.0), position, normal, uv);
}

fn specular(normal: vec3f, to_sun: vec3f, to_eye: vec3f) -> f32 {
    let halfway = normalize(to_sun + to_eye);
    return pow(max(dot(normal, halfway), 0.0), paint.gloss);
}


fn original_fs_main(in: Varyings) -> vec4f {
    let normal = normalize(in.normal);
    let to_sun = normalize(paint.sun);
    let to_eye = normalize(camera.eye - in.at);
    let dirt = textureSample(grime, filtering, in.uv * 2.0).r;
    let base = textureSample(albedo, filtering, in.uv).rgb * paint.tint * mix(1.0, dirt, 0.3);
    let diffuse = max(dot(normal, to_sun), 0.0);
    let rim = paint.rim * pow(1.0 - max(dot(normal, to_eye), 0.0), 4.0);
    let sky = mix(vec3f(0.10, 0.09, 0.08), vec3f(0.22, 0.27, 0.36), 0.5 + 0.5 * normal.y);
    var lamps = vec3f(0.0);
    for (var i = 0u; i < 3u; i++) {
        let towards = paint.lamps[i].position - in.at;
        let strength = paint.lamps[i].strength / dot(towards, towards);
        lamps += strength * max(dot(normal, normalize(towards)), 0.0) * vec3f(1.0, 0.9, 0.7);
    }
    let light = base * (diffuse + sky + lamps) + specular(normal, to_sun, to_eye) * diffuse + rim * sky;
    return vec4f(light, 1.0);
}

// Halvings of scale on screen since the nearest view; 0 is the original.
struct LevelOfDetail {
    @size(16) autoLOD: f32,
}
@group(1) @binding(4) var<uniform> level_of_detail: LevelOfDetail;

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    if !(level_of_detail.autoLOD >= 2.42) { return original_fs_main(in); }
    if !(level_of_detail.autoLOD >= 4.25) { return lod_one_fs_main(in); }
    return lod_two_fs_main(in);
}

// Level 1. lamps_3 replaced by a constant; sky fitted to sky.add; base.mix fitted to dirt; dirt.sample replaced by a constant; to_sun per draw.
fn lod_one_fs_main(in: Varyings) -> vec4f {
    let normal = normalize(in.normal);
    let to_eye = normalize(camera.eye - in.at);
    let base = textureSample(albedo, filtering, in.uv).xyz * paint.tint * 0.7249205;
    let diffuse = max(dot(normal, parameters.to_sun), 0.0);
    let rim = paint.rim * pow(1.0 - max(dot(normal, to_eye), 0.0), 4.0);
    let sky_fit = (0.5 + 0.5 * normal.y) * vec3f(0.22603415, 0.31787297, 0.48006508) + vec3f(0.06661305, 0.062083583, 0.06056476);
    let halfway = normalize(parameters.to_sun + to_eye);
    let light_vec3_2 = vec3(pow(max(dot(normal, halfway), 0.0), paint.gloss) * diffuse);
    let light = base * (vec3(diffuse) + sky_fit + vec3f(0.09217905, 0.07800491, 0.049374834)) + light_vec3_2 + rim * sky_fit;
    return vec4f(light, 1.0);
}

// Level 2. lamps_3, base and sky.fit replaced by constants; 6 operations keep one operand; 4 operations fitted to an operand; to_eye averaged per draw.
fn lod_two_fs_main(in: Varyings) -> vec4f {
    let diffuse = max(dot(in.normal, paint.sun), 0.0);
    let rim = paint.rim * (1.0 - max(dot(in.normal, parameters.to_eye), 0.0));
    let add_3_fit = vec3f(0.19549261, 0.13575271, 0.081947535) * (vec3(diffuse) + vec3f(0.20313361, 0.2515004, 0.35149562)) * vec3f(2.1320665, 2.5554402, 3.3780012) + vec3f(-0.042124722, -0.058013283, -0.080854386);
    let light = add_3_fit + rim * vec3f(0.14672865, 0.16012679, 0.17516083);
    return vec4f(light, 1.0);
}

// What is computed once a draw: by this entry point, or by the host.
struct LodParameters {
    to_sun: vec3f,
    to_eye: vec3f,
}
@group(1) @binding(5) var<uniform> parameters: LodParameters;
@group(1) @binding(6) var<storage, read_write> parameters_stored: LodParameters;

@compute @workgroup_size(1)
fn lod_parameters() {
    lod_one_parameters();
    lod_two_parameters();
}

fn lod_one_parameters() {
    parameters_stored.to_sun = normalize(paint.sun);
}

fn lod_two_parameters() {
    parameters_stored.to_eye = normalize(camera.eye - vec3f(2.1452317, -0.18585138, -5.4601264));
}
