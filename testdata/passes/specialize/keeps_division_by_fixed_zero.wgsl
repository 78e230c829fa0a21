// facts: fixed material.reach 0.0
// facts: fixed material.count 0
// expect: 0 candidates
struct Material { reach: f32, count: u32 }
@group(0) @binding(0) var<uniform> material: Material;
@fragment
fn fs_main(@location(0) a: f32, @location(1) @interpolate(flat) n: u32) -> @location(0) vec4f {
    return vec4f(1.0 / material.reach + f32(n % material.count) * a);
}
