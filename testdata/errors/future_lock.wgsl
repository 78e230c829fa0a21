// A plain material, for bad scenes and bad arguments.
struct Camera {
    view_proj: mat4x4f,
    eye: vec3f,
}

struct Paint {
    tint: vec3f,
    gloss: f32,
    mode: u32,
}

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<uniform> paint: Paint;
@group(0) @binding(2) var skin: texture_2d<f32>;
@group(0) @binding(3) var skin_sampler: sampler;

struct Varyings {
    @builtin(position) clip: vec4f,
    @location(0) world: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
}

@vertex
fn vs_main(@location(0) position: vec3f, @location(1) normal: vec3f, @location(2) uv: vec2f) -> Varyings {
    return Varyings(camera.view_proj * vec4f(position, 1.0), position, normal, uv);
}

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    let base = textureSample(skin, skin_sampler, in.uv).rgb * paint.tint;
    if paint.mode == 1u {
        return vec4f(base, 1.0);
    }
    let n = normalize(in.normal);
    let v = normalize(camera.eye - in.world);
    let rim = pow(1.0 - saturate(dot(n, v)), 4.0) * paint.gloss;
    return vec4f(saturate(base + rim), 1.0);
}
