// The samples never show the one number to be 0, the second is not the same for the draw, and the third the scene fixes.
// expect: 1 candidates
// facts: fs_main.material.sheen min 0.25
// facts: fixed material.coat 0.0
struct Material { sheen: f32, coat: f32 }
@group(0) @binding(0) var<uniform> material: Material;
@fragment
fn fs_main(@location(0) cosine: f32, @location(1) worn: f32) -> @location(0) vec4f {
    let sheen = material.sheen * (pow(1.0 - saturate(cosine), 5.0) + exp(-3.0 * cosine));
    let dust = worn * (pow(1.0 - saturate(cosine), 4.0) + exp(-2.0 * cosine));
    let coat = material.coat * (pow(1.0 - saturate(cosine), 3.0) + exp(-1.5 * cosine));
    return vec4f(sheen, dust, coat, 1.0);
}
