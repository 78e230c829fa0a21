// What integers do at their edges: wrapping, division by zero, shifts, bit fields, packing.
@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    let u = u32(uv.x * 255.0) * 0x01020408u;
    let i = i32(uv.y * 200.0) - 100;
    let zero = i32(uv.x * 0.5);
    let lowest = i32(-2147483647) - 1 + zero;

    var h = u;
    h = h * 2654435761u + 12345u;
    h ^= h >> 15u;
    h ^= h << 7u;
    h -= 0xffffffffu;
    var s = i * 1103515245 + 2147483647;
    s = s >> 3u;
    s = s % 7 + i / 3 - i % -5;
    s += i / zero + i % zero;
    s += i32(7u / u32(zero)) + i32(7u % u32(zero));
    s ^= ~i;
    s += -lowest + abs(lowest) / 65536;
    s += lowest / -1 + lowest % -1;

    let bits = vec4u(countOneBits(h), countLeadingZeros(h >> 9u), countTrailingZeros(h | 256u), reverseBits(h));
    let fields = extractBits(h, 5u, 11u) + insertBits(u, h, 8u, 9u) + extractBits(u, 27u + (u & 3u), 9u);
    let signed = extractBits(s, 3u, 6u) + firstLeadingBit(s) + i32(firstTrailingBit(h | 64u)) + sign(i);
    let edge = firstLeadingBit(0u + u32(zero)) + u32(firstTrailingBit(zero));
    let packed = pack4x8unorm(vec4f(uv, 0.3, 0.7));
    let halves = unpack2x16float(pack2x16float(uv * 3.0));
    let signed_norm = unpack4x8snorm(h) * 0.25 + unpack4x8unorm(packed);
    let mixed = dot(vec3i(i, s, 3), vec3i(2, -1, i)) + max(i, s) + min(s, 5) + clamp(i, -20, 30);
    let reinterpreted = bitcast<f32>((h >> 9u) | 0x3f800000u) - 1.0;
    let back = bitcast<i32>(uv.x) >> 12u;
    let converted = i32(uv.x * -3.5) + i32(u32(uv.y * 3.9)) + i32(f32(i) * 0.7);
    let truth = u32(uv.x > 0.5) + u32(bool(i));

    let all = bits.x + bits.y * 3u + bits.z * 5u + (bits.w >> 24u) + fields + u32(signed) + edge + u32(mixed) + u32(back + converted) + truth;
    let shade = vec3f(f32(h & 255u), f32(all & 1023u) * 0.25, f32(s & 255)) / 255.0;
    return vec4f(fract(shade + signed_norm.xyz * 0.3 + vec3f(halves * 0.1, reinterpreted * 0.2)), 1.0);
}
