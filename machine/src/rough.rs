//! Roundings that WGSL allows and that nobody has: every operation is off by chance, within its accuracy.
//!
//! What is off is told by the operation and its operands, so that the same computation has the same error in an original
//! and in a variant, as on a device.
//! The limits are those of WGSL's section on floating-point accuracy; an inherited one is that of its expression.

use crate::chance::{child, mix};
use crate::lane::{LANES, Mask};
use crate::machine::{Outcome, Watcher};
use lodc_passes::semantics::Op;

/// How a shader is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Arithmetic {
    /// Where its errors come from; nothing for the evaluator's own, which are smaller than WGSL's.
    pub errors: Option<u64>,
    /// Whether what is infinite or not a number stays so: no minimum passes over it. WGSL lets either be.
    pub strict: bool,
    /// Whether subnormal results are 0.
    pub flushes: bool,
}

impl Arithmetic {
    /// The evaluator's.
    pub const OWN: Self = Self {
        errors: None,
        strict: false,
        flushes: false,
    };

    /// Eight that WGSL allows.
    pub fn allowed(seed: u64) -> [Self; 8] {
        std::array::from_fn(|i| Self {
            errors: Some(child(seed, i as u64)),
            strict: i % 2 == 1,
            flushes: i / 2 % 2 == 1,
        })
    }
}

/// Makes every operation as inexact as it may be.
#[derive(Debug)]
pub struct Rough(pub Arithmetic);

impl Rough {
    /// Whether it changes nothing.
    pub fn is_plain(&self) -> bool {
        self.0 == Arithmetic::OWN
    }
}

/// How far an operation may be off.
enum Limit {
    /// Not at all.
    Exact,
    /// By one rounding of what this is exactly.
    Rounded(f64),
    /// By so many units in the last place, and by so much.
    Off(f64, f64),
}

#[inline(always)]
fn limit(op: Op, [a, b, c]: [f32; 3]) -> Limit {
    let [x, y, z] = [a, b, c].map(f64::from);
    match op {
        Op::Add => Limit::Rounded(x + y),
        Op::Sub => Limit::Rounded(x - y),
        Op::Mul => Limit::Rounded(x * y),
        Op::Fma => Limit::Rounded(x * y + z),
        Op::Fract => Limit::Rounded(x - x.floor()),
        Op::IntToFloat | Op::UintToFloat => Limit::Exact,
        Op::Div => Limit::Off(2.5, 0.0),
        // Of 1 - t and of the products beside the sum.
        Op::Mix => Limit::Off(1.0, (x.abs().max(y.abs()) * (1.0 + z.abs())) * EPSILON),
        Op::Rem => Limit::Off(1.0, x.abs() * 2.5 * EPSILON),
        Op::SmoothStep => Limit::Off(6.0, 0.0),
        Op::Sqrt => Limit::Off(4.5, 0.0),
        Op::InverseSqrt => Limit::Off(2.0, 0.0),
        Op::Exp | Op::Exp2 => Limit::Off(3.0 + 2.0 * x.abs(), 0.0),
        Op::Log | Op::Log2 => match (0.5..=2.0).contains(&x) {
            true => Limit::Off(0.0, 0.5_f64.powi(21)),
            false => Limit::Off(3.0, 0.0),
        },
        Op::Pow => {
            let exponent = y * x.log2();
            let of_log = match (0.5..=2.0).contains(&x) {
                true => y.abs() * 0.5_f64.powi(21) / EPSILON,
                false => 3.0 * exponent.abs(),
            };
            Limit::Off(3.0 + 2.0 * exponent.abs() + of_log, 0.0)
        }
        Op::Sin | Op::Cos => Limit::Off(0.0, 0.5_f64.powi(11)),
        Op::Tan => Limit::Off(4.0, 0.5_f64.powi(10) * (1.0 + x.tan().powi(2))),
        // The worse of that and of what `atan2` has.
        Op::Asin | Op::Acos => Limit::Off(4096.0, 6.77e-5),
        Op::Atan | Op::Atan2 => Limit::Off(4096.0, 0.0),
        Op::Sinh | Op::Cosh | Op::Tanh => Limit::Off(8.0 + 4.0 * x.abs().min(90.0), 0.0),
        Op::Asinh | Op::Acosh | Op::Atanh => Limit::Off(16.0, 0.5_f64.powi(21)),
        _ => Limit::Exact,
    }
}

