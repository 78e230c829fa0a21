//! The law on operands: a divisor of a variant keeps the sign that it has in the original, and no operation comes much closer
//! to trouble than the same one of the original did, unless it stays where it is safe.
//!
//! Operations are the same by the path of their value and by what they do. How close one comes is its least margin over all
//! inputs on which the original is fine, in the evaluator's own arithmetic. A guard that is gone lets an operand fall below
//! what the guard let through long before an input makes it 0: this sees it on the way there.

use super::obligations::margin;
use super::run::{Failure, Subject, shade};
use super::{Battery, Exhibit};
use crate::eval::lane::{LANES, Mask};
use crate::eval::machine::{Outcome, Watcher};
use lodc_passes::semantics::Op;
use lodc_passes::{Shader, Stage};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// The part of the original's least margin that a variant's may be down to.
const SHARE: f64 = 1e-3;

/// A margin that is safe, whatever it is in the original; nothing for operations whose margins are not held against each other.
fn safe(op: Op) -> Option<f64> {
    match op {
        Op::Div | Op::Rem | Op::SmoothStep | Op::InverseSqrt => Some(1e-6),
        Op::Log | Op::Log2 | Op::Atanh => Some(1e-6),
        // Where these end they are still defined.
        Op::Sqrt | Op::Pow | Op::Asin | Op::Acos | Op::Acosh => Some(0.0),
        Op::Exp | Op::Exp2 => Some(1.0),
        Op::Tan => Some(1e-3),
        _ => None,
    }
}

/// How an operation of a variant is worse off than the same of the original, where nothing that is returned shows it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Breach {
    /// Its divisor is 0 or on the other side of it, and in the original it never is.
    Sign,
    /// It comes closer to trouble.
    Margin {
        /// The least margin in the original.
        original: f64,
        /// The least margin in the variant.
        own: f64,
    },
}

/// An operation that breaks the law.
#[derive(Clone, Debug)]
pub(crate) struct Broken {
    pub(crate) path: String,
    pub(crate) op: Op,
    pub(crate) breach: Breach,
}

/// A number with the block and the lane that it is from.
type Seen<T> = (T, usize, usize);

/// What an operation was given over some inputs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Met {
    /// Its least margin.
    pub(crate) margin: Seen<f64>,
    /// Its operands there.
    pub(crate) operands: [f32; 3],
    /// The least and the greatest divisor, of a division.
    divisor: Option<[Seen<f32>; 2]>,
}

impl Met {
    fn absorb(&mut self, other: Self) {
        if other.margin.0 < self.margin.0 {
            (self.margin, self.operands) = (other.margin, other.operands);
        }
        match (&mut self.divisor, other.divisor) {
            (Some([least, most]), Some([their_least, their_most])) => {
                if their_least.0 < least.0 {
                    *least = their_least;
                }
                if their_most.0 > most.0 {
                    *most = their_most;
                }
            }
            (own, their) => *own = own.or(their),
        }
    }

    /// How it is worse off than the same operation of the original, with the block and the lane that show it.
    fn breach(&self, op: Op, original: &Self) -> Option<(Breach, usize, usize)> {
        if let (Some([low, high]), Some([least, most])) = (original.divisor, self.divisor) {
            let crosses = match (low.0 > 0.0, high.0 < 0.0) {
                (true, _) if least.0 <= 0.0 => Some(least),
                (_, true) if most.0 >= 0.0 => Some(most),
                _ => None,
            };
            if let Some((_, block, lane)) = crosses {
                return Some((Breach::Sign, block, lane));
            }
        }
        let (own, block, lane) = self.margin;
        let (before, ..) = original.margin;
        // What is in trouble already can come to no harm.
        let worse = before >= 0.0 && own < SHARE * before;
        let breach = Breach::Margin {
            original: before,
            own,
        };
        (worse && own < safe(op)?).then_some((breach, block, lane))
    }
}

/// What the operations of a shader were given, by the paths of their values.
#[derive(Debug, Default)]
pub(crate) struct Operands(BTreeMap<(String, Op), Met>);

impl Operands {
    pub(crate) fn absorb(&mut self, other: Self) {
        for (place, theirs) in other.0 {
            match self.0.get_mut(&place) {
                Some(own) => own.absorb(theirs),
                None => {
                    self.0.insert(place, theirs);
                }
            }
        }
    }
}

/// The paths of a fragment stage's values, by the places of their expressions.
pub(crate) struct Paths(BTreeMap<u32, String>);

impl Paths {
    pub(crate) fn of(shader: &Shader) -> Self {
        let function = shader.function(Stage::Fragment).into_iter();
        let values = function.flat_map(|function| function.expressions.iter());
        let paths = values.map(|(value, _)| {
            let path = shader.id(Stage::Fragment, value).path().to_owned();
            (value.index() as u32, path)
        });
        Self(paths.collect())
    }
}

/// Sees what operations are given.
#[derive(Debug, Default)]
struct Giving {
    /// Lanes that count.
    of: Mask,
    block: usize,
    found: BTreeMap<(u32, Op), Met>,
}

