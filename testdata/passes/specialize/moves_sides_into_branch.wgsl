// A choice by a condition of the draw: what is computed for one side alone is computed where that side is chosen.
// expect: 1 candidates
struct Material { kind: u32 }
@group(0) @binding(0) var<uniform> material: Material;
@fragment
fn fs_main(@location(0) at: vec3f) -> @location(0) vec4f {
    let length_of_at = length(at);
    let striped = sin(at.x * 40.0) * cos(at.y) + exp(length_of_at);
    let dotted = pow(length_of_at, 5.0) + sqrt(at.z) + log(length_of_at);
    let pattern = select(dotted, striped, material.kind == 1u);
    return vec4f(vec3f(pattern), 1.0);
}
