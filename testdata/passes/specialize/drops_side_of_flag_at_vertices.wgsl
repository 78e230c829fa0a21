// A flag that the scene fixes is tested for each vertex: the test goes, with what it guards, and what that reads.
// expect: 1 candidates
// facts: fixed mesh.flags 4
struct Mesh { flags: u32, matrix: mat4x4f }
@group(0) @binding(0) var<uniform> mesh: Mesh;
struct Varyings { @builtin(position) clip: vec4f, @location(0) normal: vec3f }
@vertex
fn vs_main(@location(0) position: vec3f, @location(1) normal: vec3f, @location(2) offset: vec3f) -> Varyings {
    var at = position;
    if (mesh.flags & 1u) != 0u { at += offset * sin(position.x); }
    return Varyings(mesh.matrix * vec4f(at, 1.0), normal);
}
@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    return vec4f(in.normal, 1.0);
}
