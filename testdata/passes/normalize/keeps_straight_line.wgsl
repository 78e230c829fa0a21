struct Material { tint: vec3f, rough: f32 }

@group(0) @binding(0) var<uniform> material: Material;
@group(0) @binding(1) var albedo: texture_2d<f32>;
@group(0) @binding(2) var smooth_sampler: sampler;

@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) normal: vec3f) -> @location(0) vec4f {
    let base = textureSample(albedo, smooth_sampler, uv);
    let shade = max(dot(normalize(normal), vec3f(0.0, 1.0, 0.0)), 0.0);
    return vec4f(base.xyz * material.tint * shade, material.rough);
}
