// Integers that overflow, are divided by zero and shifted too far, and bits that are packed.
struct Given {
    a: vec4i,
    b: vec4i,
    c: vec4u,
    d: vec4u,
    x: vec4f,
    y: vec4f,
}
@group(0) @binding(0) var<uniform> given: Given;

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    let a = given.a;
    let b = given.b;
    let c = given.c;
    let d = given.d;
    let signed = (a / b) * (b - a) + a % (b + vec4i(1)) - (-a);
    let unsigned = (c / d) * (d - c) + c % (d + vec4u(1u));
    let shifted = ((a << c) ^ (b >> d)) | ~(abs(a) & sign(b));
    let turned = ((c << d) ^ (d >> c)) & ~(c | d);
    let ordered = min(a, b) + max(a, b) * clamp(a, b, vec4i(9));
    let counted = countOneBits(c) + countLeadingZeros(d) * countTrailingZeros(c) + reverseBits(d);
    let found = firstLeadingBit(c) + firstTrailingBit(d) + extractBits(c, d.x, d.y) + insertBits(c, d, d.z, d.w);
    let first = firstLeadingBit(a) + extractBits(b, c.x, d.y) + select(a, b, a <= b);
    let bytes = vec4u(pack4x8snorm(given.x), pack4x8unorm(given.y), pack2x16float(given.x.xy), dot4U8Packed(c.x, d.x));
    let unpacked = unpack4x8snorm(c.x) + unpack4x8unorm(c.y) + vec4f(unpack2x16float(d.x), unpack2x16snorm(d.y));
    let whole = vec4i(given.x) + bitcast<vec4i>(given.y) * vec4i(c < d) + vec4i(vec4u(given.x * 1e9));
    let scalar = a.x / b.x + dot4I8Packed(c.y, d.y) * i32(c.z) + dot(a, b) - (a.y << (c.y & 31u));
    let real = vec4f(a) * given.x + vec4f(c) / given.y + bitcast<vec4f>(d);
    let truth = all(a < b) || any(c == d) && !(given.x.x < given.y.x);
    let halves = quantizeToF16(given.x) + ldexp(given.y, a & vec4i(15)) + frexp(given.x).fract + vec4f(frexp(given.y).exp);
    let fingers = vec4u(signed) + unsigned + vec4u(shifted) + turned + vec4u(ordered) + counted + found + vec4u(first) + bytes + vec4u(whole);
    let all_of_it = real + unpacked + halves;
    let chosen = select(c / b_of(d), d, truth);
    return vec4f(fingers) * uv.x + all_of_it * uv.y + f32(scalar) * uv.xyxy + vec4f(chosen) * uv.yxyx;
}

fn b_of(d: vec4u) -> vec4u {
    return d & vec4u(3u);
}
