//! The hunt: new inputs near those that brought an operation the closest to trouble, again and again.
//!
//! Each operation with a margin keeps the input on which that was least; so does what is returned, whose margin is how far it is
//! from what the target holds. In turn, each is moved by a little or by much, 64 ways at a time, and what is nearer takes its
//! place. What brings the variant down where the original holds ends the hunt.

use super::inputs::{Group, Interface, Quad};
use super::obligations::{Least, Margins, Place, is_sum};
use super::run::{Failure, Subject, shade};
use super::{Asked, Battery, Inputs, Reach};
use crate::eval::program::Refused;
use crate::eval::programs::Programs;
use crate::scene::chance::child;
use lodc_passes::semantics::Op;
use lodc_passes::{Shader, Stage};
use naga::Expression;
use std::collections::{BTreeMap, BTreeSet};

/// Moves of each operation's closest input, on average.
const MOVES: usize = 6;
/// The most moves of all.
const MOST: usize = 240;
/// How many sums and differences are brought closer to where nothing is left of their digits: those that have lost the
/// most already, a hundredth being left.
const CANCELLING: usize = 8;
const LEFT: f64 = 0.01;
/// Stands for what is returned.
const RETURNED: Place = (u32::MAX, Op::Neg);

/// What a hunt gives.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Hunt {
    /// How many inputs it looked at.
    pub inputs: u64,
    /// The one on which the shader fails and the original does not.
    pub failure: Option<Failure>,
    /// Where there is none, what brought each operation the closest to trouble.
    pub near: Asked,
}

impl Hunt {
    fn ended(inputs: u64, failure: Failure) -> Self {
        Self {
            inputs,
            failure: Some(failure),
            near: Asked::default(),
        }
    }
}

/// The closest to trouble that an operation was brought.
struct Closest {
    margin: f64,
    group: Group,
    quad: Quad,
}

/// What is hunted.
struct Hunted<'s> {
    closest: BTreeMap<Place, Closest>,
    /// The expressions that have an index.
    indexed: &'s BTreeSet<u32>,
    /// Whether it is known which sums and differences are worth it.
    is_known: bool,
}

impl Hunted<'_> {
    /// Whether a margin is less than what is known.
    fn wants(&self, place: Place, margin: f64) -> bool {
        match self.closest.get(&place) {
            Some(known) => margin < known.margin,
            None => !(self.is_known && is_sum(place.1)),
        }
    }

    /// Leaves those sums and differences that have lost the most digits.
    fn choose(&mut self) {
        self.is_known = true;
        let sums = self.closest.iter();
        let sums = sums.filter(|(place, _)| is_sum(place.1));
        let mut sums: Vec<(f64, Place)> = sums.map(|(place, c)| (c.margin, *place)).collect();
        sums.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let kept = sums.iter().take_while(|(margin, _)| *margin < LEFT);
        for (_, place) in &sums[kept.take(CANCELLING).count()..] {
            self.closest.remove(place);
        }
    }
}

/// Whether what an operation gives is finite even in trouble: a sum without digits, an index.
fn is_late(&(_, op): &Place) -> bool {
    is_sum(op) || op == Op::MinUint
}

/// The expressions of a shader's fragment stage that take an index.
fn indexed(shader: &Shader) -> BTreeSet<u32> {
    let function = shader.function(Stage::Fragment);
    let all = function.into_iter().flat_map(|f| f.expressions.iter());
    all.filter(|(_, expression)| matches!(expression, Expression::Access { .. }))
        .map(|(value, _)| value.index() as u32)
        .collect()
}

