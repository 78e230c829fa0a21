// What is computed once a draw for the levels of integers.wgsl, by lodc (lock format 1). Made from the lock: change that,
// not this. It does on the CPU what the entry point `lod_parameters` of integers.lod does on the GPU.

/// `Given` as a buffer has it: 96 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(dead_code, missing_docs, non_camel_case_types, non_snake_case, unreachable_pub)]
pub struct Given {
    pub a: [i32; 4],
    pub b: [i32; 4],
    pub c: [u32; 4],
    pub d: [u32; 4],
    pub x: [f32; 4],
    pub y: [f32; 4],
}

/// `LodParameters` as a buffer has it: 64 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(dead_code, missing_docs, non_camel_case_types, non_snake_case, unreachable_pub)]
pub struct LodParameters {
    pub all_of_it: [f32; 4],
    pub return_float: f32,
    pub _padding_0: [u32; 3],
    pub return_vec4: [f32; 4],
    pub return_vec4_2: [f32; 4],
}

impl LodParameters {
    /// What the buffer holds, in the order of bytes that GPUs have.
    #[allow(clippy::all, clippy::pedantic, dead_code, unreachable_pub)]
    pub fn to_bytes(self) -> [u8; 64] {
        let mut bytes = [0; 64];
        wgsl::put(&mut bytes, 0, self.all_of_it.map(f32::to_bits));
        wgsl::put(&mut bytes, 16, [self.return_float].map(f32::to_bits));
        wgsl::put(&mut bytes, 32, self.return_vec4.map(f32::to_bits));
        wgsl::put(&mut bytes, 48, self.return_vec4_2.map(f32::to_bits));
        bytes
    }
}

/// The parameters of a draw with these uniforms.
#[allow(clippy::all, clippy::pedantic, non_snake_case, unreachable_code, unused_assignments, unused_labels, unused_mut, unreachable_pub)]
pub fn lod_parameters(given: &Given) -> LodParameters {
    let mut parameters_stored = LodParameters::default();
    lod_one_parameters(given, &mut parameters_stored);
    parameters_stored
}

