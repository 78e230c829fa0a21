//! Further inputs for fragments that are known: what a variant's own vertex program hands over.
//!
//! Positions are those of the program that the coverage was made with, so that the fragments stay, and the vertices of the
//! triangles that they are of are all that is needed.

use super::triangle::Triangle;
use super::{Block, Coverage, Frame, Target, quads, vertices};
use crate::eval::program::{Program, Slot};
use rayon::prelude::*;
use std::collections::BTreeMap;

impl Coverage {
    /// The same fragments with the inputs of another fragment program as well, which come of another vertex program;
    /// [`Coverage::vertex_profile`] is what that executed at the vertices of these fragments. The frame is the one that
    /// was rasterised, and both vertex programs give the same positions.
    ///
    /// # Panics
    /// When a resource of the vertex program is not bound.
    pub(crate) fn with_inputs_of(
        &self,
        vertex: &Program,
        fragment: &Program,
        frame: &Frame,
    ) -> Self {
        let further = fragment.inputs().iter();
        let further = further.filter(|slot| !self.slots.iter().any(|have| have.meets(slot)));
        let further: Vec<Slot> = further.cloned().collect();

        // The triangles that fragments are of, draw by draw, and where their vertices come to be.
        let mesh = &*frame.mesh;
        let draws = mesh.draws();
        let mut seen: Vec<BTreeMap<u32, u32>> = vec![BTreeMap::new(); draws.len()];
        for block in &self.blocks {
            for quad in &block.quads {
                seen[block.draw].insert(quad.triangle, 0);
            }
        }
        let corners = |draw: usize, triangle: u32| {
            let at = 3 * (draws[draw].triangles.start + triangle as usize);
            [0, 1, 2].map(|i| mesh.indices[at + i] as usize)
        };
        let mut chosen: Vec<Vec<usize>> = Vec::with_capacity(draws.len());
        for (draw, triangles) in seen.iter().enumerate() {
            let all = triangles
                .keys()
                .flat_map(|triangle| corners(draw, *triangle));
            let mut all: Vec<usize> = all.collect();
            all.sort_unstable();
            all.dedup();
            chosen.push(all);
        }
        let vertices = vertices::run_some(vertex, frame, &chosen);

        let target = Target::of(frame);
        let mut triangles = Vec::new();
        let mut first = 0;
        for (draw, (numbers, chosen)) in seen.iter_mut().zip(&chosen).enumerate() {
            for (number, place) in numbers.iter_mut() {
                let corners = corners(draw, *number);
                // Each was chosen above.
                let at = |vertex: usize| chosen.binary_search(&vertex).unwrap_or_default();
                let corners = corners.map(|vertex| (first + at(vertex)) as u32);
                let triangle = Triangle::new(*number, corners, &vertices.positions, &target);
                *place = triangles.len() as u32;
                triangles.push(triangle.expect("it has fragments with the same positions"));
            }
            first += chosen.len();
        }

        let sources = quads::sources(&further, vertex.outputs());
        let with_more = |block: &Block| {
            let mut block = block.clone();
            let mut places = block.quads.clone();
            for quad in &mut places {
                quad.triangle = seen[block.draw][&quad.triangle];
            }
            let more = quads::block(
                &places, block.draw, &triangles, &vertices, &sources, &target,
            );
            block.inputs.extend(more.inputs);
            block
        };
        let mut slots = self.slots.clone();
        slots.extend(further.iter().cloned());
        Self {
            blocks: self.blocks.par_iter().map(with_more).collect(),
            slots,
            states: self.states.clone(),
            vertex_profile: vertices.profile,
            ..*self
        }
    }
}