/// One unit in the last place of 1.
const EPSILON: f64 = f32::EPSILON as f64;

impl Watcher<f32> for Rough {
    fn done(
        &mut self,
        op: Op,
        _: u32,
        lanes: Option<Mask>,
        operands: &[[f32; LANES]],
        outcome: Outcome<'_, f32>,
    ) {
        let Outcome::Floats(floats) = outcome else {
            return;
        };
        let count = if lanes.is_some() { LANES } else { 1 };
        let floats = &mut floats[..count];
        // What is done most often has a loop of its own, in which the operation is known.
        macro_rules! known {
            ($($name:ident)*) => {
                match op {
                    $(Op::$name => self.0.each(Op::$name, operands, floats),)*
                    other => self.0.each(other, operands, floats),
                }
            };
        }
        known!(Add Sub Mul Div Fma Mix Neg Abs Min Max Clamp Sqrt InverseSqrt SelectFloat);
    }
}

impl Arithmetic {
    /// The same of every lane.
    #[inline(always)]
    fn each(self, op: Op, operands: &[[f32; LANES]], floats: &mut [f32]) {
        const NONE: [f32; LANES] = [0.0; LANES];
        let [a, b, c] = [0, 1, 2].map(|place| operands.get(place).unwrap_or(&NONE));
        for (lane, result) in floats.iter_mut().enumerate() {
            *result = self.rough(op, [a[lane], b[lane], c[lane]], *result);
        }
    }

    /// What an operation may give, where it should be `result`.
    #[inline(always)]
    fn rough(self, op: Op, operands: [f32; 3], result: f32) -> f32 {
        let decides = matches!(op, Op::SelectFloat);
        if self.strict
            && !decides
            && (!result.is_finite() || operands.iter().any(|operand| operand.is_nan()))
        {
            return f32::NAN;
        }
        if !result.is_finite() {
            return result;
        }
        let Some(seed) = self.errors else {
            return result;
        };
        let noise = || {
            let bits = operands.map(|operand| u64::from(operand.to_bits()));
            let word = mix(seed ^ mix(op as u64 ^ bits[0] << 16) ^ mix(bits[1] << 32 | bits[2]));
            (word >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        };
        let off = match limit(op, operands) {
            Limit::Exact => result,
            Limit::Rounded(exact) => {
                let nearest = exact as f32;
                let other = match f64::from(nearest).total_cmp(&exact) {
                    _ if !nearest.is_finite() => nearest,
                    std::cmp::Ordering::Less => nearest.next_up(),
                    std::cmp::Ordering::Equal => nearest,
                    std::cmp::Ordering::Greater => nearest.next_down(),
                };
                if other == nearest || noise() < 0.0 {
                    nearest
                } else {
                    other
                }
            }
            Limit::Off(units, more) => {
                let own = f64::from(result);
                // An unbounded limit says nothing of 0, and no sign is lost.
                let share = (units * EPSILON).min(0.5);
                (own + noise() * (share * own.abs() + more)) as f32
            }
        };
        match off.is_subnormal() && self.flushes {
            true => 0.0_f32.copysign(off),
            false => off,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roundings_are_within_their_limits_and_not_all_the_same() {
        let all = Arithmetic::allowed(7);
        let three = all.map(|one| one.rough(Op::Div, [1.0, 3.0, 0.0], 1.0 / 3.0));
        let third = 1.0_f64 / 3.0;
        assert!(three.iter().any(|x| *x != three[0]));
        for x in three {
            assert!((f64::from(x) - third).abs() < 3.0 * EPSILON * third, "{x}");
        }
        for one in all {
            // What is exact stays exact.
            assert_eq!(one.rough(Op::Sub, [1.0, 1.0, 0.0], 0.0), 0.0);
            assert_eq!(one.rough(Op::Max, [0.3, 0.2, 0.0], 0.3), 0.3);
            // The same computation has the same error.
            let again = || one.rough(Op::Exp, [2.0, 0.0, 0.0], 7.389);
            assert_eq!(again(), again());
            let passed_over = one.rough(Op::Max, [f32::NAN, 0.0, 0.0], 0.0);
            assert_eq!(passed_over.is_nan(), one.strict);
            assert_eq!(one.rough(Op::Pow, [0.0, 5.0, 0.0], 0.0), 0.0);
            let small = one.rough(Op::Mul, [1e-20, 1e-20, 0.0], 1e-40);
            assert_eq!(small == 0.0, one.flushes);
        }
    }
}