impl Battery<'_> {
    /// Looks for inputs on which a shader fails and the original does not, going down on margins.
    ///
    /// # Errors
    /// When the evaluator refuses it.
    pub fn hunt(&self, shader: &Shader) -> Result<Hunt, Refused> {
        let subject = Subject::new(Programs::of(shader)?);
        let indexed = indexed(shader);
        let mut hunted = Hunted {
            closest: BTreeMap::new(),
            indexed: &indexed,
            is_known: false,
        };
        for exhibit in &self.exhibits {
            if let Inputs::Made(group) = &exhibit.inputs {
                self.look(&subject, group, &mut hunted);
            }
        }
        hunted.choose();
        // What leads to a result that is not finite comes first, then what may: lost digits and indices.
        let places = hunted.closest.keys().copied();
        let (late, early): (Vec<Place>, Vec<Place>) = places.partition(is_late);
        let mut inputs = 0;
        for (places, first) in [(&early, 0), (&late, MOST)] {
            for round in 0..(MOVES * places.len()).min(MOST) {
                let place = &places[round % places.len()];
                let Some(Closest { group, quad, .. }) = hunted.closest.get(place) else {
                    continue;
                };
                let seed = child(self.stand.scene.seed ^ 0x1eaf, (first + round) as u64);
                let near = self.interface.near(group, quad, seed);
                inputs += 4 * near.quads.len() as u64;
                if self.look(&subject, &near, &mut hunted)
                    && let Some(failure) = self.failure_of(&subject, &near, 1)
                {
                    return Ok(Hunt::ended(inputs, failure));
                }
            }
        }
        // What came the closest is asked of every arithmetic.
        let (late, early): (Vec<_>, Vec<_>) =
            hunted.closest.iter().partition(|(place, _)| is_late(place));
        let mut near = Vec::new();
        for (_, Closest { group, quad, .. }) in early.into_iter().chain(late) {
            let alone = Group {
                quads: vec![quad.clone()],
                ..group.clone()
            };
            inputs += 4;
            if let Some(failure) = self.failure_of(&subject, &alone, self.arithmetics.len()) {
                return Ok(Hunt::ended(inputs, failure));
            }
            near.push(alone);
        }
        Ok(Hunt {
            inputs,
            failure: None,
            near: Asked(near),
        })
    }

    /// Where a subject fails in a group and the original does not, under the first few arithmetics.
    fn failure_of(&self, subject: &Subject, group: &Group, arithmetics: usize) -> Option<Failure> {
        let exhibit = self.exhibit(self.interface.frame(group), Inputs::Made(group.clone()));
        let all = self.arithmetics.iter().zip(&exhibit.original).enumerate();
        let mut failures = all
            .take(arithmetics)
            .filter_map(|(number, (arithmetic, original))| {
                let bad = self.run(subject, &exhibit, *arithmetic);
                let (block, lane) = bad.first_beyond(original)?;
                Some(Failure {
                    exhibit: usize::MAX,
                    group: Some(group.clone()),
                    block,
                    lane,
                    arithmetic: number,
                    law: None,
                    reach: Reach::Declared,
                })
            });
        failures.next()
    }

    /// Keeps what a group brings closer; whether something that is returned is bad.
    fn look(&self, subject: &Subject, group: &Group, hunted: &mut Hunted<'_>) -> bool {
        let exhibit = super::Exhibit {
            frame: self.interface.frame(group),
            inputs: Inputs::Made(group.clone()),
            hostile: Vec::new(),
            original: Vec::new(),
        };
        let given = self.given(subject, &exhibit, None);
        debug_assert_eq!(Interface::spots(group).len(), group.quads.len());
        let mut any = false;
        for (at, block) in given.blocks.iter().enumerate() {
            let mut margins = Margins::of(hunted.indexed);
            let fragment = &subject.programs.fragment;
            let (outputs, alive) = shade(fragment, &given, block, Some(&mut margins));
            let bad = self.bad(subject, block, &outputs, alive);
            any |= !bad.is_empty();
            for lane in block.covered.and(alive).without(bad).lanes() {
                let words = outputs
                    .iter()
                    .map(|words| f32::from_bits(words[lane]).abs());
                let margin = -f64::from(words.fold(0.0, f32::max));
                let least = margins
                    .least
                    .entry(RETURNED)
                    .or_insert(Least { margin, lane });
                if margin < least.margin {
                    *least = Least { margin, lane };
                }
            }
            for (place, Least { margin, lane }) in margins.least {
                let quad = at * super::inputs::QUADS + lane / 4;
                let (Some(quad), true) = (group.quads.get(quad), hunted.wants(place, margin))
                else {
                    continue;
                };
                let known = Closest {
                    margin,
                    group: Group {
                        quads: Vec::new(),
                        ..group.clone()
                    },
                    quad: quad.clone(),
                };
                hunted.closest.insert(place, known);
            }
        }
        any
    }
}
