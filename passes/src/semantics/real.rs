//! What a floating-point number is to the table of semantics: [`Real`], and its meaning for `f32`.
//!
//! For `f32` every function gives the same bits on every machine: only operations that IEEE 754 rounds
//! exactly are used, none is fused, and nothing depends on the platform's mathematics library. The common
//! functions are free of branches, so that a loop over an array of them vectorises. Their polynomials are
//! minimax fits made for this file (Remez exchange; the weighted error of each is in its comment).
//! The tests measure every function against `f64`.

use super::words;

/// A number that a shader computes with in place of `f32`. Comparisons with NaN are false.
///
/// Methods have the meaning of WGSL's operator or function of the same name. They are not called with
/// method syntax, which would reach the functions of the standard library instead: `Real::exp2(x)`.
#[allow(missing_docs)] // Each is the WGSL function of that name.
pub trait Real: Copy + Default + std::fmt::Debug + Send + Sync + 'static {
    /// The nearest number of this type.
    fn from_f32(x: f32) -> Self;
    /// The nearest `f32`.
    fn to_f32(self) -> f32;
    /// A signed integer, rounded to nearest.
    fn from_i32(x: i32) -> Self;
    /// An unsigned integer, rounded to nearest.
    fn from_u32(x: u32) -> Self;
    /// Truncated and clamped to what both `i32` and `f32` hold; NaN is 0.
    fn to_i32(self) -> i32;
    /// Truncated and clamped to what both `u32` and `f32` hold; NaN is 0.
    fn to_u32(self) -> u32;

    fn lt(self, other: Self) -> bool;
    fn le(self, other: Self) -> bool;
    fn eq(self, other: Self) -> bool;

    fn add(self, other: Self) -> Self;
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    fn div(self, other: Self) -> Self;
    fn neg(self) -> Self;
    fn abs(self) -> Self;
    fn floor(self) -> Self;
    fn ceil(self) -> Self;
    fn round(self) -> Self;
    fn trunc(self) -> Self;
    fn sqrt(self) -> Self;

    fn exp2(self) -> Self;
    fn exp(self) -> Self;
    fn log2(self) -> Self;
    fn log(self) -> Self;
    fn sin(self) -> Self;
    fn cos(self) -> Self;
    fn tan(self) -> Self;
    fn asin(self) -> Self;
    fn acos(self) -> Self;
    fn atan(self) -> Self;
    fn sinh(self) -> Self;
    fn cosh(self) -> Self;
    fn tanh(self) -> Self;
    fn asinh(self) -> Self;
    fn acosh(self) -> Self;
    fn atanh(self) -> Self;

    /// The nearest number that half precision holds, ties to even; beyond 65504 it is infinite.
    fn quantize(self) -> Self;
    /// `self * 2^exponent`.
    fn ldexp(self, exponent: i32) -> Self;
    /// The fraction in 0.5..1 and the exponent; zero, infinity and NaN have themselves and 0.
    fn frexp(self) -> (Self, i32);

    #[inline(always)]
    fn is_nan(self) -> bool {
        !self.eq(self)
    }
    #[inline(always)]
    fn is_infinite(self) -> bool {
        self.abs().eq(Self::from_f32(f32::INFINITY))
    }
    /// The smaller; where one is NaN, the other; of equal ones the first.
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        if other.lt(self) | self.is_nan() {
            other
        } else {
            self
        }
    }
    /// The larger; where one is NaN, the other; of equal ones the first.
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self.lt(other) | self.is_nan() {
            other
        } else {
            self
        }
    }
    /// The remainder of truncated division.
    #[inline(always)]
    fn rem(self, other: Self) -> Self {
        self.sub(other.mul(self.div(other).trunc()))
    }
    /// `exp2(exponent * log2(self))`, as GPUs have it; 1 where the exponent is 0, NaN for negative bases.
    #[inline(always)]
    fn pow(self, exponent: Self) -> Self {
        let power = exponent.mul(self.log2()).exp2();
        if exponent.eq(Self::from_f32(0.0)) {
            Self::from_f32(1.0)
        } else {
            power
        }
    }
    /// The angle of the point (`x`, `self`). Both zero: 0 or pi by the sign of `x`.
    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        let zero = Self::from_f32(0.0);
        let one = Self::from_f32(1.0);
        let (small, large) = if x.abs().lt(self.abs()) {
            (x.abs(), self.abs())
        } else {
            (self.abs(), x.abs())
        };
        let ratio = small.div(large);
        let ratio = if large.eq(zero) { zero } else { ratio };
        let ratio = if small.is_infinite() { one } else { ratio };
        let angle = ratio.atan();
        let angle = if x.abs().lt(self.abs()) {
            Self::from_f32(std::f32::consts::FRAC_PI_2).sub(angle)
        } else {
            angle
        };
        let angle = if one.copy_sign(x).lt(zero) {
            Self::from_f32(std::f32::consts::PI).sub(angle)
        } else {
            angle
        };
        if self.is_nan() | x.is_nan() {
            Self::from_f32(f32::NAN)
        } else {
            angle.copy_sign(self)
        }
    }
    /// The magnitude of `self` with the sign of `sign`, that of zero included.
    #[inline(always)]
    fn copy_sign(self, sign: Self) -> Self {
        let zero = Self::from_f32(0.0);
        let negative = sign.lt(zero) | (sign.eq(zero) & Self::from_f32(1.0).div(sign).lt(zero));
        if negative {
            self.abs().neg()
        } else {
            self.abs()
        }
    }
    /// -1, 0 or 1; 0 for NaN.
    #[inline(always)]
    fn sign(self) -> Self {
        let zero = Self::from_f32(0.0);
        let positive = if zero.lt(self) {
            Self::from_f32(1.0)
        } else {
            zero
        };
        if self.lt(zero) {
            Self::from_f32(-1.0)
        } else {
            positive
        }
    }
    #[inline(always)]
    fn fract(self) -> Self {
        self.sub(self.floor())
    }
    #[inline(always)]
    fn inverse_sqrt(self) -> Self {
        Self::from_f32(1.0).div(self.sqrt())
    }
    /// `min(max(self, low), high)`.
    #[inline(always)]
    fn clamp(self, low: Self, high: Self) -> Self {
        self.max(low).min(high)
    }
    /// Clamped to 0..1; 0 for NaN.
    #[inline(always)]
    fn saturate(self) -> Self {
        self.clamp(Self::from_f32(0.0), Self::from_f32(1.0))
    }
    /// `self * (1 - t) + other * t`.
    #[inline(always)]
    fn mix(self, other: Self, t: Self) -> Self {
        let rest = Self::from_f32(1.0).sub(t);
        self.mul(rest).add(other.mul(t))
    }
    #[inline(always)]
    fn smooth_step(low: Self, high: Self, x: Self) -> Self {
        let t = x.sub(low).div(high.sub(low)).saturate();
        let slope = Self::from_f32(3.0).sub(Self::from_f32(2.0).mul(t));
        t.mul(t).mul(slope)
    }
    #[inline(always)]
    fn step(edge: Self, x: Self) -> Self {
        if edge.le(x) {
            Self::from_f32(1.0)
        } else {
            Self::from_f32(0.0)
        }
    }
}

