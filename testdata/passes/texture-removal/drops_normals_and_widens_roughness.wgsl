// expect: 3 candidates
// facts: texture normal_map slopes 0.04
// facts: fs_main.read_normal.bump.sample mean 0.5 0.5 1.0 1.0
// What is read becomes a normal in a function of its own, and alpha goes through a struct.
@group(0) @binding(0) var normal_map: texture_2d<f32>;
@group(0) @binding(1) var smooth_sampler: sampler;
struct Material { roughness: f32 }
@group(0) @binding(2) var<uniform> material: Material;
struct Input { @location(0) uv: vec2f, @location(1) normal: vec3f, @location(2) tangent: vec3f, @location(3) half_way: vec3f }
struct Surface { normal: vec3f, alpha: f32 }
fn read_normal(in: Input) -> vec3f {
    let bump = textureSample(normal_map, smooth_sampler, in.uv).xyz * 2.0 - 1.0;
    return normalize(bump.x * in.tangent + bump.y * cross(in.normal, in.tangent) + bump.z * in.normal);
}
fn distribution(n_dot_h: f32, alpha: f32) -> f32 {
    let a2 = alpha * alpha;
    let d = n_dot_h * n_dot_h * (a2 - 1.0) + 1.0;
    return a2 / (d * d);
}
@fragment
fn fs_main(in: Input) -> @location(0) vec4f {
    let roughness = clamp(material.roughness * in.uv.x, 0.05, 1.0);
    let surface = Surface(read_normal(in), roughness * roughness);
    return vec4f(vec3f(distribution(dot(surface.normal, in.half_way), surface.alpha) + 0.1 * surface.alpha), 1.0);
}
