// Guards that keep a division, a root and a normalisation from going wrong; some are reached and some never are.
@group(0) @binding(0) var<uniform> roughness: f32;

@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) normal: vec3f) -> @location(0) vec4f {
    let a = max(roughness * roughness, 1e-4);
    let narrow = (uv.x - 0.5) / max(abs(uv.y - 0.5), 1e-3);
    let root = sqrt(max(uv.x - 0.3, 0.0));
    let n = select(vec3f(0.0, 0.0, 1.0), normalize(normal), dot(normal, normal) > 1e-8);
    let cosine = clamp(n.z, 1e-3, 1.0);
    let angle = acos(clamp(n.y, -1.0, 1.0));
    let spread = pow(max(uv.y - 0.2, 0.0), 0.5) / (a + cosine);
    return vec4f(saturate(abs(narrow) * 0.2), saturate(root + spread * 0.2), saturate(angle * 0.3 / cosine), 1.0);
}
