// Swizzles, single components written by name and by varying index, vectors of booleans.
@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) normal: vec3f) -> @location(0) vec4f {
    var v = vec4f(uv, normal.xy);
    let i = u32(uv.x * 3.99);
    v[i] = 0.5;
    v[(i + 1u) % 4u] += 0.25;
    v.z *= 2.0;
    v = v.wzyx + vec4f(v.xx, v.yy) * 0.1;
    let old = v;
    v.x = v.y;
    v.y = old.x;
    let pair = v.zx;
    let q = vec4(pair, vec2(pair.y, 1));
    var flags = v.xyz > vec3f(0.3);
    flags[i % 3u] = !flags.y;
    let counted = select(vec3f(0.0), vec3f(0.2), flags) + select(vec3f(0.1), v.xyz, flags.zxy);
    let both = flags & vec3<bool>(true, uv.y > 0.5, false);
    let either = flags | both;
    var n = vec3i(v.xyz * 8.0);
    n.y <<= 1u;
    n[2] -= 3;
    n = n * vec3i(1, -2, 3) + n.zyx;
    let m = vec3u(abs(n)) & vec3u(7u, 3u, 15u);
    let equal = all(m.xy == m.yx) || (any(both) && all(either));
    return vec4f(fract(counted + q.xyz * 0.3 + vec3f(m) * 0.05 + select(0.0, 0.3, equal)), 1.0);
}