impl Watcher<f32> for Giving {
    fn done(
        &mut self,
        op: Op,
        origin: u32,
        lanes: Option<Mask>,
        operands: &[[f32; LANES]],
        _: Outcome<'_, f32>,
    ) {
        // What is the same for a whole draw is an affair of its uniforms.
        let (Some(lanes), Some(_)) = (lanes, safe(op)) else {
            return;
        };
        let mut met: Option<Met> = None;
        for lane in lanes.and(self.of).lanes() {
            let of = |place: usize| operands.get(place).map_or(0.0, |block| block[lane]);
            let three = [of(0), of(1), of(2)];
            let Some(margin) = margin(op, three).filter(|margin| !margin.is_nan()) else {
                continue;
            };
            let divisor = (three[1], self.block, lane);
            let is_divisor = op == Op::Div && three[1].is_finite();
            let own = Met {
                margin: (margin, self.block, lane),
                operands: three,
                divisor: is_divisor.then_some([divisor; 2]),
            };
            match &mut met {
                Some(met) => met.absorb(own),
                None => met = Some(own),
            }
        }
        if let Some(met) = met {
            let known = self.found.entry((origin, op)).or_insert(met);
            known.absorb(met);
        }
    }
}

impl Battery<'_> {
    /// What the operations of a subject are given in an exhibit, where the original is fine.
    pub(crate) fn operands_of(
        &self,
        subject: &Subject,
        paths: &Paths,
        exhibit: &Exhibit,
    ) -> Operands {
        let given = self.given(subject, exhibit, None);
        let mut giving = Giving::default();
        for (at, block) in given.blocks.iter().enumerate() {
            giving.block = at;
            let bad = exhibit.original.first().map(|bad| bad.block(at));
            giving.of = block.covered.without(bad.unwrap_or_default());
            shade(&subject.programs.fragment, &given, block, Some(&mut giving));
        }
        let mut operands = Operands::default();
        for ((origin, op), met) in giving.found {
            if let Some(path) = paths.0.get(&origin) {
                operands.absorb(Operands(BTreeMap::from([((path.clone(), op), met)])));
            }
        }
        operands
    }

    /// The first operation of a subject that breaks the law, and where.
    pub(crate) fn broken(&self, subject: &Subject, shader: &Shader) -> Option<Failure> {
        let paths = Paths::of(shader);
        let all: Vec<Operands> = self
            .exhibits
            .par_iter()
            .map(|exhibit| self.operands_of(subject, &paths, exhibit))
            .collect();
        for ((path, op), original) in &self.operands.0 {
            for (at, operands) in all.iter().enumerate() {
                let met = operands.0.get(&(path.clone(), *op));
                if let Some((breach, block, lane)) = met.and_then(|met| met.breach(*op, original)) {
                    return Some(Failure {
                        exhibit: at,
                        group: None,
                        block,
                        lane,
                        arithmetic: 0,
                        law: Some(Broken {
                            path: path.clone(),
                            op: *op,
                            breach,
                        }),
                        reach: self.exhibits[at].reach(),
                    });
                }
            }
        }
        None
    }

    /// Whether a subject breaks the law in an exhibit where another one did; what its operation was given there.
    pub(crate) fn breaks(
        &self,
        subject: &Subject,
        shader: &Shader,
        exhibit: &Exhibit,
        Broken { path, op, .. }: &Broken,
    ) -> Option<[f32; 3]> {
        let place = (path.clone(), *op);
        let operands = self.operands_of(subject, &Paths::of(shader), exhibit);
        let (met, original) = (operands.0.get(&place)?, self.operands.0.get(&place)?);
        met.breach(*op, original).map(|_| met.operands)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn met(margin: f64, divisor: Option<[f32; 2]>) -> Met {
        Met {
            margin: (margin, 0, 0),
            operands: [0.0; 3],
            divisor: divisor.map(|both| both.map(|x| (x, 0, 0))),
        }
    }

    #[test]
    fn margins_are_worse_below_the_originals_where_they_are_not_safe() {
        let worse = |op, original, own| met(own, None).breach(op, &met(original, None)).is_some();
        // The guard that let 1e-4 through is gone, or nearly as much is let through, or enough.
        assert!(worse(Op::Div, 1e-4, 1e-9));
        assert!(!worse(Op::Div, 1e-4, 3e-7));
        assert!(!worse(Op::Div, 0.5, 1e-5));
        // The end of a root's range is within it.
        assert!(!worse(Op::Sqrt, 0.5, 0.0) && worse(Op::Sqrt, 0.0, -1e-8));
        // It fails in the original.
        assert!(!worse(Op::Sqrt, -1e-8, -0.5));
        assert!(worse(Op::Exp, 40.0, 0.01) && !worse(Op::Exp, 40.0, 2.0));
        assert!(!worse(Op::FloatToInt, 1.0, -1.0));
    }

    #[test]
    fn a_divisor_keeps_its_sign() {
        let sign = |original, own| {
            let found = met(0.1, Some(own)).breach(Op::Div, &met(0.1, Some(original)));
            matches!(found, Some((Breach::Sign, ..)))
        };
        assert!(sign([0.1, 0.9], [-0.1, 0.5]) && sign([-0.9, -0.1], [-0.5, 0.0]));
        assert!(!sign([0.1, 0.9], [0.2, 0.5]) && !sign([-0.1, 0.9], [-0.5, 2.0]));
    }
}
