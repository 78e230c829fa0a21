//! Inputs as a fragment stage is given them, so that another renderer can be given the same.

use super::run::{Bad, Failure, Given};
use super::{Battery, Exhibit};
use crate::eval::raster::Frame;
use naga::{Binding, ScalarKind};
use std::collections::BTreeMap;

/// Inputs of one frame.
#[derive(Clone, Debug)]
pub struct Fed {
    /// What uniforms and textures hold.
    pub frame: Frame,
    /// What comes from the vertices of the original, by location: the floats of each input.
    pub inputs: Vec<BTreeMap<u32, Vec<f32>>>,
}

impl Fed {
    pub(super) fn of(given: &Given<'_>, lanes: impl Iterator<Item = (usize, usize)>) -> Self {
        let inputs = lanes.map(|(block, lane)| {
            let mut input = BTreeMap::<u32, Vec<f32>>::new();
            for (slot, words) in given.slots.iter().zip(&given.blocks[block].inputs) {
                if let (Binding::Location { location, .. }, ScalarKind::Float) =
                    (&slot.binding, slot.kind)
                {
                    let number = f32::from_bits(words[lane]);
                    input.entry(*location).or_default().push(number);
                }
            }
            input
        });
        Self {
            inputs: inputs.collect(),
            frame: given.frame.clone().into_owned(),
        }
    }
}

impl Battery<'_> {
    /// So many inputs of each exhibit, at most, on which the original is fine under every arithmetic.
    pub fn sound(&self, most: usize) -> Vec<Fed> {
        let of_exhibit = |exhibit: &Exhibit| {
            let given = self.given(&self.original, exhibit, None);
            let bad = exhibit.original.iter().cloned().reduce(|a, b| a.or(&b));
            let bad: Bad = bad.unwrap_or_default();
            let blocks = given.blocks.iter().enumerate();
            let lanes = blocks.flat_map(|(at, block)| {
                let fine = block.covered.without(bad.block(at));
                fine.lanes().map(move |lane| (at, lane))
            });
            let lanes: Vec<(usize, usize)> = lanes.collect();
            let apart = lanes.len().div_ceil(most.max(1)).max(1);
            Fed::of(&given, lanes.into_iter().step_by(apart))
        };
        self.exhibits.iter().map(of_exhibit).collect()
    }

    /// The input of a failure.
    pub fn fed(&self, failure: &Failure) -> Fed {
        let exhibit = self.exhibit_of(failure);
        let given = self.given(&self.original, &exhibit, None);
        let place = (failure.block, failure.lane);
        Fed::of(&given, [place].into_iter())
    }
}
