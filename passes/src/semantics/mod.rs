//! What each operation means: the one table that constant folding and every lane type of the
//! evaluator use, so that they agree to the bit.
//!
//! Three layers. [`Op`] is a scalar operation on floats ([`Real`]) and 32-bit words; the table
//! [`scalar_operations!`](crate::scalar_operations) states its operands, its cost and its meaning.
//! [`expand`] says how a shader's operation on scalars, vectors and matrices is made of scalar ones,
//! in a stated order. [`fold`] does both at once, for constants.
//!
//! The semantics are WGSL's, with what it leaves open decided: integers wrap, shifts take the low five
//! bits of their amount, division by zero gives the dividend and remainder 0, `%` truncates,
//! conversions to integers saturate, `min` and `max` pass over NaN, `round` goes to even, `pow` is
//! `exp2(y * log2(x))`, subnormal numbers are kept, nothing is fused (`fma` neither), and the bits of
//! a NaN are always the same where they can be seen.

mod expand;
mod real;
pub mod words;

pub use expand::{Operation, Scalars, Shape, expand};
pub use real::Real;

use naga::{Literal, ScalarKind};

/// What an operand or a result of a scalar operation is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A float of the lane type.
    F,
    /// A 32-bit word: an integer of either sign, or a bool as 0 or 1.
    W,
}

