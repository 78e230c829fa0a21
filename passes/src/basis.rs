//! Functions of a texture's coordinates of which a smooth texture is nearly a sum.
//!
//! Two kinds are products of powers of variables within -1..1. Of a texture of two dimensions these are `2 u - 1` and
//! `2 v - 1`. Of a cube map they are the components of the direction's unit vector: the spherical harmonics up to a
//! band are sums of such products up to a degree, and as x^2 + y^2 + z^2 = 1 those with z^2 are not needed. The third kind
//! has lights beside the first band: lobes `exp(dot(direction, a) - |a|)` about the vector `a`, which is 1 towards it and
//! the narrower the longer `a` is (a spherical Gaussian; Wang, Ren, Gong, Snyder, Guo, "All-Frequency Rendering of Dynamic,
//! Spatially-Varying Reflectance", 2009).

use crate::edit::Edit;
use naga::{BinaryOperator, Expression, Handle, MathFunction};
use std::fmt;

/// The largest degree that there is.
const MOST: u32 = 3;

/// The most lights that there are.
pub const MOST_LIGHTS: u32 = 4;

/// What a light is in, as it is baked: the direction that it is in, as long as it is narrow.
pub type Lobe = [f32; 3];

/// A set of functions of a texture's coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Basis {
    /// Polynomials up to this degree, 1..=3, of two coordinates of 0..1.
    Polynomial(u32),
    /// Spherical harmonics up to this band, 1..=3, of a direction.
    Harmonics(u32),
    /// Spherical harmonics up to the first band and so many lights, 1..=4, of a direction.
    Lights(u32),
}

impl fmt::Display for Basis {
    /// As a candidate has it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.word(), self.degree())
    }
}

impl Basis {
    /// The one of these words, when there is such a one.
    pub fn parse(word: &str, degree: &str) -> Option<Self> {
        let degree = degree.parse().ok()?;
        [
            Self::Polynomial(degree),
            Self::Harmonics(degree),
            Self::Lights(degree),
        ]
        .into_iter()
        .find(|basis| basis.word() == word && (1..=basis.most()).contains(&degree))
    }

    fn word(self) -> &'static str {
        match self {
            Self::Polynomial(_) => "polynomial",
            Self::Harmonics(_) => "harmonics",
            Self::Lights(_) => "lights",
        }
    }

    /// The most that may stand behind its word.
    fn most(self) -> u32 {
        match self {
            Self::Polynomial(_) | Self::Harmonics(_) => MOST,
            Self::Lights(_) => MOST_LIGHTS,
        }
    }

    fn degree(self) -> u32 {
        match self {
            Self::Polynomial(degree) | Self::Harmonics(degree) | Self::Lights(degree) => {
                degree.min(self.most())
            }
        }
    }

    /// How many lights it has.
    pub fn lights(self) -> usize {
        match self {
            Self::Lights(_) => self.degree() as usize,
            Self::Polynomial(_) | Self::Harmonics(_) => 0,
        }
    }

    /// About what a sum of it costs in full-rate operations, of so many components.
    pub(crate) fn work(self, components: usize) -> f64 {
        let exponents = self.exponents();
        let products = exponents.iter().filter(|e| e.iter().sum::<u32>() > 1);
        // A dot product, a subtraction and an exponential function for each light.
        let functions = products.count() + 10 * self.lights();
        // A place, terms, and what is not below 0.
        (12 + functions + (2 * self.count() - 1) * components) as f64
    }

    /// How many coordinates it is of.
    pub(crate) fn coordinates(self) -> usize {
        match self {
            Self::Polynomial(_) => 2,
            Self::Harmonics(_) | Self::Lights(_) => 3,
        }
    }

    /// How many functions it has, the constant one included.
    pub fn count(self) -> usize {
        self.exponents().len() + self.lights()
    }

    /// The exponents of each function that is a product, by degree, the constant one first; lights come behind them.
    fn exponents(self) -> Vec<[u32; 3]> {
        let highest_z = match self {
            Self::Polynomial(_) => 0,
            Self::Harmonics(_) | Self::Lights(_) => 1,
        };
        let highest = match self {
            Self::Lights(_) => 1,
            Self::Polynomial(_) | Self::Harmonics(_) => self.degree(),
        };
        let of_degree = |degree: u32| {
            (0..=degree).rev().flat_map(move |x| {
                (0..=degree - x)
                    .rev()
                    .map(move |y| [x, y, degree - x - y])
                    .filter(move |[_, _, z]| *z <= highest_z)
            })
        };
        (0..=highest).flat_map(of_degree).collect()
    }

    /// What each function is at coordinates, of which a basis of two leaves out the third; with a lobe for each light.
    pub fn values(self, coordinates: [f64; 3], lobes: &[Lobe]) -> Vec<f64> {
        let variables = match self {
            Self::Polynomial(_) => coordinates.map(|c| 2.0 * c - 1.0),
            Self::Harmonics(_) | Self::Lights(_) => {
                let length = coordinates.iter().map(|c| c * c).sum::<f64>().sqrt();
                coordinates.map(|c| c / length)
            }
        };
        let exponents = self.exponents().into_iter();
        let products = exponents.map(|exponents| {
            let powers = variables.iter().zip(exponents);
            powers
                .flat_map(|(variable, times)| (0..times).map(move |_| *variable))
                .product()
        });
        let lobes = lobes.iter().take(self.lights());
        products
            .chain(lobes.map(|lobe| lobe_at(*lobe, variables)))
            .collect()
    }

    /// Adds the values that are the functions at coordinates, but for the constant one. `path` names them.
    pub(crate) fn write(
        self,
        edit: &mut Edit,
        path: &str,
        coordinates: Handle<Expression>,
        lobes: &[Lobe],
    ) -> Vec<Handle<Expression>> {
        let place = match self {
            Self::Polynomial(_) => {
                let by = |edit: &mut Edit, op, left, number: f32| {
                    let right = edit.add_numbers(path, &[number; 2]);
                    let expression = Expression::Binary { op, left, right };
                    edit.add(format!("{path}.place"), expression)
                };
                let doubled = by(edit, BinaryOperator::Multiply, coordinates, 2.0);
                by(edit, BinaryOperator::Subtract, doubled, 1.0)
            }
            Self::Harmonics(_) | Self::Lights(_) => {
                let normalize = Expression::Math {
                    fun: MathFunction::Normalize,
                    arg: coordinates,
                    arg1: None,
                    arg2: None,
                    arg3: None,
                };
                edit.add(format!("{path}.direction"), normalize)
            }
        };
        let variables: Vec<_> = (0..self.coordinates() as u32)
            .map(|index| {
                let part = Expression::AccessIndex { base: place, index };
                edit.add(format!("{path}.{}", ["x", "y", "z"][index as usize]), part)
            })
            .collect();
        let exponents = self.exponents();
        let mut written: Vec<Handle<Expression>> = Vec::new();
        for (i, function) in exponents.iter().enumerate().skip(1) {
            // A product of one of lower degree, which is there already, and one variable more.
            let variable = (0..3).find(|v| function[*v] > 0).unwrap_or(0);
            let mut rest = *function;
            rest[variable] -= 1;
            let lower = exponents[..i].iter().position(|lower| *lower == rest);
            let value = match lower {
                Some(at @ 1..) => {
                    let product = Expression::Binary {
                        op: BinaryOperator::Multiply,
                        left: written[at - 1],
                        right: variables[variable],
                    };
                    edit.add(format!("{path}.product"), product)
                }
                _ => variables[variable],
            };
            written.push(value);
        }
        for lobe in lobes.iter().take(self.lights()) {
            let math = |fun, arg, arg1| Expression::Math {
                fun,
                arg,
                arg1,
                arg2: None,
                arg3: None,
            };
            let towards = edit.add_numbers(path, lobe);
            let along = math(MathFunction::Dot, place, Some(towards));
            let left = edit.add(format!("{path}.along"), along);
            let right = edit.add_numbers(path, &[length(*lobe) as f32]);
            let below = Expression::Binary {
                op: BinaryOperator::Subtract,
                left,
                right,
            };
            let below = edit.add(format!("{path}.below"), below);
            written.push(edit.add(
                format!("{path}.light"),
                math(MathFunction::Exp, below, None),
            ));
        }
        written
    }
}

