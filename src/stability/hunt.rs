//! The hunt: new inputs near those that brought an operation the closest to trouble, again and again.
//!
//! Each operation with a margin keeps the input on which that was least; so does what is returned, whose margin is how far it is
//! from what the target holds. In turn, each is moved by a little or by much, 64 ways at a time, and what is nearer takes its
//! place. What brings the variant down where the original holds ends the hunt.

use super::inputs::{Group, Interface, Quad};
use super::obligations::{Least, Margins, Place};
use super::run::{Failure, Subject, shade};
use super::{Battery, Inputs, Reach};
use crate::eval::program::Refused;
use crate::eval::programs::Programs;
use crate::scene::chance::child;
use lodc_passes::Shader;
use lodc_passes::semantics::Op;
use std::collections::BTreeMap;

/// Moves of each operation's closest input, on average.
const MOVES: usize = 6;
/// The most moves of all.
const MOST: usize = 240;
/// Stands for what is returned.
const RETURNED: Place = (u32::MAX, Op::Add);

/// The closest to trouble that an operation was brought.
struct Closest {
    margin: f64,
    group: Group,
    quad: Quad,
}

impl Battery<'_> {
    /// Looks for inputs on which a shader fails and the original does not, going down on margins.
    ///
    /// # Errors
    /// When the evaluator refuses it.
    pub fn hunt(&self, shader: &Shader) -> Result<(u64, Option<Failure>), Refused> {
        let subject = Subject::new(Programs::of(shader)?);
        let mut closest = BTreeMap::<Place, Closest>::new();
        for exhibit in &self.exhibits {
            if let Inputs::Made(group) = &exhibit.inputs {
                self.look(&subject, group, &mut closest);
            }
        }
        let places: Vec<Place> = closest.keys().copied().collect();
        let mut inputs = 0;
        let rounds = (MOVES * places.len()).min(MOST);
        for round in 0..rounds {
            let Some(Closest { group, quad, .. }) = closest.get(&places[round % places.len()])
            else {
                continue;
            };
            let seed = child(self.stand.scene.seed ^ 0x1eaf, round as u64);
            let near = self.interface.near(group, quad, seed);
            inputs += 4 * near.quads.len() as u64;
            if self.look(&subject, &near, &mut closest)
                && let Some(failure) = self.failure_of(&subject, &near, 1)
            {
                return Ok((inputs, Some(failure)));
            }
        }
        // What came the closest is asked of every arithmetic.
        for Closest { group, quad, .. } in closest.values() {
            let alone = Group {
                quads: vec![quad.clone()],
                ..group.clone()
            };
            inputs += 4;
            if let Some(failure) = self.failure_of(&subject, &alone, self.arithmetics.len()) {
                return Ok((inputs, Some(failure)));
            }
        }
        Ok((inputs, None))
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
    fn look(
        &self,
        subject: &Subject,
        group: &Group,
        closest: &mut BTreeMap<Place, Closest>,
    ) -> bool {
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
            let mut margins = Margins::default();
            let fragment = &subject.programs.fragment;
            let (outputs, alive) = shade(fragment, &given, block, Some(&mut margins));
            let bad = self.bad(subject, block, &outputs, alive);
            any |= !bad.is_empty();
            for lane in block.covered.and(alive).without(bad).lanes() {
                let words = outputs
                    .iter()
                    .map(|words| f32::from_bits(words[lane]).abs());
                let margin = -f64::from(words.fold(0.0, f32::max));
                let least = margins.0.entry(RETURNED).or_insert(Least { margin, lane });
                if margin < least.margin {
                    *least = Least { margin, lane };
                }
            }
            for (place, Least { margin, lane }) in margins.0 {
                let quad = at * super::inputs::QUADS + lane / 4;
                let (Some(quad), true) = (
                    group.quads.get(quad),
                    closest
                        .get(&place)
                        .is_none_or(|known| margin < known.margin),
                ) else {
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
                closest.insert(place, known);
            }
        }
        any
    }
}