/// `1.5 * 2^23`: added to a number below `2^22` it leaves the nearest integer in the low bits.
const ROUND_F32: f32 = 12_582_912.0;
/// The same for `f64`: `1.5 * 2^52`.
const ROUND_F64: f64 = 6_755_399_441_055_744.0;

/// `2^(n + f)` for an integer and a fraction in -0.5..0.5. Weighted error of the fit: 2.0e-9.
#[inline(always)]
fn exp2_of(n: i32, f: f32) -> f32 {
    let q = 0.000_153_533_62;
    let q = q * f + 0.001_339_887_4;
    let q = q * f + 0.009_618_437;
    let q = q * f + 0.055_503_324;
    let q = q * f + 0.240_226_48;
    let q = q * f + std::f32::consts::LN_2;
    // In two factors, since 2^n itself may be below the smallest normal number, or above the largest.
    let half = n >> 1;
    let rest = n.wrapping_sub(half);
    let scale = |n: i32| f32::from_bits((n.wrapping_add(127) as u32) << 23);
    (1.0 + f * q) * scale(half) * scale(rest)
}

/// Clamps, and leaves NaN alone.
#[inline(always)]
fn within(x: f32, low: f32, high: f32) -> f32 {
    let x = if x < low { low } else { x };
    if x > high { high } else { x }
}

