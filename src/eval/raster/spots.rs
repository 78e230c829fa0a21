//! Fragments at chosen places of triangles, wherever those are on screen or beyond: for what no picture shows.

use super::quads::{Source, sources};
use super::{Block, Frame, vertices};
use crate::eval::lane::{LANES, Mask};
use crate::eval::machine::Watcher;
use crate::eval::program::Program;

/// A quad of fragments at a place of a triangle.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Spot {
    /// The triangle's place in the mesh.
    pub(crate) triangle: u32,
    /// For each of the four fragments, what each corner weighs; they sum to 1, and outside of the triangle some are below 0.
    pub(crate) weights: [[f64; 3]; 4],
}

/// The fragments of such quads, with the inputs of a fragment program: 64 quads a block, all of the mesh's first draw. All lanes
/// count. What the position on screen would decide is made up: the pixel's is told by the quad's number, the depth is 0.5.
///
/// # Panics
/// When a resource of the vertex program is not bound, or a triangle is not there.
pub(crate) fn on_spots(
    vertex: &Program,
    fragment: &Program,
    frame: &Frame,
    spots: &[Spot],
    watcher: Option<&mut dyn Watcher<f32>>,
) -> Vec<Block> {
    let vertices = vertices::run_watched(vertex, frame, watcher);
    let sources = sources(fragment.inputs(), vertex.outputs());
    let mut blocks = Vec::new();
    for (number, spots) in spots.chunks(LANES / 4).enumerate() {
        let mut block = Block {
            inputs: vec![[0; LANES]; sources.len()],
            active: Mask::default(),
            covered: Mask::default(),
            pixels: [u32::MAX; LANES],
            depths: [0.5; LANES],
            draw: 0,
            first: number * LANES,
            quads: Vec::new(),
            recall: None,
        };
        for (i, spot) in spots.iter().enumerate() {
            let bit = i % 16 * 4;
            block.active.0[i / 16] |= 15 << bit;
            block.covered.0[i / 16] |= 15 << bit;
            let corners = [0, 1, 2].map(|c| frame.mesh.indices[3 * spot.triangle as usize + c]);
            for (words, source) in block.inputs.iter_mut().zip(&sources) {
                for (j, weights) in spot.weights.iter().enumerate() {
                    let corner =
                        |output: usize, c: usize| vertices.outputs[output][corners[c] as usize];
                    words[i * 4 + j] = match *source {
                        Source::Perspective(output) | Source::Linear(output) => {
                            let value = |c| f64::from(f32::from_bits(corner(output, c)));
                            let sum: f64 = (0..3).map(|c| value(c) * weights[c]).sum();
                            (sum as f32).to_bits()
                        }
                        Source::Flat(output) => corner(output, 0),
                        Source::Position(component) => {
                            let pixel = [i % 8 * 2 + j % 2, i / 8 * 2 + j / 2];
                            let own = pixel.map(|at| at as f32 + 0.5);
                            [own[0], own[1], 0.5, 1.0][component].to_bits()
                        }
                        Source::Barycentric(corner, _) => (weights[corner] as f32).to_bits(),
                        Source::Front => 1,
                        Source::Primitive => spot.triangle,
                        Source::Constant(word) => word,
                    };
                }
            }
        }
        blocks.push(block);
    }
    blocks
}
