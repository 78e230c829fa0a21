//! What lanes execute, by class: finer than [`lodc_passes::Work`], and as a driver compiles it. What nothing reads is
//! not in it, the same value is computed once, and what is the same for a whole draw is a class of its own.

use lodc_passes::cost::SPECIAL_WEIGHT;
use lodc_passes::semantics::{Kind, Op};
use std::ops::{Add, AddAssign, Index, IndexMut, Mul};

/// A class of what lanes execute.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Class {
    /// Scalar operations on floats at full rate: additions, multiplications, `min`, `floor`.
    Float,
    /// Scalar operations at full rate that read or make words: comparisons, selections, conversions, integers.
    Word,
    /// Divisions, those in remainders and in `smoothstep` among them.
    Division,
    /// Square roots and their inverses.
    Root,
    /// Exponentials and logarithms; a power is two.
    Exponential,
    /// Sines, cosines, and what inverts them; a tangent is three.
    Trigonometry,
    /// Differences of a scalar within quads.
    Derivative,
    /// Scalar operations on what is the same for a whole draw, in those at full rate.
    Uniform,
    /// Branches that are not the same for a whole draw, and rounds of loops.
    Branch,
    /// Texture samples, gathers and loads.
    Sample,
    /// Texels that they read: 4 of a filtered image, twice as many between MIP levels.
    Texel,
    /// MIP levels that are chosen by the differences of coordinates within quads, or by given gradients.
    Level,
    /// Samples with given gradients.
    Gradient,
    /// Faces of cubes that are chosen.
    Cube,
}

impl Class {
    /// All of them.
    pub const ALL: [Self; 14] = [
        Self::Float,
        Self::Word,
        Self::Division,
        Self::Root,
        Self::Exponential,
        Self::Trigonometry,
        Self::Derivative,
        Self::Uniform,
        Self::Branch,
        Self::Sample,
        Self::Texel,
        Self::Level,
        Self::Gradient,
        Self::Cube,
    ];

    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Float => "float",
            Self::Word => "word",
            Self::Division => "division",
            Self::Root => "root",
            Self::Exponential => "exponential",
            Self::Trigonometry => "trigonometry",
            Self::Derivative => "derivative",
            Self::Uniform => "uniform",
            Self::Branch => "branch",
            Self::Sample => "sample",
            Self::Texel => "texel",
            Self::Level => "level",
            Self::Gradient => "gradient",
            Self::Cube => "cube",
        }
    }
}

/// How much is executed of each class.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mix([f64; Class::ALL.len()]);

impl Mix {
    /// Arithmetic in full-rate scalar operations, by the static weights: what is special counts four times.
    pub fn operations(&self) -> f64 {
        let special = [
            Class::Division,
            Class::Root,
            Class::Exponential,
            Class::Trigonometry,
        ];
        let simple = [
            Class::Float,
            Class::Word,
            Class::Derivative,
            Class::Uniform,
            Class::Branch,
        ];
        let sum = |classes: &[Class]| classes.iter().map(|class| self[*class]).sum::<f64>();
        sum(&simple) + SPECIAL_WEIGHT * sum(&special)
    }

    /// Counts a scalar operation, whose result differs from lane to lane or is uniform.
    pub(crate) fn count(&mut self, op: Op, uniform: bool) {
        let (simple, special) = op.cost();
        let (simple, special) = (f64::from(simple), f64::from(special));
        if uniform {
            self[Class::Uniform] += simple + SPECIAL_WEIGHT * special;
            return;
        }
        let (operands, result) = op.signature();
        let words = result == Kind::W || operands.contains(&Kind::W);
        self[if words { Class::Word } else { Class::Float }] += simple;
        if special > 0.0 {
            self[of_special(op)] += special;
        }
    }
}

/// The class of what is at quarter rate in an operation.
fn of_special(op: Op) -> Class {
    match op {
        Op::Sqrt | Op::InverseSqrt => Class::Root,
        Op::Exp
        | Op::Exp2
        | Op::Log
        | Op::Log2
        | Op::Pow
        | Op::Sinh
        | Op::Cosh
        | Op::Tanh
        | Op::Asinh
        | Op::Acosh
        | Op::Atanh => Class::Exponential,
        Op::Sin | Op::Cos | Op::Tan | Op::Asin | Op::Acos | Op::Atan | Op::Atan2 => {
            Class::Trigonometry
        }
        _ => Class::Division,
    }
}

impl Index<Class> for Mix {
    type Output = f64;
    fn index(&self, class: Class) -> &f64 {
        &self.0[class as usize]
    }
}

impl IndexMut<Class> for Mix {
    fn index_mut(&mut self, class: Class) -> &mut f64 {
        &mut self.0[class as usize]
    }
}

impl Add for Mix {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + other.0[i]))
    }
}

impl AddAssign for Mix {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Mul<f64> for Mix {
    type Output = Self;
    fn mul(self, times: f64) -> Self {
        Self(self.0.map(|count| count * times))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn classes_are_in_the_order_of_their_list() {
        for (place, class) in Class::ALL.into_iter().enumerate() {
            assert_eq!(class as usize, place, "{class:?}");
        }
    }

    #[test]
    fn an_operation_counts_as_much_as_its_static_cost() {
        for op in Op::ALL {
            let (simple, special) = op.cost();
            for uniform in [false, true] {
                let mut mix = Mix::default();
                mix.count(*op, uniform);
                let cost = f64::from(simple) + SPECIAL_WEIGHT * f64::from(special);
                assert_eq!(mix.operations(), cost, "{op:?}");
                assert_eq!(
                    mix[Class::Uniform] == cost,
                    uniform || cost == 0.0,
                    "{op:?}"
                );
            }
        }
    }
}
