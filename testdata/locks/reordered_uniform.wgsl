// Two members of a uniform have changed places.

struct Camera {
    view_proj: mat4x4f,
    eye: vec3f,
}

struct Plaster {
    tint: vec3f,
    gloss: f32,
    // How much of the sky is seen at grazing angles.
    rim: f32,
    roughness: f32,
}

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<uniform> plaster: Plaster;
@group(0) @binding(2) var albedo: texture_2d<f32>;
@group(0) @binding(3) var filtering: sampler;

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

fn lamp(position: vec3f, colour: vec3f, at: vec3f, normal: vec3f) -> vec3f {
    let towards = position - at;
    let falloff = 1.0 / (1.0 + dot(towards, towards));
    return colour * falloff * max(dot(normal, normalize(towards)), 0.0);
}

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    let normal = normalize(in.normal);
    let to_eye = normalize(camera.eye - in.at);
    let base = textureSample(albedo, filtering, in.uv).rgb * plaster.tint;
    let grazing = pow(1.0 - max(dot(normal, to_eye), 0.0), 4.0);
    let sky = mix(vec3f(0.10, 0.09, 0.08), vec3f(0.22, 0.27, 0.36), 0.5 + 0.5 * normal.y);
    var light = sky * (1.0 - 0.5 * plaster.roughness);
    light += lamp(vec3f(2.0, 2.0, 1.0), vec3f(2.0, 1.8, 1.4), in.at, normal);
    light += lamp(vec3f(-2.0, 1.0, 1.5), vec3f(0.9, 1.0, 1.2), in.at, normal);
    light += lamp(vec3f(0.5, -2.0, 2.0), vec3f(0.7, 0.5, 0.4), in.at, normal);
    let shine = plaster.gloss * grazing;
    return vec4f(base * light + plaster.rim * shine * sky, 1.0);
}
