//! What 32-bit words mean: integers of both signs, bits, and the small formats that shaders pack into them.
//!
//! Nothing here traps: overflow wraps, a shift takes the low five bits of its amount, and division
//! by zero is defined as WGSL has it.

/// The bits of a number, with one NaN for all.
#[inline(always)]
pub fn bits(x: f32) -> u32 {
    if x.is_nan() { 0x7FC0_0000 } else { x.to_bits() }
}

/// Signed division; by zero, and where it overflows, it is the dividend.
#[inline(always)]
pub fn divide_signed(a: u32, b: u32) -> u32 {
    let (a, b) = (a as i32, b as i32);
    if b == 0 {
        a as u32
    } else {
        a.wrapping_div(b) as u32
    }
}

/// Unsigned division; by zero it is the dividend.
#[inline(always)]
pub fn divide_unsigned(a: u32, b: u32) -> u32 {
    a.checked_div(b).unwrap_or(a)
}

/// The remainder of signed division, with the sign of the dividend; by zero, and on overflow, it is 0.
#[inline(always)]
pub fn remainder_signed(a: u32, b: u32) -> u32 {
    let (a, b) = (a as i32, b as i32);
    if b == 0 { 0 } else { a.wrapping_rem(b) as u32 }
}

/// The remainder of unsigned division; by zero it is 0.
#[inline(always)]
pub fn remainder_unsigned(a: u32, b: u32) -> u32 {
    a.checked_rem(b).unwrap_or(0)
}

/// The place of the lowest bit that is set, or all ones.
#[inline(always)]
pub fn first_trailing_bit(a: u32) -> u32 {
    if a == 0 { u32::MAX } else { a.trailing_zeros() }
}

/// The place of the highest bit that is set, or all ones.
#[inline(always)]
pub fn first_leading_bit(a: u32) -> u32 {
    if a == 0 {
        u32::MAX
    } else {
        31 - a.leading_zeros()
    }
}

/// The place of the highest bit that differs from the sign, or all ones.
#[inline(always)]
pub fn first_leading_bit_signed(a: u32) -> u32 {
    first_leading_bit(if (a as i32) < 0 { !a } else { a })
}

/// The `count` bits from `offset` up, in place.
#[inline(always)]
pub fn field(offset: u32, count: u32) -> u32 {
    let offset = offset.min(32);
    let count = count.min(32 - offset);
    let ones = ((1u64 << count) - 1) << offset;
    ones as u32
}

/// `count` bits of `a` from `offset` up.
#[inline(always)]
pub fn extract(a: u32, offset: u32, count: u32) -> u32 {
    let offset = offset.min(32);
    ((u64::from(a) & u64::from(field(offset, count))) >> offset) as u32
}

/// `count` bits of `a` from `offset` up, the highest of them as a sign.
#[inline(always)]
pub fn extract_signed(a: u32, offset: u32, count: u32) -> u32 {
    let offset = offset.min(32);
    let count = count.min(32 - offset);
    if count == 0 {
        return 0;
    }
    let up = 32 - offset - count;
    (((a << up) as i32) >> (32 - count)) as u32
}

/// Half precision, rounded to nearest, ties to even; too large is infinite.
#[inline(always)]
pub fn float_to_half(x: f32) -> u32 {
    let sign = (x.to_bits() >> 16) & 0x8000;
    let size = x.to_bits() & 0x7FFF_FFFF;
    // Normal halves: drop 13 bits of mantissa, rounding; the carry may run into the exponent.
    let even = (size >> 13) & 1;
    let normal = size.wrapping_sub(112 << 23).wrapping_add(0xFFF + even) >> 13;
    // Subnormal halves: an addition of 0.5 leaves the rounded multiple of 2^-24 in the low bits.
    let subnormal = (f32::from_bits(size) + 0.5)
        .to_bits()
        .wrapping_sub(0.5f32.to_bits());
    let half = if size < 113 << 23 { subnormal } else { normal };
    // 65520 is the first number that rounds to infinity.
    let half = if size >= 65520f32.to_bits() {
        0x7C00
    } else {
        half
    };
    let half = if size > f32::INFINITY.to_bits() {
        0x7E00
    } else {
        half
    };
    sign | half
}

/// The number that the low 16 bits hold in half precision.
#[inline(always)]
pub fn half_to_float(half: u32) -> f32 {
    let sign = (half & 0x8000) << 16;
    let size = half & 0x7FFF;
    // 2^112 shifts the exponent from half's bias to that of f32, for subnormal numbers too.
    let finite = f32::from_bits(size << 13) * f32::from_bits((112 + 127) << 23);
    let x = if size == 0x7C00 {
        f32::INFINITY
    } else {
        finite
    };
    let x = if size > 0x7C00 { f32::NAN } else { x };
    f32::from_bits(x.to_bits() | sign)
}

/// A number in -1..1 as one of `2 * scale + 1` steps; NaN is the lowest.
#[inline(always)]
pub fn signed_norm(x: f32, scale: f32) -> u32 {
    let x = super::Real::clamp(x, -1.0, 1.0);
    (0.5 + scale * x).floor() as i32 as u32
}

/// A number in 0..1 as one of `scale + 1` steps; NaN is the lowest.
#[inline(always)]
pub fn unsigned_norm(x: f32, scale: f32) -> u32 {
    let x = super::Real::clamp(x, 0.0, 1.0);
    (0.5 + scale * x).floor() as i32 as u32
}
