// A pointer is taken with the index of that moment: what happens to the index afterwards does not move it.
@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    var items = array<f32, 4>(0.1, 0.2, 0.3, 0.4);
    var i = u32(uv.x * 3.99);
    let p = &items[i];
    i = (i + 1u) % 4u;
    *p += 0.5;
    let q = &items[i];
    *q = *p * 0.5 + *q;
    i = 0u;

    var corners: array<array<vec3f, 2>, 3>;
    var j = i32(uv.y * 2.99);
    let row = &corners[j];
    j = 0;
    (*row)[1] = vec3f(uv, 0.25);
    (*row)[1].y += 0.25;
    let sum = corners[0][1] + corners[1][1] * 0.5 + corners[2][1] * 0.25;
    return vec4f(items[0] + items[1], items[2] + sum.y, items[3] + sum.z, 1.0);
}