#[allow(clippy::all, clippy::pedantic, non_snake_case, unreachable_code, unused_assignments, unused_labels, unused_mut, unreachable_pub)]
fn lod_one_parameters(given: &Given, parameters_stored: &mut LodParameters) {
    let mut local: bool = false;
    let mut local_2: bool = false;
    let a = given.a;
    let c = given.c;
    let d = given.d;
    let real = wgsl::add_4(wgsl::add_4(wgsl::multiply_4(wgsl::f32_from_4i(a), given.x), wgsl::divide_4(wgsl::f32_from_4u(c), given.y)), wgsl::bits_as_f32_4u(d));
    let unpacked = wgsl::add_4(wgsl::add_4(wgsl::unpack4x8snorm_1u(c[0]), wgsl::unpack4x8unorm_1u(c[1])), wgsl::join_2_2(wgsl::unpack2x16float_1u(d[0]), wgsl::unpack2x16snorm_1u(d[1])));
    let halves_add_2 = wgsl::add_4(wgsl::add_4(wgsl::quantize_to_f16_4(given.x), wgsl::ldexp_4_4i(given.y, wgsl::and_4i(a, [15i32; 4]))), wgsl::frexp_4(given.x).0);
    let halves = wgsl::add_4(halves_add_2, wgsl::f32_from_4i(wgsl::frexp_4(given.y).1));
    let b = given.b;
    let signed_add_2 = wgsl::add_4i(wgsl::multiply_4i(wgsl::divide_4i(a, b), wgsl::subtract_4i(b, a)), wgsl::modulo_4i(a, wgsl::add_4i(b, [1i32; 4])));
    let signed = wgsl::subtract_4i(signed_add_2, wgsl::negate_4i(a));
    let unsigned = wgsl::add_4u(wgsl::multiply_4u(wgsl::divide_4u(c, d), wgsl::subtract_4u(d, c)), wgsl::modulo_4u(c, wgsl::add_4u(d, [1u32; 4])));
    let shifted = wgsl::inclusive_or_4i(wgsl::exclusive_or_4i(wgsl::shift_left_4i_4u(a, c), wgsl::shift_right_4i_4u(b, d)), wgsl::bitwise_not_4i(wgsl::and_4i(wgsl::abs_4i(a), wgsl::sign_4i(b))));
    let turned = wgsl::and_4u(wgsl::exclusive_or_4u(wgsl::shift_left_4u(c, d), wgsl::shift_right_4u(d, c)), wgsl::bitwise_not_4u(wgsl::inclusive_or_4u(c, d)));
    let ordered = wgsl::add_4i(wgsl::min_4i(a, b), wgsl::multiply_4i(wgsl::max_4i(a, b), wgsl::clamp_4i(a, b, [9i32; 4])));
    let fingers_add_4 = wgsl::add_4u(wgsl::add_4u(wgsl::add_4u(wgsl::add_4u(wgsl::u32_from_4i(signed), unsigned), wgsl::u32_from_4i(shifted)), turned), wgsl::u32_from_4i(ordered));
    let counted = wgsl::add_4u(wgsl::add_4u(wgsl::count_one_bits_4u(c), wgsl::multiply_4u(wgsl::count_leading_zeros_4u(d), wgsl::count_trailing_zeros_4u(c))), wgsl::reverse_bits_4u(d));
    let found_add_2 = wgsl::add_4u(wgsl::add_4u(wgsl::first_leading_bit_4u(c), wgsl::first_trailing_bit_4u(d)), wgsl::extract_bits_4u_1u_1u(c, d[0], d[1]));
    let found = wgsl::add_4u(found_add_2, wgsl::insert_bits_4u_4u_1u_1u(c, d, d[2], d[3]));
    let first = wgsl::add_4i(wgsl::add_4i(wgsl::first_leading_bit_4i(a), wgsl::extract_bits_4i_1u_1u(b, c[0], d[1])), wgsl::select_4b_4i_4i(wgsl::less_equal_4i(a, b), b, a));
    let bytes = [wgsl::pack4x8snorm_4(given.x), wgsl::pack4x8unorm_4(given.y), wgsl::pack2x16float_2(wgsl::pick(given.x, [0, 1])), wgsl::dot4_u8_packed_1u(c[0], d[0])];
    let whole = wgsl::add_4i(wgsl::add_4i(wgsl::i32_from_4(given.x), wgsl::multiply_4i(wgsl::bits_as_i32_4(given.y), wgsl::i32_from_4b(wgsl::less_4u(c, d)))), wgsl::i32_from_4u(wgsl::u32_from_4(wgsl::multiply_4_1(given.x, 1000000000.0))));
    let fingers = wgsl::add_4u(wgsl::add_4u(wgsl::add_4u(wgsl::add_4u(wgsl::add_4u(fingers_add_4, counted), found), wgsl::u32_from_4i(first)), bytes), wgsl::u32_from_4i(whole));
    let scalar_add = wgsl::div_int(a[0], b[0]).wrapping_add(wgsl::dot4_i8_packed_1u(c[1], d[1]).wrapping_mul(c[2] as i32));
    let scalar = scalar_add.wrapping_add(wgsl::dot_4i(a, b)).wrapping_sub(a[1] << (c[1] & 31u32 & 31));
    if !wgsl::all_4b(wgsl::less_4i(a, b)) {
        if wgsl::any_4b(wgsl::equal_4u(c, d)) {
            local_2 = !(given.x[0] < given.y[0]);
        } else {
            local_2 = false;
        }
        local = local_2;
    } else {
        local = true;
    }
    let truth = local;
    let chosen = wgsl::select_1b_4u_4u(truth, d, wgsl::divide_4u(c, wgsl::and_4u(d, [3u32; 4])));
    parameters_stored.all_of_it = wgsl::add_4(wgsl::add_4(real, unpacked), halves);
    parameters_stored.return_float = scalar as f32;
    parameters_stored.return_vec4 = wgsl::f32_from_4u(fingers);
    parameters_stored.return_vec4_2 = wgsl::f32_from_4u(chosen);
}

/// What WGSL's operations mean, where Rust has none that means the same.
#[allow(dead_code, clippy::all, clippy::pedantic)]
mod wgsl {
    pub(super) fn abs_4i(a: [i32; 4]) -> [i32; 4] {
        [a[0].wrapping_abs(), a[1].wrapping_abs(), a[2].wrapping_abs(), a[3].wrapping_abs()]
    }

