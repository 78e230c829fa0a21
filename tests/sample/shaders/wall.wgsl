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

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
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
