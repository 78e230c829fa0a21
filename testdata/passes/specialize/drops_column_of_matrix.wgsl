// One place is read twice, in two branches: both reads go at once. A bool is a whole number here, and a column has an index.
// facts: fixed turn 1.0 2.0 3.0 4.0 5.0 6.0 7.0 8.0 9.0
// facts: fixed grade 0.5 0.25
// facts: fixed shift -2
// expect: 4 candidates
@group(0) @binding(0) var<uniform> turn: mat3x3f;
@group(0) @binding(1) var<uniform> grade: vec2f;
@group(0) @binding(2) var<uniform> shift: i32;
@fragment
fn fs_main(@location(0) a: vec3f, @location(1) b: f32) -> @location(0) vec4f {
    var x = 0.0;
    if b > 0.5 { x = dot(turn[1], a) * grade.y; } else { x = length(turn[1]) + sin(b * grade.y); }
    return vec4f(turn * a, x + f32(shift) * b);
}
