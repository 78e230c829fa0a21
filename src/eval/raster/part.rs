//! A part of a coverage: the fragments of some screen quads, packed into full blocks again, draw by draw.

use super::{Block, Coverage};
use crate::eval::lane::{LANES, Mask};

impl Coverage {
    /// The fine pixel of every covered fragment, in order.
    pub fn pixels(&self) -> impl Iterator<Item = u32> + '_ {
        let all = self.blocks.iter().flat_map(|block| block.pixels);
        all.filter(|pixel| *pixel != u32::MAX)
    }

    /// The fine pixel of every covered fragment, in order, with its depth and its triangle: the draw, and the number in that.
    #[cfg(feature = "mesh")]
    pub(crate) fn triangles(&self) -> impl Iterator<Item = (u32, f32, (usize, u32))> + '_ {
        self.blocks.iter().flat_map(|block| {
            block.covered.lanes().filter_map(|lane| {
                let triangle = block.quads.get(lane / 4)?.triangle;
                Some((
                    block.pixels[lane],
                    block.depths[lane],
                    (block.draw, triangle),
                ))
            })
        })
    }

    /// The squares of 2 x 2 pixels (not fine pixels) that hold a covered fragment, as (x, y) in units of such
    /// squares, sorted, each once.
    pub fn squares(&self) -> Vec<(u32, u32)> {
        let mut squares: Vec<(u32, u32)> = self.pixels().map(|pixel| self.square(pixel)).collect();
        squares.sort_unstable();
        squares.dedup();
        squares
    }

    /// The square of 2 x 2 pixels that a fine pixel is in.
    fn square(&self, pixel: u32) -> (u32, u32) {
        let side = 2 * self.grid;
        (pixel % self.width / side, pixel / self.width / side)
    }

    /// The fragments in the squares for which `keep` says yes, in the same order. All fragments of a
    /// square stay together, so that they still hide each other.
    pub fn part(&self, keep: impl Fn((u32, u32)) -> bool) -> Self {
        let mut blocks = Vec::new();
        let mut filling: Option<(Block, usize)> = None;
        let mut fragments = 0;
        for block in &self.blocks {
            for quad in (0..LANES).step_by(4) {
                let covered = bits(block.covered, quad);
                let Some(lane) = (quad..quad + 4).find(|lane| covered >> (lane - quad) & 1 == 1)
                else {
                    continue;
                };
                if !keep(self.square(block.pixels[lane])) {
                    continue;
                }
                if filling.as_ref().is_some_and(|(b, _)| b.draw != block.draw) {
                    blocks.extend(filling.take().map(|(block, _)| block));
                }
                let (target, at) = filling.get_or_insert_with(|| {
                    let empty = Block {
                        inputs: vec![[0; LANES]; block.inputs.len()],
                        active: Mask::default(),
                        covered: Mask::default(),
                        pixels: [u32::MAX; LANES],
                        depths: [0.0; LANES],
                        draw: block.draw,
                        first: fragments,
                        quads: Vec::new(),
                        recall: None,
                    };
                    (empty, 0)
                });
                target.quads.extend(block.quads.get(quad / 4).copied());
                let to = *at..*at + 4;
                for (words, from) in target.inputs.iter_mut().zip(&block.inputs) {
                    words[to.clone()].copy_from_slice(&from[quad..quad + 4]);
                }
                target.pixels[to.clone()].copy_from_slice(&block.pixels[quad..quad + 4]);
                target.depths[to].copy_from_slice(&block.depths[quad..quad + 4]);
                target.active.0[*at / 64] |= bits(block.active, quad) << (*at % 64);
                target.covered.0[*at / 64] |= covered << (*at % 64);
                fragments += covered.count_ones() as usize;
                *at += 4;
                if *at == LANES {
                    blocks.extend(filling.take().map(|(block, _)| block));
                }
            }
        }
        blocks.extend(filling.map(|(block, _)| block));
        Self {
            blocks,
            fragments,
            slots: self.slots.clone(),
            states: self.states.clone(),
            vertex_profile: self.vertex_profile.clone(),
            ..*self
        }
    }
}

/// The four bits of the quad that begins at a lane.
fn bits(mask: Mask, quad: usize) -> u64 {
    mask.0[quad / 64] >> (quad % 64) & 0xf
}