/// Reduces an angle: its distance from the nearest multiple of pi/2, and which multiple (its low bits).
/// The reduction is exact to f32 for angles up to 2^20; beyond, the result stays in range.
#[inline(always)]
fn quadrant(x: f32) -> (f32, u32) {
    /// The upper 33 bits of pi/2, so that a product with an integer below 2^20 is exact.
    const HIGH: f64 = f64::from_bits(0x3FF9_21FB_5440_0000);
    const LOW: f64 = 6.077_100_506_506_192e-11;
    let x = f64::from(x);
    let shifted = x * std::f64::consts::FRAC_2_PI + ROUND_F64;
    let n = shifted - ROUND_F64;
    let r = ((x - n * HIGH) - n * LOW) as f32;
    (
        within(r, -0.785_398_25, 0.785_398_25),
        shifted.to_bits() as u32,
    )
}

/// The sine and cosine of an angle in -pi/4..pi/4. Weighted errors of the fits: 4.9e-12 and 9.5e-11.
#[inline(always)]
fn sine_cosine(r: f32) -> (f32, f32) {
    let y = r * r;
    let s = 2.718_308e-6;
    let s = s * y + -0.000_198_393_35;
    let s = s * y + 0.008_333_329;
    let s = s * y + -0.166_666_67;
    let c = 2.443_841_5e-5;
    let c = c * y + -0.001_388_736_8;
    let c = c * y + 0.041_666_646;
    (r + r * y * s, 1.0 - 0.5 * y + y * y * c)
}

/// The arc sine of a number in -0.5..0.5. Weighted error of the fit: 5.0e-9.
#[inline(always)]
fn asin_of(x: f32) -> f32 {
    let y = x * x;
    let q = 0.042_218_57;
    let q = q * y + 0.024_147_6;
    let q = q * y + 0.045_477_1;
    let q = q * y + 0.074_952_416;
    let q = q * y + 0.166_667_54;
    x + x * y * q
}

#[inline(always)]
fn negate_if(x: f32, condition: u32) -> f32 {
    f32::from_bits(x.to_bits() ^ ((condition & 1) << 31))
}

