// The author branches on the number already.
// expect: 0 candidates
struct Material { sheen: f32 }
@group(0) @binding(0) var<uniform> material: Material;
@fragment
fn fs_main(@location(0) cosine: f32, @location(1) base: vec3f) -> @location(0) vec4f {
    var colour = base;
    if material.sheen > 0.0 {
        colour += vec3f(material.sheen * (pow(1.0 - saturate(cosine), 5.0) + exp(-3.0 * cosine)));
    }
    return vec4f(colour, 1.0);
}
