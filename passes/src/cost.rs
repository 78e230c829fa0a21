//! The static cost model: what each operation is worth, by class.
//!
//! Texture samples are kept apart from arithmetic. How often an operation is executed is not known
//! here: the evaluator counts that, and multiplies.

use std::ops::{Add, AddAssign, Mul};

/// Executed work, per shaded fragment (or vertex) once it has been divided by how many there were.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Work {
    /// Scalar operations at full rate: add, multiply, compare, select, convert.
    pub simple: f64,
    /// Scalar operations at quarter rate: division, square roots, exponentials, trigonometry.
    pub special: f64,
    /// Texture samples, loads and gathers.
    pub samples: f64,
}

/// Full-rate scalar operations that a quarter-rate one is worth.
pub const SPECIAL_WEIGHT: f64 = 4.0;
/// Full-rate scalar operations that a texture sample is worth: the figure of He, Foley, Tatarchuk and
/// Fatahalian 2015, section 5.
pub const SAMPLE_WEIGHT: f64 = 100.0;

impl Work {
    /// Arithmetic alone, in full-rate scalar operations.
    pub fn operations(&self) -> f64 {
        self.simple + SPECIAL_WEIGHT * self.special
    }

    /// All of it in one number, in full-rate scalar operations.
    pub fn total(&self) -> f64 {
        self.operations() + SAMPLE_WEIGHT * self.samples
    }
}

impl Add for Work {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            simple: self.simple + other.simple,
            special: self.special + other.special,
            samples: self.samples + other.samples,
        }
    }
}

impl AddAssign for Work {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Mul<f64> for Work {
    type Output = Self;
    fn mul(self, times: f64) -> Self {
        Self {
            simple: self.simple * times,
            special: self.special * times,
            samples: self.samples * times,
        }
    }
}
