// What a number would switch off is read for something else too, or is too little for a branch.
// expect: 0 candidates
struct Material { sheen: f32 }
@group(0) @binding(0) var<uniform> material: Material;
@fragment
fn fs_main(@location(0) cosine: f32) -> @location(0) vec4f {
    let rim = pow(1.0 - saturate(cosine), 5.0) + exp(-3.0 * cosine);
    let sheen = material.sheen * rim;
    let little = material.sheen * (cosine + 1.0);
    return vec4f(sheen, rim, little, 1.0);
}