/// The table of scalar operations: hands each to the macro `$with`, as
/// `documentation, name(operand: kind, ...) -> kind, simple, special, meaning;`, where the two numbers
/// are its cost in full-rate and quarter-rate operations (see [`crate::cost`]), and the meaning is an
/// expression over the operands: floats `F` of some [`Real`] type, and words `W` as `u32`.
#[macro_export]
macro_rules! scalar_operations {
    ($with:ident) => {
        $with! {
            /// `a + b`.
            Add(a: F, b: F) -> F, 1, 0, $crate::semantics::Real::add(a, b);
            /// `a - b`.
            Sub(a: F, b: F) -> F, 1, 0, $crate::semantics::Real::sub(a, b);
            /// `a * b`.
            Mul(a: F, b: F) -> F, 1, 0, $crate::semantics::Real::mul(a, b);
            /// `a / b`.
            Div(a: F, b: F) -> F, 0, 1, $crate::semantics::Real::div(a, b);
            /// `a - b * trunc(a / b)`.
            Rem(a: F, b: F) -> F, 3, 1, $crate::semantics::Real::rem(a, b);
            /// `-a`.
            Neg(a: F) -> F, 1, 0, $crate::semantics::Real::neg(a);
            /// `abs(a)`.
            Abs(a: F) -> F, 1, 0, $crate::semantics::Real::abs(a);
            /// `sign(a)`.
            Sign(a: F) -> F, 2, 0, $crate::semantics::Real::sign(a);
            /// `min(a, b)`.
            Min(a: F, b: F) -> F, 1, 0, $crate::semantics::Real::min(a, b);
            /// `max(a, b)`.
            Max(a: F, b: F) -> F, 1, 0, $crate::semantics::Real::max(a, b);
            /// `clamp(a, low, high)`.
            Clamp(a: F, low: F, high: F) -> F, 2, 0, $crate::semantics::Real::clamp(a, low, high);
            /// `saturate(a)`.
            Saturate(a: F) -> F, 1, 0, $crate::semantics::Real::saturate(a);
            /// `floor(a)`.
            Floor(a: F) -> F, 1, 0, $crate::semantics::Real::floor(a);
            /// `ceil(a)`.
            Ceil(a: F) -> F, 1, 0, $crate::semantics::Real::ceil(a);
            /// `round(a)`.
            Round(a: F) -> F, 1, 0, $crate::semantics::Real::round(a);
            /// `trunc(a)`.
            Trunc(a: F) -> F, 1, 0, $crate::semantics::Real::trunc(a);
            /// `fract(a)`.
            Fract(a: F) -> F, 1, 0, $crate::semantics::Real::fract(a);
            /// `mix(a, b, t)`.
            Mix(a: F, b: F, t: F) -> F, 4, 0, $crate::semantics::Real::mix(a, b, t);
            /// `step(edge, a)`.
            Step(edge: F, a: F) -> F, 1, 0, $crate::semantics::Real::step(edge, a);
            /// `smoothstep(low, high, a)`.
            SmoothStep(low: F, high: F, a: F) -> F, 7, 1,
                $crate::semantics::Real::smooth_step(low, high, a);
            /// `fma(a, b, c)`, rounded twice.
            Fma(a: F, b: F, c: F) -> F, 2, 0,
                $crate::semantics::Real::add($crate::semantics::Real::mul(a, b), c);
            /// `sqrt(a)`.
            Sqrt(a: F) -> F, 0, 1, $crate::semantics::Real::sqrt(a);
            /// `inverseSqrt(a)`.
            InverseSqrt(a: F) -> F, 0, 1, $crate::semantics::Real::inverse_sqrt(a);
            /// `exp(a)`.
            Exp(a: F) -> F, 1, 1, $crate::semantics::Real::exp(a);
            /// `exp2(a)`.
            Exp2(a: F) -> F, 0, 1, $crate::semantics::Real::exp2(a);
            /// `log(a)`.
            Log(a: F) -> F, 1, 1, $crate::semantics::Real::log(a);
            /// `log2(a)`.
            Log2(a: F) -> F, 0, 1, $crate::semantics::Real::log2(a);
            /// `pow(a, b)`.
            Pow(a: F, b: F) -> F, 1, 2, $crate::semantics::Real::pow(a, b);
            /// `sin(a)`.
            Sin(a: F) -> F, 0, 1, $crate::semantics::Real::sin(a);
            /// `cos(a)`.
            Cos(a: F) -> F, 0, 1, $crate::semantics::Real::cos(a);
            /// `tan(a)`.
            Tan(a: F) -> F, 0, 3, $crate::semantics::Real::tan(a);
            /// `asin(a)`.
            Asin(a: F) -> F, 8, 1, $crate::semantics::Real::asin(a);
            /// `acos(a)`.
            Acos(a: F) -> F, 8, 1, $crate::semantics::Real::acos(a);
            /// `atan(a)`.
            Atan(a: F) -> F, 10, 1, $crate::semantics::Real::atan(a);
            /// `atan2(a, b)`.
            Atan2(a: F, b: F) -> F, 14, 1, $crate::semantics::Real::atan2(a, b);
            /// `sinh(a)`.
            Sinh(a: F) -> F, 4, 2, $crate::semantics::Real::sinh(a);
            /// `cosh(a)`.
            Cosh(a: F) -> F, 4, 2, $crate::semantics::Real::cosh(a);
            /// `tanh(a)`.
            Tanh(a: F) -> F, 4, 2, $crate::semantics::Real::tanh(a);
            /// `asinh(a)`.
            Asinh(a: F) -> F, 4, 2, $crate::semantics::Real::asinh(a);
            /// `acosh(a)`.
            Acosh(a: F) -> F, 4, 2, $crate::semantics::Real::acosh(a);
            /// `atanh(a)`.
            Atanh(a: F) -> F, 4, 2, $crate::semantics::Real::atanh(a);
            /// `quantizeToF16(a)`.
            Quantize(a: F) -> F, 1, 0, $crate::semantics::Real::quantize(a);
            /// `ldexp(a, exponent)`.
            Ldexp(a: F, exponent: W) -> F, 1, 0,
                $crate::semantics::Real::ldexp(a, exponent as i32);
            /// The fraction of `frexp(a)`.
            FrexpFraction(a: F) -> F, 1, 0, $crate::semantics::Real::frexp(a).0;
            /// The exponent of `frexp(a)`.
            FrexpExponent(a: F) -> W, 1, 0, $crate::semantics::Real::frexp(a).1 as u32;
            /// `a == b`.
            Equal(a: F, b: F) -> W, 1, 0, u32::from($crate::semantics::Real::eq(a, b));
            /// `a != b`.
            NotEqual(a: F, b: F) -> W, 1, 0, u32::from(!$crate::semantics::Real::eq(a, b));
            /// `a < b`.
            Less(a: F, b: F) -> W, 1, 0, u32::from($crate::semantics::Real::lt(a, b));
            /// `a <= b`.
            LessEqual(a: F, b: F) -> W, 1, 0, u32::from($crate::semantics::Real::le(a, b));
            /// Whether it is not a number.
            IsNan(a: F) -> W, 1, 0, u32::from($crate::semantics::Real::is_nan(a));
            /// Whether it is infinite.
            IsInf(a: F) -> W, 1, 0, u32::from($crate::semantics::Real::is_infinite(a));
            /// `accept` where the condition is 1, else `reject`.
            SelectFloat(condition: W, accept: F, reject: F) -> F, 1, 0,
                if condition != 0 { accept } else { reject };
            /// `i32(a)`.
            FloatToInt(a: F) -> W, 1, 0, $crate::semantics::Real::to_i32(a) as u32;
            /// `u32(a)`.
            FloatToUint(a: F) -> W, 1, 0, $crate::semantics::Real::to_u32(a);
            /// `f32(a)` of a signed integer.
            IntToFloat(a: W) -> F, 1, 0, $crate::semantics::Real::from_i32(a as i32);
            /// `f32(a)` of an unsigned integer or a bool.
            UintToFloat(a: W) -> F, 1, 0, $crate::semantics::Real::from_u32(a);
            /// The bits of a float as a word.
            FloatToBits(a: F) -> W, 0, 0,
                $crate::semantics::words::bits($crate::semantics::Real::to_f32(a));
            /// A word as the bits of a float.
            BitsToFloat(a: W) -> F, 0, 0, $crate::semantics::Real::from_f32(f32::from_bits(a));
            /// Half precision in the low 16 bits.
            FloatToHalf(a: F) -> W, 1, 0,
                $crate::semantics::words::float_to_half($crate::semantics::Real::to_f32(a));
            /// The low 16 bits as half precision.
            HalfToFloat(a: W) -> F, 1, 0,
                $crate::semantics::Real::from_f32($crate::semantics::words::half_to_float(a));
            /// A number in -1..1 as an integer in `-scale..=scale`.
            SignedNorm(a: F, scale: F) -> W, 3, 0,
                $crate::semantics::words::signed_norm(
                    $crate::semantics::Real::to_f32(a),
                    $crate::semantics::Real::to_f32(scale),
                );
            /// A number in 0..1 as an integer in `0..=scale`.
            UnsignedNorm(a: F, scale: F) -> W, 3, 0,
                $crate::semantics::words::unsigned_norm(
                    $crate::semantics::Real::to_f32(a),
                    $crate::semantics::Real::to_f32(scale),
                );

            /// `a + b` of integers.
            AddWord(a: W, b: W) -> W, 1, 0, a.wrapping_add(b);
            /// `a - b` of integers.
            SubWord(a: W, b: W) -> W, 1, 0, a.wrapping_sub(b);
            /// `a * b` of integers.
            MulWord(a: W, b: W) -> W, 1, 0, a.wrapping_mul(b);
            /// `a / b` of signed integers.
            DivInt(a: W, b: W) -> W, 10, 1, $crate::semantics::words::divide_signed(a, b);
            /// `a / b` of unsigned integers.
            DivUint(a: W, b: W) -> W, 10, 1, $crate::semantics::words::divide_unsigned(a, b);
            /// `a % b` of signed integers.
            RemInt(a: W, b: W) -> W, 10, 1, $crate::semantics::words::remainder_signed(a, b);
            /// `a % b` of unsigned integers.
            RemUint(a: W, b: W) -> W, 10, 1, $crate::semantics::words::remainder_unsigned(a, b);
            /// `-a` of an integer.
            NegWord(a: W) -> W, 1, 0, a.wrapping_neg();
            /// `abs(a)` of a signed integer.
            AbsInt(a: W) -> W, 1, 0, (a as i32).wrapping_abs() as u32;
            /// `sign(a)` of a signed integer.
            SignInt(a: W) -> W, 1, 0, (a as i32).signum() as u32;
            /// `min(a, b)` of signed integers.
            MinInt(a: W, b: W) -> W, 1, 0, Ord::min(a as i32, b as i32) as u32;
            /// `max(a, b)` of signed integers.
            MaxInt(a: W, b: W) -> W, 1, 0, Ord::max(a as i32, b as i32) as u32;
            /// `min(a, b)` of unsigned integers.
            MinUint(a: W, b: W) -> W, 1, 0, Ord::min(a, b);
            /// `max(a, b)` of unsigned integers.
            MaxUint(a: W, b: W) -> W, 1, 0, Ord::max(a, b);
            /// `a & b`.
            And(a: W, b: W) -> W, 1, 0, a & b;
            /// `a | b`.
            Or(a: W, b: W) -> W, 1, 0, a | b;
            /// `a ^ b`.
            Xor(a: W, b: W) -> W, 1, 0, a ^ b;
            /// `~a`.
            Not(a: W) -> W, 1, 0, !a;
            /// `a << b`.
            ShiftLeft(a: W, b: W) -> W, 1, 0, a << (b & 31);
            /// `a >> b` of a signed integer.
            ShiftRightInt(a: W, b: W) -> W, 1, 0, ((a as i32) >> (b & 31)) as u32;
            /// `a >> b` of an unsigned integer.
            ShiftRightUint(a: W, b: W) -> W, 1, 0, a >> (b & 31);
            /// `a == b` of words.
            EqualWord(a: W, b: W) -> W, 1, 0, u32::from(a == b);
            /// `a != b` of words.
            NotEqualWord(a: W, b: W) -> W, 1, 0, u32::from(a != b);
            /// `a < b` of signed integers.
            LessInt(a: W, b: W) -> W, 1, 0, u32::from((a as i32) < (b as i32));
            /// `a <= b` of signed integers.
            LessEqualInt(a: W, b: W) -> W, 1, 0, u32::from((a as i32) <= (b as i32));
            /// `a < b` of unsigned integers.
            LessUint(a: W, b: W) -> W, 1, 0, u32::from(a < b);
            /// `a <= b` of unsigned integers.
            LessEqualUint(a: W, b: W) -> W, 1, 0, u32::from(a <= b);
            /// `accept` where the condition is 1, else `reject`, of words.
            SelectWord(condition: W, accept: W, reject: W) -> W, 1, 0,
                if condition != 0 { accept } else { reject };
            /// `countOneBits(a)`.
            CountOnes(a: W) -> W, 1, 0, a.count_ones();
            /// `countLeadingZeros(a)`.
            CountLeadingZeros(a: W) -> W, 1, 0, a.leading_zeros();
            /// `countTrailingZeros(a)`.
            CountTrailingZeros(a: W) -> W, 1, 0, a.trailing_zeros();
            /// `reverseBits(a)`.
            ReverseBits(a: W) -> W, 1, 0, a.reverse_bits();
            /// `firstTrailingBit(a)`.
            FirstTrailingBit(a: W) -> W, 1, 0, $crate::semantics::words::first_trailing_bit(a);
            /// `firstLeadingBit(a)` of an unsigned integer.
            FirstLeadingBit(a: W) -> W, 1, 0, $crate::semantics::words::first_leading_bit(a);
            /// `firstLeadingBit(a)` of a signed integer.
            FirstLeadingBitInt(a: W) -> W, 1, 0,
                $crate::semantics::words::first_leading_bit_signed(a);
            /// `extractBits(a, offset, count)` of an unsigned integer.
            Extract(a: W, offset: W, count: W) -> W, 1, 0,
                $crate::semantics::words::extract(a, offset, count);
            /// `extractBits(a, offset, count)` of a signed integer.
            ExtractInt(a: W, offset: W, count: W) -> W, 1, 0,
                $crate::semantics::words::extract_signed(a, offset, count);
            /// Ones in the `count` bits from `offset` up, zeros elsewhere.
            Field(offset: W, count: W) -> W, 1, 0, $crate::semantics::words::field(offset, count);
        }
    };
}