impl Real for f32 {
    #[inline(always)]
    fn from_f32(x: f32) -> Self {
        x
    }
    #[inline(always)]
    fn to_f32(self) -> f32 {
        self
    }
    #[inline(always)]
    fn from_i32(x: i32) -> Self {
        x as f32
    }
    #[inline(always)]
    fn from_u32(x: u32) -> Self {
        x as f32
    }
    #[inline(always)]
    fn to_i32(self) -> i32 {
        within(self, -2_147_483_600.0, 2_147_483_500.0) as i32
    }
    #[inline(always)]
    fn to_u32(self) -> u32 {
        within(self, 0.0, 4_294_967_000.0) as u32
    }

    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self < other
    }
    #[inline(always)]
    fn le(self, other: Self) -> bool {
        self <= other
    }
    #[inline(always)]
    fn eq(self, other: Self) -> bool {
        self == other
    }

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self + other
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self - other
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self * other
    }
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self / other
    }
    #[inline(always)]
    fn neg(self) -> Self {
        -self
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f32::abs(self)
    }
    #[inline(always)]
    fn floor(self) -> Self {
        f32::floor(self)
    }
    #[inline(always)]
    fn ceil(self) -> Self {
        f32::ceil(self)
    }
    #[inline(always)]
    fn round(self) -> Self {
        f32::round_ties_even(self)
    }
    #[inline(always)]
    fn trunc(self) -> Self {
        f32::trunc(self)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f32::sqrt(self)
    }

    /// Within 1.5 ulp. Exact for integers.
    #[inline(always)]
    fn exp2(self) -> Self {
        // Beyond these the result is 0 or infinite all the same.
        let x = within(self, -151.0, 129.0);
        let shifted = x + ROUND_F32;
        let n = shifted - ROUND_F32;
        let power = shifted.to_bits().wrapping_sub(ROUND_F32.to_bits()) as i32;
        exp2_of(power, x - n)
    }
    /// Within 2 ulp.
    #[inline(always)]
    fn exp(self) -> Self {
        /// The upper bits of ln 2, so that a product with an integer below 2^9 is exact.
        const HIGH: f32 = 0.693_359_4;
        const LOW: f32 = -0.000_212_194_44;
        let x = within(self, -105.0, 90.0);
        let shifted = x * std::f32::consts::LOG2_E + ROUND_F32;
        let n = shifted - ROUND_F32;
        let power = shifted.to_bits().wrapping_sub(ROUND_F32.to_bits()) as i32;
        exp2_of(power, ((x - n * HIGH) - n * LOW) * std::f32::consts::LOG2_E)
    }
    /// Within 2 ulp. Exact for powers of two. NaN for negative numbers.
    #[inline(always)]
    fn log2(self) -> Self {
        let subnormal = self < f32::MIN_POSITIVE;
        let x = if subnormal { self * 8_388_608.0 } else { self };
        let shift = if subnormal { -23.0 } else { 0.0 };
        // A mantissa in sqrt(1/2)..sqrt(2), so that numbers around 1 have exponent 0.
        let bits = x.to_bits();
        let exponent = (bits.wrapping_sub(0x3F35_04F3) as i32) >> 23;
        let r = f32::from_bits(bits.wrapping_sub((exponent as u32) << 23)) - 1.0;
        // Weighted error of the fit: 4.1e-9.
        let q = -0.109_949_54;
        let q = q * r + 0.186_174_94;
        let q = q * r + -0.191_062_75;
        let q = q * r + 0.204_600_62;
        let q = q * r + -0.239_617_4;
        let q = q * r + 0.288_567_4;
        let q = q * r + -0.360_696_65;
        let q = q * r + 0.480_898_23;
        let q = q * r + -0.721_347_33;
        let q = q * r + std::f32::consts::LOG2_E;
        let log = r * q + (exponent as f32 + shift);
        let log = if self < f32::INFINITY { log } else { self };
        let log = if self < 0.0 { f32::NAN } else { log };
        if self == 0.0 { f32::NEG_INFINITY } else { log }
    }
    /// Within 2.5 ulp. NaN for negative numbers.
    #[inline(always)]
    fn log(self) -> Self {
        Real::log2(self) * std::f32::consts::LN_2
    }
    /// Within 2 ulp for angles up to 2^20.
    #[inline(always)]
    fn sin(self) -> Self {
        let (r, n) = quadrant(self);
        let (sine, cosine) = sine_cosine(r);
        negate_if(if n & 1 == 0 { sine } else { cosine }, n >> 1)
    }
    /// Within 2 ulp for angles up to 2^20.
    #[inline(always)]
    fn cos(self) -> Self {
        let (r, n) = quadrant(self);
        let (sine, cosine) = sine_cosine(r);
        negate_if(
            if n & 1 == 0 { cosine } else { sine },
            n.wrapping_add(1) >> 1,
        )
    }
    /// Within 4 ulp for angles up to 2^20.
    #[inline(always)]
    fn tan(self) -> Self {
        let (r, n) = quadrant(self);
        let (sine, cosine) = sine_cosine(r);
        if n & 1 == 0 {
            sine / cosine
        } else {
            -cosine / sine
        }
    }
    /// Within 3 ulp. NaN outside -1..1.
    #[inline(always)]
    fn asin(self) -> Self {
        let x = f32::abs(self);
        let outer = asin_of(f32::sqrt((1.0 - x) * 0.5));
        let angle = if x > 0.5 {
            std::f32::consts::FRAC_PI_2 - 2.0 * outer
        } else {
            asin_of(x)
        };
        negate_if(angle, self.to_bits() >> 31)
    }
    /// Within 3 ulp. NaN outside -1..1.
    #[inline(always)]
    fn acos(self) -> Self {
        let x = f32::abs(self);
        let outer = 2.0 * asin_of(f32::sqrt((1.0 - x) * 0.5));
        if x <= 0.5 {
            std::f32::consts::FRAC_PI_2 - asin_of(self)
        } else if self > 0.0 {
            outer
        } else {
            std::f32::consts::PI - outer
        }
    }
    /// Within 3 ulp.
    #[inline(always)]
    fn atan(self) -> Self {
        let x = f32::abs(self);
        let t = if x > 1.0 { 1.0 / x } else { x };
        // Weighted error of the fit: 2.3e-9.
        let y = t * t;
        let q = -0.001_827_212_6;
        let q = q * y + 0.011_064_44;
        let q = q * y + -0.031_455_7;
        let q = q * y + 0.058_234_55;
        let q = q * y + -0.084_194_59;
        let q = q * y + 0.109_575_76;
        let q = q * y + -0.142_652_45;
        let q = q * y + 0.199_986_38;
        let q = q * y + -0.333_333_02;
        let angle = t + t * y * q;
        let angle = if x > 1.0 {
            std::f32::consts::FRAC_PI_2 - angle
        } else {
            angle
        };
        negate_if(angle, self.to_bits() >> 31)
    }
    #[inline(always)]
    fn sinh(self) -> Self {
        libm::sinhf(self)
    }
    #[inline(always)]
    fn cosh(self) -> Self {
        libm::coshf(self)
    }
    #[inline(always)]
    fn tanh(self) -> Self {
        libm::tanhf(self)
    }
    #[inline(always)]
    fn asinh(self) -> Self {
        libm::asinhf(self)
    }
    #[inline(always)]
    fn acosh(self) -> Self {
        libm::acoshf(self)
    }
    #[inline(always)]
    fn atanh(self) -> Self {
        libm::atanhf(self)
    }

    #[inline(always)]
    fn quantize(self) -> Self {
        words::half_to_float(words::float_to_half(self))
    }
    #[inline(always)]
    fn ldexp(self, exponent: i32) -> Self {
        // In three factors: from the smallest subnormal to the largest number there are 277 powers of two.
        let n = exponent.clamp(-300, 300);
        let first = n / 3;
        let rest = n - 2 * first;
        let scale = |n: i32| f32::from_bits(((n + 127) as u32) << 23);
        self * scale(first) * scale(first) * scale(rest)
    }
    #[inline(always)]
    fn frexp(self) -> (Self, i32) {
        let subnormal = f32::abs(self) < f32::MIN_POSITIVE;
        let x = if subnormal { self * 8_388_608.0 } else { self };
        let shift = if subnormal { -23 } else { 0 };
        let bits = x.to_bits();
        let exponent = ((bits >> 23) & 0xFF) as i32 - 126 + shift;
        let fraction = f32::from_bits((bits & 0x807F_FFFF) | 0x3F00_0000);
        if self == 0.0 || !self.is_finite() {
            (self, 0)
        } else {
            (fraction, exponent)
        }
    }
}
