// A local without a value starts at zero each time its declaration is met, also in the second round of a loop.
fn counted(x: f32) -> f32 {
    var hits: i32;
    var seen: array<bool, 3>;
    for (var i = 0; i < 3; i++) {
        if x * f32(i) > 0.4 {
            hits += 1;
            seen[i] = true;
        }
    }
    return f32(hits) * 0.2 + select(0.0, 0.1, seen[1]);
}

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    var sum = 0.0;
    for (var i = 0; i < 4; i++) {
        var inner: f32;
        var v: vec2f;
        if (i & 1) == 0 {
            inner = uv.x;
            v.x = uv.y;
        }
        sum = sum * 0.6 + inner + v.x + v.y;
        v = vec2f(9.0);
        inner = 7.0;
        {
            var block: f32;
            block += uv.y;
            sum += block * 0.1;
        }
        sum += counted(uv.x + f32(i) * 0.1) * 0.1;
    }
    var late: vec3f;
    late.y = fract(sum);
    return vec4f(late + vec3f(sum * 0.2, 0.0, counted(uv.y)), 1.0);
}