    pub(super) fn add_4(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
        [a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3]]
    }

    pub(super) fn add_4i(a: [i32; 4], b: [i32; 4]) -> [i32; 4] {
        [
            a[0].wrapping_add(b[0]),
            a[1].wrapping_add(b[1]),
            a[2].wrapping_add(b[2]),
            a[3].wrapping_add(b[3]),
        ]
    }

    pub(super) fn add_4u(a: [u32; 4], b: [u32; 4]) -> [u32; 4] {
        [
            a[0].wrapping_add(b[0]),
            a[1].wrapping_add(b[1]),
            a[2].wrapping_add(b[2]),
            a[3].wrapping_add(b[3]),
        ]
    }

    pub(super) fn all_4b(a: [bool; 4]) -> bool {
        a[0] & a[1] & a[2] & a[3]
    }

    pub(super) fn and_4i(a: [i32; 4], b: [i32; 4]) -> [i32; 4] {
        [a[0] & b[0], a[1] & b[1], a[2] & b[2], a[3] & b[3]]
    }

    pub(super) fn and_4u(a: [u32; 4], b: [u32; 4]) -> [u32; 4] {
        [a[0] & b[0], a[1] & b[1], a[2] & b[2], a[3] & b[3]]
    }

    pub(super) fn any_4b(a: [bool; 4]) -> bool {
        a[0] | a[1] | a[2] | a[3]
    }

    pub(super) fn bits(a: f32) -> u32 {
        if a.is_nan() { 0x7fc0_0000 } else { a.to_bits() }
    }

    pub(super) fn bits_as_f32_4u(a: [u32; 4]) -> [f32; 4] {
        [f32::from_bits(a[0]), f32::from_bits(a[1]), f32::from_bits(a[2]), f32::from_bits(a[3])]
    }

    pub(super) fn bits_as_i32_4(a: [f32; 4]) -> [i32; 4] {
        [bits(a[0]) as i32, bits(a[1]) as i32, bits(a[2]) as i32, bits(a[3]) as i32]
    }

    pub(super) fn bitwise_not_4i(a: [i32; 4]) -> [i32; 4] {
        [!a[0], !a[1], !a[2], !a[3]]
    }

    pub(super) fn bitwise_not_4u(a: [u32; 4]) -> [u32; 4] {
        [!a[0], !a[1], !a[2], !a[3]]
    }

    pub(super) fn clamp(a: f32, low: f32, high: f32) -> f32 {
        min(max(a, low), high)
    }

    pub(super) fn clamp_4i(a: [i32; 4], b: [i32; 4], c: [i32; 4]) -> [i32; 4] {
        [
            a[0].max(b[0]).min(c[0]),
            a[1].max(b[1]).min(c[1]),
            a[2].max(b[2]).min(c[2]),
            a[3].max(b[3]).min(c[3]),
        ]
    }

    pub(super) fn count_leading_zeros_4u(a: [u32; 4]) -> [u32; 4] {
        [a[0].leading_zeros(), a[1].leading_zeros(), a[2].leading_zeros(), a[3].leading_zeros()]
    }

    pub(super) fn count_one_bits_4u(a: [u32; 4]) -> [u32; 4] {
        [a[0].count_ones(), a[1].count_ones(), a[2].count_ones(), a[3].count_ones()]
    }

    pub(super) fn count_trailing_zeros_4u(a: [u32; 4]) -> [u32; 4] {
        [
            a[0].trailing_zeros(),
            a[1].trailing_zeros(),
            a[2].trailing_zeros(),
            a[3].trailing_zeros(),
        ]
    }

    pub(super) fn div_int(a: i32, b: i32) -> i32 {
        if b == 0 { a } else { a.wrapping_div(b) }
    }

    pub(super) fn div_uint(a: u32, b: u32) -> u32 {
        a.checked_div(b).unwrap_or(a)
    }

    pub(super) fn divide_4(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
        [a[0] / b[0], a[1] / b[1], a[2] / b[2], a[3] / b[3]]
    }

    pub(super) fn divide_4i(a: [i32; 4], b: [i32; 4]) -> [i32; 4] {
        [div_int(a[0], b[0]), div_int(a[1], b[1]), div_int(a[2], b[2]), div_int(a[3], b[3])]
    }

    pub(super) fn divide_4u(a: [u32; 4], b: [u32; 4]) -> [u32; 4] {
        [div_uint(a[0], b[0]), div_uint(a[1], b[1]), div_uint(a[2], b[2]), div_uint(a[3], b[3])]
    }

    pub(super) fn dot4_i8_packed_1u(a: u32, b: u32) -> i32 {
        extract_int(a, 0u32, 8u32).wrapping_mul(extract_int(b, 0u32, 8u32)).wrapping_add(extract_int(a, 8u32, 8u32).wrapping_mul(extract_int(b, 8u32, 8u32))).wrapping_add(extract_int(a, 16u32, 8u32).wrapping_mul(extract_int(b, 16u32, 8u32))).wrapping_add(extract_int(a, 24u32, 8u32).wrapping_mul(extract_int(b, 24u32, 8u32)))
    }

    pub(super) fn dot4_u8_packed_1u(a: u32, b: u32) -> u32 {
        extract(a, 0u32, 8u32).wrapping_mul(extract(b, 0u32, 8u32)).wrapping_add(extract(a, 8u32, 8u32).wrapping_mul(extract(b, 8u32, 8u32))).wrapping_add(extract(a, 16u32, 8u32).wrapping_mul(extract(b, 16u32, 8u32))).wrapping_add(extract(a, 24u32, 8u32).wrapping_mul(extract(b, 24u32, 8u32)))
    }

    pub(super) fn dot_4i(a: [i32; 4], b: [i32; 4]) -> i32 {
        a[0].wrapping_mul(b[0]).wrapping_add(a[1].wrapping_mul(b[1])).wrapping_add(a[2].wrapping_mul(b[2])).wrapping_add(a[3].wrapping_mul(b[3]))
    }

    pub(super) fn equal_4u(a: [u32; 4], b: [u32; 4]) -> [bool; 4] {
        [a[0] == b[0], a[1] == b[1], a[2] == b[2], a[3] == b[3]]
    }

    pub(super) fn exclusive_or_4i(a: [i32; 4], b: [i32; 4]) -> [i32; 4] {
        [a[0] ^ b[0], a[1] ^ b[1], a[2] ^ b[2], a[3] ^ b[3]]
    }

    pub(super) fn exclusive_or_4u(a: [u32; 4], b: [u32; 4]) -> [u32; 4] {
        [a[0] ^ b[0], a[1] ^ b[1], a[2] ^ b[2], a[3] ^ b[3]]
    }

    pub(super) fn extract(a: u32, offset: u32, count: u32) -> u32 {
        (u64::from(a & field(offset, count)) >> offset.min(32)) as u32
    }

    pub(super) fn extract_bits_4i_1u_1u(a: [i32; 4], b: u32, c: u32) -> [i32; 4] {
        [
            extract_int(a[0] as u32, b, c),
            extract_int(a[1] as u32, b, c),
            extract_int(a[2] as u32, b, c),
            extract_int(a[3] as u32, b, c),
        ]
    }

    pub(super) fn extract_bits_4u_1u_1u(a: [u32; 4], b: u32, c: u32) -> [u32; 4] {
        [extract(a[0], b, c), extract(a[1], b, c), extract(a[2], b, c), extract(a[3], b, c)]
    }

    pub(super) fn extract_int(a: u32, offset: u32, count: u32) -> i32 {
        let offset = offset.min(32);
        let count = count.min(32 - offset);
        if count == 0 {
            return 0;
        }
        ((a << (32 - offset - count)) as i32) >> (32 - count)
    }

    pub(super) fn f32_from_4i(a: [i32; 4]) -> [f32; 4] {
        [a[0] as f32, a[1] as f32, a[2] as f32, a[3] as f32]
    }

    pub(super) fn f32_from_4u(a: [u32; 4]) -> [f32; 4] {
        [a[0] as f32, a[1] as f32, a[2] as f32, a[3] as f32]
    }

    /// Ones in `count` bits from `offset` up.
    pub(super) fn field(offset: u32, count: u32) -> u32 {
        let offset = offset.min(32);
        let count = count.min(32 - offset);
        (((1u64 << count) - 1) << offset) as u32
    }

    pub(super) fn first_leading_bit(a: u32) -> u32 {
        if a == 0 { u32::MAX } else { 31 - a.leading_zeros() }
    }

    pub(super) fn first_leading_bit_4i(a: [i32; 4]) -> [i32; 4] {
        [
            first_leading_bit_int(a[0]) as i32,
            first_leading_bit_int(a[1]) as i32,
            first_leading_bit_int(a[2]) as i32,
            first_leading_bit_int(a[3]) as i32,
        ]
    }

    pub(super) fn first_leading_bit_4u(a: [u32; 4]) -> [u32; 4] {
        [
            first_leading_bit(a[0]),
            first_leading_bit(a[1]),
            first_leading_bit(a[2]),
            first_leading_bit(a[3]),
        ]
    }

    pub(super) fn first_leading_bit_int(a: i32) -> u32 {
        first_leading_bit((if a < 0 { !a } else { a }) as u32)
    }

    pub(super) fn first_trailing_bit(a: u32) -> u32 {
        if a == 0 { u32::MAX } else { a.trailing_zeros() }
    }

    pub(super) fn first_trailing_bit_4u(a: [u32; 4]) -> [u32; 4] {
        [
            first_trailing_bit(a[0]),
            first_trailing_bit(a[1]),
            first_trailing_bit(a[2]),
            first_trailing_bit(a[3]),
        ]
    }

    /// The number of the low 16 bits.
    pub(super) fn float_of_half(half: u32) -> f32 {
        let size = half & 0x7fff;
        let a = if size > 0x7c00 {
            f32::NAN
        } else if size == 0x7c00 {
            f32::INFINITY
        } else {
            f32::from_bits(size << 13) * f32::from_bits((112 + 127) << 23)
        };
        if half & 0x8000 == 0 { a } else { -a }
    }

    pub(super) fn frexp_4(a: [f32; 4]) -> ([f32; 4], [i32; 4]) {
        ([frexp_fraction(a[0]), frexp_fraction(a[1]), frexp_fraction(a[2]), frexp_fraction(a[3])], [frexp_exponent(a[0]), frexp_exponent(a[1]), frexp_exponent(a[2]), frexp_exponent(a[3])])
    }

    pub(super) fn frexp_exponent(a: f32) -> i32 {
        if a == 0.0 || !a.is_finite() {
            return 0;
        }
        let is_small = libm::fabsf(a) < f32::MIN_POSITIVE;
        let (a, shift) = if is_small { (a * 8_388_608.0, 23) } else { (a, 0) };
        ((a.to_bits() >> 23) & 0xff) as i32 - 126 - shift
    }

    pub(super) fn frexp_fraction(a: f32) -> f32 {
        if a == 0.0 || !a.is_finite() {
            return a;
        }
        // A small number is made larger, so that its first digit stands where it does in others.
        let a = if libm::fabsf(a) < f32::MIN_POSITIVE { a * 8_388_608.0 } else { a };
        f32::from_bits((a.to_bits() & 0x807f_ffff) | 0x3f00_0000)
    }

    /// Half precision, rounded to nearest, ties to even; too large is infinite.
    pub(super) fn half(a: f32) -> u32 {
        let sign = (a.to_bits() >> 16) & 0x8000;
        let size = a.to_bits() & 0x7fff_ffff;
        let half = if size > 0x7f80_0000 {
            0x7e00
        } else if size >= 65520f32.to_bits() {
            0x7c00
        } else if size < 113 << 23 {
            // A multiple of 2^-24: the sum with 0.5 rounds to it.
            (f32::from_bits(size) + 0.5).to_bits().wrapping_sub(0.5f32.to_bits())
        } else {
            (size - (112 << 23) + 0xfff + ((size >> 13) & 1)) >> 13
        };
        sign | half
    }

    /// Truncated to the nearest that is both an integer and a float.
    pub(super) fn i32_from(a: f32) -> i32 {
        let a = if a < -2147483600.0 { -2147483600.0 } else { a };
        (if a > 2147483500.0 { 2147483500.0 } else { a }) as i32
    }

    pub(super) fn i32_from_4(a: [f32; 4]) -> [i32; 4] {
        [i32_from(a[0]), i32_from(a[1]), i32_from(a[2]), i32_from(a[3])]
    }

    pub(super) fn i32_from_4b(a: [bool; 4]) -> [i32; 4] {
        [a[0] as i32, a[1] as i32, a[2] as i32, a[3] as i32]
    }

    pub(super) fn i32_from_4u(a: [u32; 4]) -> [i32; 4] {
        [a[0] as i32, a[1] as i32, a[2] as i32, a[3] as i32]
    }

    pub(super) fn inclusive_or_4i(a: [i32; 4], b: [i32; 4]) -> [i32; 4] {
        [a[0] | b[0], a[1] | b[1], a[2] | b[2], a[3] | b[3]]
    }

    pub(super) fn inclusive_or_4u(a: [u32; 4], b: [u32; 4]) -> [u32; 4] {
        [a[0] | b[0], a[1] | b[1], a[2] | b[2], a[3] | b[3]]
    }

    pub(super) fn insert_bits_4u_4u_1u_1u(a: [u32; 4], b: [u32; 4], c: u32, d: u32) -> [u32; 4] {
        let t10 = field(c, d);
        let t11 = !t10;
        [
            a[0] & t11 | b[0] << (c & 31) & t10,
            a[1] & t11 | b[1] << (c & 31) & t10,
            a[2] & t11 | b[2] << (c & 31) & t10,
            a[3] & t11 | b[3] << (c & 31) & t10,
        ]
    }

    pub(super) fn join_2_2<T: Copy>(a: [T; 2], b: [T; 2]) -> [T; 4] {
        [a[0], a[1], b[0], b[1]]
    }

    /// In three steps, so that each power of two is a number.
    pub(super) fn ldexp(a: f32, exponent: i32) -> f32 {
        let n = exponent.clamp(-300, 300);
        let first = n / 3;
        let power = |n: i32| f32::from_bits(((n + 127) as u32) << 23);
        a * power(first) * power(first) * power(n - 2 * first)
    }

    pub(super) fn ldexp_4_4i(a: [f32; 4], b: [i32; 4]) -> [f32; 4] {
        [ldexp(a[0], b[0]), ldexp(a[1], b[1]), ldexp(a[2], b[2]), ldexp(a[3], b[3])]
    }

    pub(super) fn less_4i(a: [i32; 4], b: [i32; 4]) -> [bool; 4] {
        [a[0] < b[0], a[1] < b[1], a[2] < b[2], a[3] < b[3]]
    }

    pub(super) fn less_4u(a: [u32; 4], b: [u32; 4]) -> [bool; 4] {
        [a[0] < b[0], a[1] < b[1], a[2] < b[2], a[3] < b[3]]
    }

    pub(super) fn less_equal_4i(a: [i32; 4], b: [i32; 4]) -> [bool; 4] {
        [a[0] <= b[0], a[1] <= b[1], a[2] <= b[2], a[3] <= b[3]]
    }

    /// The larger; where one is not a number, the other.
    pub(super) fn max(a: f32, b: f32) -> f32 {
        if a < b || a.is_nan() { b } else { a }
    }

    pub(super) fn max_4i(a: [i32; 4], b: [i32; 4]) -> [i32; 4] {
        [a[0].max(b[0]), a[1].max(b[1]), a[2].max(b[2]), a[3].max(b[3])]
    }

    /// The smaller; where one is not a number, the other.
    pub(super) fn min(a: f32, b: f32) -> f32 {
        if b < a || a.is_nan() { b } else { a }
    }

    pub(super) fn min_4i(a: [i32; 4], b: [i32; 4]) -> [i32; 4] {
        [a[0].min(b[0]), a[1].min(b[1]), a[2].min(b[2]), a[3].min(b[3])]
    }

    pub(super) fn modulo_4i(a: [i32; 4], b: [i32; 4]) -> [i32; 4] {
        [rem_int(a[0], b[0]), rem_int(a[1], b[1]), rem_int(a[2], b[2]), rem_int(a[3], b[3])]
    }

    pub(super) fn modulo_4u(a: [u32; 4], b: [u32; 4]) -> [u32; 4] {
        [rem_uint(a[0], b[0]), rem_uint(a[1], b[1]), rem_uint(a[2], b[2]), rem_uint(a[3], b[3])]
    }

    pub(super) fn multiply_4(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
        [a[0] * b[0], a[1] * b[1], a[2] * b[2], a[3] * b[3]]
    }

    pub(super) fn multiply_4_1(a: [f32; 4], b: f32) -> [f32; 4] {
        [a[0] * b, a[1] * b, a[2] * b, a[3] * b]
    }

    pub(super) fn multiply_4i(a: [i32; 4], b: [i32; 4]) -> [i32; 4] {
        [
            a[0].wrapping_mul(b[0]),
            a[1].wrapping_mul(b[1]),
            a[2].wrapping_mul(b[2]),
            a[3].wrapping_mul(b[3]),
        ]
    }

    pub(super) fn multiply_4u(a: [u32; 4], b: [u32; 4]) -> [u32; 4] {
        [
            a[0].wrapping_mul(b[0]),
            a[1].wrapping_mul(b[1]),
            a[2].wrapping_mul(b[2]),
            a[3].wrapping_mul(b[3]),
        ]
    }

    pub(super) fn negate_4i(a: [i32; 4]) -> [i32; 4] {
        [a[0].wrapping_neg(), a[1].wrapping_neg(), a[2].wrapping_neg(), a[3].wrapping_neg()]
    }

    pub(super) fn pack2x16float_2(a: [f32; 2]) -> u32 {
        (half(a[0]) & 65535u32) << (0u32 & 31) | (half(a[1]) & 65535u32) << (16u32 & 31)
    }

    pub(super) fn pack4x8snorm_4(a: [f32; 4]) -> u32 {
        ((signed_norm(a[0], 127.0) & 255i32) << (0u32 & 31) | (signed_norm(a[1], 127.0) & 255i32) << (8u32 & 31) | (signed_norm(a[2], 127.0) & 255i32) << (16u32 & 31) | (signed_norm(a[3], 127.0) & 255i32) << (24u32 & 31)) as u32
    }

    pub(super) fn pack4x8unorm_4(a: [f32; 4]) -> u32 {
        ((unsigned_norm(a[0], 255.0) & 255i32) << (0u32 & 31) | (unsigned_norm(a[1], 255.0) & 255i32) << (8u32 & 31) | (unsigned_norm(a[2], 255.0) & 255i32) << (16u32 & 31) | (unsigned_norm(a[3], 255.0) & 255i32) << (24u32 & 31)) as u32
    }

    /// Some components of a vector, in another order.
    pub(super) fn pick<T: Copy, const N: usize, const M: usize>(a: [T; N], at: [usize; M]) -> [T; M] {
        at.map(|at| a[at])
    }

    /// Writes words into bytes, from a place on.
    pub(super) fn put<const N: usize>(bytes: &mut [u8], at: usize, words: [u32; N]) {
        for (i, word) in words.into_iter().enumerate() {
            bytes[at + 4 * i..][..4].copy_from_slice(&word.to_le_bytes());
        }
    }

    pub(super) fn quantize(a: f32) -> f32 {
        float_of_half(half(a))
    }

    pub(super) fn quantize_to_f16_4(a: [f32; 4]) -> [f32; 4] {
        [quantize(a[0]), quantize(a[1]), quantize(a[2]), quantize(a[3])]
    }

    pub(super) fn rem_int(a: i32, b: i32) -> i32 {
        if b == 0 { 0 } else { a.wrapping_rem(b) }
    }

    pub(super) fn rem_uint(a: u32, b: u32) -> u32 {
        a.checked_rem(b).unwrap_or(0)
    }

    pub(super) fn reverse_bits_4u(a: [u32; 4]) -> [u32; 4] {
        [a[0].reverse_bits(), a[1].reverse_bits(), a[2].reverse_bits(), a[3].reverse_bits()]
    }

    pub(super) fn select_1b_4u_4u(a: bool, b: [u32; 4], c: [u32; 4]) -> [u32; 4] {
        [
            if a { b[0] } else { c[0] },
            if a { b[1] } else { c[1] },
            if a { b[2] } else { c[2] },
            if a { b[3] } else { c[3] },
        ]
    }

    pub(super) fn select_4b_4i_4i(a: [bool; 4], b: [i32; 4], c: [i32; 4]) -> [i32; 4] {
        [
            if a[0] { b[0] } else { c[0] },
            if a[1] { b[1] } else { c[1] },
            if a[2] { b[2] } else { c[2] },
            if a[3] { b[3] } else { c[3] },
        ]
    }

    pub(super) fn shift_left_4i_4u(a: [i32; 4], b: [u32; 4]) -> [i32; 4] {
        [a[0] << (b[0] & 31), a[1] << (b[1] & 31), a[2] << (b[2] & 31), a[3] << (b[3] & 31)]
    }

    pub(super) fn shift_left_4u(a: [u32; 4], b: [u32; 4]) -> [u32; 4] {
        [a[0] << (b[0] & 31), a[1] << (b[1] & 31), a[2] << (b[2] & 31), a[3] << (b[3] & 31)]
    }

    pub(super) fn shift_right_4i_4u(a: [i32; 4], b: [u32; 4]) -> [i32; 4] {
        [a[0] >> (b[0] & 31), a[1] >> (b[1] & 31), a[2] >> (b[2] & 31), a[3] >> (b[3] & 31)]
    }

    pub(super) fn shift_right_4u(a: [u32; 4], b: [u32; 4]) -> [u32; 4] {
        [a[0] >> (b[0] & 31), a[1] >> (b[1] & 31), a[2] >> (b[2] & 31), a[3] >> (b[3] & 31)]
    }

    pub(super) fn sign_4i(a: [i32; 4]) -> [i32; 4] {
        [a[0].signum(), a[1].signum(), a[2].signum(), a[3].signum()]
    }

    pub(super) fn signed_norm(a: f32, scale: f32) -> i32 {
        libm::floorf(0.5 + scale * clamp(a, -1.0, 1.0)) as i32
    }

    pub(super) fn subtract_4i(a: [i32; 4], b: [i32; 4]) -> [i32; 4] {
        [
            a[0].wrapping_sub(b[0]),
            a[1].wrapping_sub(b[1]),
            a[2].wrapping_sub(b[2]),
            a[3].wrapping_sub(b[3]),
        ]
    }

    pub(super) fn subtract_4u(a: [u32; 4], b: [u32; 4]) -> [u32; 4] {
        [
            a[0].wrapping_sub(b[0]),
            a[1].wrapping_sub(b[1]),
            a[2].wrapping_sub(b[2]),
            a[3].wrapping_sub(b[3]),
        ]
    }

    /// Truncated to the nearest that is both an integer and a float.
    pub(super) fn u32_from(a: f32) -> u32 {
        (if a > 4294967000.0 { 4294967000.0 } else { a }) as u32
    }

    pub(super) fn u32_from_4(a: [f32; 4]) -> [u32; 4] {
        [u32_from(a[0]), u32_from(a[1]), u32_from(a[2]), u32_from(a[3])]
    }

    pub(super) fn u32_from_4i(a: [i32; 4]) -> [u32; 4] {
        [a[0] as u32, a[1] as u32, a[2] as u32, a[3] as u32]
    }

    pub(super) fn unpack2x16float_1u(a: u32) -> [f32; 2] {
        [float_of_half(extract(a, 0u32, 16u32)), float_of_half(extract(a, 16u32, 16u32))]
    }

    pub(super) fn unpack2x16snorm_1u(a: u32) -> [f32; 2] {
        [
            max((extract_int(a, 0u32, 16u32) as f32) / 32767.0, -1.0),
            max((extract_int(a, 16u32, 16u32) as f32) / 32767.0, -1.0),
        ]
    }

    pub(super) fn unpack4x8snorm_1u(a: u32) -> [f32; 4] {
        [
            max((extract_int(a, 0u32, 8u32) as f32) / 127.0, -1.0),
            max((extract_int(a, 8u32, 8u32) as f32) / 127.0, -1.0),
            max((extract_int(a, 16u32, 8u32) as f32) / 127.0, -1.0),
            max((extract_int(a, 24u32, 8u32) as f32) / 127.0, -1.0),
        ]
    }

    pub(super) fn unpack4x8unorm_1u(a: u32) -> [f32; 4] {
        [
            (extract(a, 0u32, 8u32) as f32) / 255.0,
            (extract(a, 8u32, 8u32) as f32) / 255.0,
            (extract(a, 16u32, 8u32) as f32) / 255.0,
            (extract(a, 24u32, 8u32) as f32) / 255.0,
        ]
    }

    pub(super) fn unsigned_norm(a: f32, scale: f32) -> i32 {
        libm::floorf(0.5 + scale * clamp(a, 0.0, 1.0)) as i32
    }
}
