// expect: 0 candidates
struct Material { gloss: f32, tint: vec3f }
@group(0) @binding(0) var<uniform> material: Material;
@fragment
fn fs_main(@location(0) a: f32) -> @location(0) vec4f {
    return vec4f(material.tint * pow(a, material.gloss), 1.0);
}