macro_rules! define {
    ($(
        $(#[$doc:meta])*
        $name:ident($($operand:ident: $kind:ident),*) -> $result:ident,
        $simple:literal, $special:literal, $meaning:expr;
    )*) => {
        /// A scalar operation: a row of the table.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(u8)]
        pub enum Op {
            $($(#[$doc])* $name,)*
        }

        impl Op {
            /// Every operation, in the order of the table.
            pub const ALL: &'static [Self] = &[$(Self::$name),*];

            /// The kinds of its operands and of its result.
            pub fn signature(self) -> (&'static [Kind], Kind) {
                match self {
                    $(Self::$name => (&[$(Kind::$kind),*], Kind::$result),)*
                }
            }

            /// Its cost: full-rate and quarter-rate operations.
            pub fn cost(self) -> (u32, u32) {
                match self {
                    $(Self::$name => ($simple, $special),)*
                }
            }
        }

        /// The value of an operation on `f32`s and words, all given and returned as bits.
        ///
        /// # Panics
        /// When there are fewer operands than the operation has.
        pub fn evaluate(op: Op, operands: &[u32]) -> u32 {
            match op {
                $(Op::$name => {
                    let mut at = 0;
                    $(
                        let $operand = from_bits!($kind, operands[at]);
                        at += 1;
                    )*
                    debug_assert_eq!(at, operands.len());
                    let result = from_result!($result, $meaning);
                    result
                })*
            }
        }
    };
}
macro_rules! from_bits {
    (F, $bits:expr) => {
        f32::from_bits($bits)
    };
    (W, $bits:expr) => {
        $bits
    };
}
macro_rules! from_result {
    (F, $value:expr) => {
        words::bits($value)
    };
    (W, $value:expr) => {
        $value
    };
}
scalar_operations!(define);

/// A constant scalar, vector or matrix.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Constant {
    /// What it is.
    pub shape: Shape,
    /// The bits of its components, column by column; a bool is 0 or 1.
    pub words: Vec<u32>,
}

impl Constant {
    /// The constant that a literal states; nothing for one that is not `f32`, `i32`, `u32` or `bool`.
    pub fn from_literal(literal: Literal) -> Option<Self> {
        let (kind, word) = match literal {
            Literal::F32(x) => (ScalarKind::Float, words::bits(x)),
            Literal::I32(x) => (ScalarKind::Sint, x as u32),
            Literal::U32(x) => (ScalarKind::Uint, x),
            Literal::Bool(x) => (ScalarKind::Bool, u32::from(x)),
            _ => return None,
        };
        Some(Self {
            shape: Shape::Scalar(kind),
            words: vec![word],
        })
    }

    /// Its components as literals; nothing when one is infinite or not a number, which no literal may be.
    pub fn literals(&self) -> Option<Vec<Literal>> {
        let kind = self.shape.kind();
        self.words
            .iter()
            .map(|&word| match kind {
                ScalarKind::Float => {
                    let x = f32::from_bits(word);
                    x.is_finite().then_some(Literal::F32(x))
                }
                ScalarKind::Sint => Some(Literal::I32(word as i32)),
                ScalarKind::Uint => Some(Literal::U32(word)),
                ScalarKind::Bool => Some(Literal::Bool(word != 0)),
                ScalarKind::AbstractInt | ScalarKind::AbstractFloat => None,
            })
            .collect()
    }
}

/// The value of an operation on constants. Nothing when the operation is not one of [`expand`]'s, or
/// its result is a structure (`modf`, `frexp`), or is infinite or not a number.
///
/// `fold(Operation::of(&expression)?.0, &[...])`, with an operand for each of the expression's.
pub fn fold(operation: Operation, operands: &[Constant]) -> Option<Constant> {
    struct Now;
    impl Scalars for Now {
        type Value = u32;
        fn word(&mut self, bits: u32) -> u32 {
            bits
        }
        fn float(&mut self, x: f32) -> u32 {
            x.to_bits()
        }
        fn apply(&mut self, op: Op, operands: &[u32]) -> u32 {
            evaluate(op, operands)
        }
    }
    let shapes: Vec<Shape> = operands.iter().map(|c| c.shape).collect();
    let shape = operation.result(&shapes)?;
    let pairs: Vec<(Shape, &[u32])> = operands.iter().map(|c| (c.shape, &c.words[..])).collect();
    let words = expand(&mut Now, operation, &pairs)?;
    let folded = Constant { shape, words };
    folded.literals().is_some().then_some(folded)
}

#[cfg(test)]
mod tests;