fn length(lobe: Lobe) -> f64 {
    let squares = lobe.map(|c| f64::from(c) * f64::from(c));
    squares.iter().sum::<f64>().sqrt()
}

/// What a light is in a direction, of which it has the unit vector: 1 where it is brightest.
pub fn lobe_at(lobe: Lobe, direction: [f64; 3]) -> f64 {
    let along: f64 = lobe
        .iter()
        .zip(direction)
        .map(|(a, d)| f64::from(*a) * d)
        .sum();
    (along - length(lobe)).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn harmonics_have_as_many_functions_as_their_bands() {
        for band in 1..=MOST {
            let count = ((band + 1) * (band + 1)) as usize;
            assert_eq!(Basis::Harmonics(band).count(), count);
            let count = ((band + 1) * (band + 2) / 2) as usize;
            assert_eq!(Basis::Polynomial(band).count(), count);
        }
    }

    #[test]
    fn functions_are_products_of_powers() {
        let values = Basis::Polynomial(2).values([0.75, 1.0, 7.0], &[]);
        assert_eq!(values, [1.0, 0.5, 1.0, 0.25, 0.5, 1.0]);
        let values = Basis::Harmonics(1).values([0.0, 3.0, 4.0], &[]);
        assert_eq!(values, [1.0, 0.0, 0.6, 0.8]);
        // A light towards z that falls by e for each radius, and one that is brightest there.
        let values = Basis::Lights(2).values([0.0, 2.0, 0.0], &[[0.0, 0.0, 1.0], [0.0, 8.0, 0.0]]);
        assert_eq!(values, [1.0, 0.0, 1.0, 0.0, (-1.0_f64).exp(), 1.0]);
    }

    #[test]
    fn a_basis_is_told_by_its_words() {
        for basis in [Basis::Polynomial(1), Basis::Harmonics(2), Basis::Lights(4)] {
            let words = basis.to_string();
            let (word, degree) = words.split_once(' ').expect("there are two");
            assert_eq!(Basis::parse(word, degree), Some(basis));
        }
        assert_eq!(Basis::parse("harmonics", "4"), None);
        assert_eq!(Basis::parse("lights", "5"), None);
        assert_eq!(Basis::parse("polynomial", "0"), None);
        assert_eq!(Basis::parse("polynomial", ""), None);
    }
}
