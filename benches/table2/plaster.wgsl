// Painted plaster: one texture, the sun and the sky.

struct View {
    view_proj: mat4x4f,
}

struct Object {
    model: mat4x4f,
}

struct Light {
    direction: vec3f,
    colour: vec3f,
    sky: vec3f,
    ground: vec3f,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> light: Light;
@group(1) @binding(0) var<uniform> object: Object;
@group(1) @binding(1) var paint: texture_2d<f32>;
@group(1) @binding(2) var paint_sampler: sampler;

struct Varyings {
    @builtin(position) clip_position: vec4f,
    @location(0) normal: vec3f,
    @location(1) uv: vec2f,
}

@vertex
fn vs_main(
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
) -> Varyings {
    var out: Varyings;
    out.clip_position = view.view_proj * (object.model * vec4f(position, 1.0));
    out.normal = (object.model * vec4f(normal, 0.0)).xyz;
    out.uv = uv;
    return out;
}

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    let normal = normalize(in.normal);
    let albedo = textureSample(paint, paint_sampler, in.uv).rgb;
    let sun = light.colour * max(dot(normal, light.direction), 0.0);
    let sky = mix(light.ground, light.sky, 0.5 * normal.y + 0.5);
    return vec4f(albedo * (sun + sky), 1.0);
}
