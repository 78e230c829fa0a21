// Numbers as they can be written, and constants without a type that become what is asked for.
const N = 3;
const HALF = N / 6.0;
const BIG = 16777216.0 * 2;
const TINY = 1e-40;
const HEX = 0x1.8p1;
const THREE: u32 = N;
const LONG = 0.1234567890123456789;
const EXPONENT = 1.5e+3f;
const NEGATIVE = -N;
const SHIFTED = 1 << 4;
const PAIR = vec2(N, 2) * 2;

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    let a = N * uv.x + HALF;
    let b = i32(uv.y * 10.0) % N + NEGATIVE;
    let c = u32(uv.x * 10.0) / THREE;
    let d = BIG * uv.x - BIG * uv.x + TINY;
    let e = 3.40282346e38 * uv.y * 1e-38 + f32(0xFFu) + 0x1p-3;
    let f = LONG + .5 + 5.f + HEX + EXPONENT - 1500.0;
    let g = vec2f(PAIR) * 0.01 + f32(SHIFTED) * 0.001 + 0.1f - 1e-1;
    return vec4f(fract(a + f32(b) * 0.1), fract(f32(c) * 0.3 + d + f), fract(e * 0.1 + g.x + g.y), 1.0);
}
