// A highlight whose roughness is kept from 0, as Bevy issue 16534 asks for.
// trap: op-removal fs_main.alpha keep

struct Varyings {
    @location(0) uv: vec2f,
    @location(1) world_normal: vec3f,
    @location(2) world_position: vec3f,
}

struct Material {
    roughness: f32,
}

struct Camera {
    view_proj: mat4x4f,
    eye: vec3f,
}

@group(0) @binding(0) var<uniform> camera: Camera;

@group(1) @binding(0) var<uniform> material: Material;

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    let squared = material.roughness * material.roughness;
    let alpha = max(squared, 0.002);
    let facing = saturate(in.world_normal.y);
    let spread = facing * facing * (alpha * alpha - 1.0) + 1.0;
    let lobe = alpha * alpha / (spread * spread);
    return vec4f(vec3f(0.2 + 0.01 * min(lobe, 10.0)), 1.0);
}
