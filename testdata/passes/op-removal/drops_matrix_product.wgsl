// A square matrix times a vector may leave the vector; the vector has no side to leave the matrix.
// expect: 11 candidates
@group(0) @binding(0) var<uniform> twist: mat3x3f;
@group(0) @binding(1) var<uniform> widen: mat2x3f;

@fragment
fn fs_main(@location(0) n: vec3f, @location(1) uv: vec2f) -> @location(0) vec4f {
    let turned = twist * n + widen * uv;
    return vec4f(turned, 1.0);
}
