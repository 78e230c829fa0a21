// Where the side may be infinite, 0 times it is no 0.
// expect: 0 candidates
// facts: fs_main.sheen max inf
struct Material { sheen: f32 }
@group(0) @binding(0) var<uniform> material: Material;
@fragment
fn fs_main(@location(0) cosine: f32) -> @location(0) vec4f {
    let sheen = material.sheen * (pow(1.0 - saturate(cosine), 5.0) / cosine + exp(-3.0 * cosine));
    return vec4f(sheen, 0.0, 0.0, 1.0);
}
