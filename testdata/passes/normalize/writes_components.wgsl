@group(0) @binding(0) var<uniform> turn: mat3x3f;

@fragment
fn fs_main(@location(0) p: vec3f, @location(1) @interpolate(flat) i: u32) -> @location(0) vec4f {
    var q = p;
    q.y = q.x * 2.0;
    q.z += q.y;
    var m = turn;
    m[1] = q;
    m[2].x = 0.0;
    var r = m * p;
    r[i] = 1.0;
    return vec4f(r, r.x);
}
