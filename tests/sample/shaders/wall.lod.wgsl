// Levels of detail of wall.wgsl, by lodc (lock format 1). Made from wall.lod.toml: change that, not this.
// level  autoLOD  error  cost  what changed
// 0      0.00     -      1.00  the original
// 1      2.42     0.093  0.63  rim keeps rim.pow; sky fitted to sky.add; base.mix fitted to dirt; dirt.sample replaced by a constant
// 2      4.25     0.190  0.16  base.fit, light.pow and sky.fit replaced by constants; rim.pow.fit keeps rim.pow.fit.mul; light.add keeps light.vec3; 3 operations fitted to an operand

// A painted wall in the sun: one texture, diffuse and specular light, a rim that the sky gives it.

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
    let light = base * (diffuse + sky) + specular(normal, to_sun, to_eye) * diffuse + rim * sky;
    return vec4f(light, 1.0);
}

// Halvings of scale on screen since the nearest view; 0, the default, is the original.
override autoLOD: f32 = 0.0;

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    if !(autoLOD >= 2.42) { return original_fs_main(in); }
    if !(autoLOD >= 4.25) { return lod_one_fs_main(in); }
    return lod_two_fs_main(in);
}

// Level 1. Rim keeps rim.pow; sky fitted to sky.add; base.mix fitted to dirt; dirt.sample replaced by a constant.
fn lod_one_fs_main(in: Varyings) -> vec4f {
    let normal = normalize(in.normal);
    let to_eye = normalize(camera.eye - in.at);
    let base = textureSample(albedo, filtering, in.uv).xyz * paint.tint * 0.64538825;
    let to_sun = vec3f(0.39036, 0.78072, 0.48795);
    let diffuse = max(dot(normal, to_sun), 0.0);
    let sky_fit = (0.5 + 0.5 * normal.y) * vec3f(0.19944802, 0.29622182, 0.4647294) + vec3f(0.11084474, 0.09978292, 0.0877598);
    let to_sun_2 = vec3f(0.39036, 0.78072, 0.48795);
    let halfway = normalize(to_sun_2 + to_eye);
    let light_vec3_2 = vec3(pow(max(dot(normal, halfway), 0.0), paint.gloss) * diffuse);
    let light = base * (vec3(diffuse) + sky_fit) + light_vec3_2 + pow(1.0 - max(dot(normal, to_eye), 0.0), 4.0) * sky_fit;
    return vec4f(light, 1.0);
}

// Level 2. base.fit, light.pow and sky.fit replaced by constants; rim.pow.fit keeps rim.pow.fit.mul; light.add keeps light.vec3; 3 operations fitted to an operand.
fn lod_two_fs_main(in: Varyings) -> vec4f {
    let normal = normalize(in.normal);
    let to_eye = normalize(camera.eye - in.at);
    let to_sun = vec3f(0.39036, 0.78072, 0.48795);
    let diffuse = max(dot(normal, to_sun), 0.0);
    let rim = paint.rim * ((1.0 - max(dot(normal, to_eye), 0.0)) * 1.7807916);
    let light = vec3f(0.20958214, 0.1481938, 0.09077256) * vec3(diffuse) + vec3(0.11812139 * diffuse) + rim * vec3f(0.13821083, 0.13866338, 0.13870049);
    return vec4f(light, 1.0);
}
