//! Quads of fragments: which are seen, and the inputs of the fragment program for them.

#[cfg(feature = "mesh")]
use super::Squares;
use super::triangle::Triangle;
use super::vertices::Vertices;
use super::{Block, Target};
use crate::eval::lane::{LANES, Mask};
use crate::eval::program::Slot;
use naga::{Binding, BuiltIn, Interpolation, ScalarKind};
use rayon::prelude::*;
use std::ops::Range;

/// Edge of a tile in pixels: 64 quads, so that a block of a surface that fills the screen is one tile.
const TILE: u32 = 16;

/// 2 x 2 fragments of one triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Quad {
    /// Its place among the triangles given; in a [`Block`] among those of the block's draw.
    pub(super) triangle: u32,
    /// Its top-left pixel; both are even.
    x: u32,
    y: u32,
    /// A bit for each covered fragment: top left, top right, bottom left, bottom right.
    mask: u8,
}

#[cfg(feature = "mesh")]
impl Quad {
    /// Whether its square is one of these.
    pub(super) fn is_in(&self, squares: &Squares) -> bool {
        squares.has(self.x, self.y)
    }
}

/// The fragments that are nearest in their pixel, tile by tile. Of equal depths the first triangle wins. Behind them
/// those of blended triangles, which are given as ranges, that are in front of what is nearest otherwise.
pub(super) fn visible(
    triangles: &[Triangle],
    blended: &[Range<usize>],
    target: &Target,
) -> Vec<Quad> {
    const NONE: u32 = u32::MAX;
    let place = |x: u32, y: u32| y as usize * target.width as usize + x as usize;
    let mut nearest = vec![(1.0_f32, NONE); place(0, target.height)];
    for (i, triangle) in triangles.iter().enumerate() {
        if blended.iter().any(|range| range.contains(&i)) {
            continue;
        }
        triangle.scan(|x, y, mask| {
            for (x, y) in pixels(x, y, mask) {
                let seen = &mut nearest[place(x, y)];
                if let Some(depth) = triangle.depth(x, y).filter(|&d| d < seen.0) {
                    *seen = (depth, i as u32);
                }
            }
        });
    }
    let mut quads = Vec::new();
    for (tile_y, tile_x) in steps(0, target.height, TILE)
        .flat_map(|y| steps(0, target.width, TILE).map(move |x| (y, x)))
    {
        for y in steps(tile_y, (tile_y + TILE).min(target.height), 2) {
            for x in steps(tile_x, (tile_x + TILE).min(target.width), 2) {
                let mut seen = [NONE; 4];
                for (i, seen) in seen.iter_mut().enumerate() {
                    let (x, y) = (x + (i as u32 & 1), y + (i as u32 >> 1));
                    if x < target.width && y < target.height {
                        *seen = nearest[place(x, y)].1;
                    }
                }
                for (i, &triangle) in seen.iter().enumerate() {
                    if triangle != NONE && !seen[..i].contains(&triangle) {
                        let same = |j: usize| u8::from(seen[j] == triangle) << j;
                        quads.push(Quad {
                            triangle,
                            x,
                            y,
                            mask: same(0) | same(1) | same(2) | same(3),
                        });
                    }
                }
            }
        }
    }
    for i in blended.iter().cloned().flatten() {
        before(&triangles[i], i, &mut quads, |x, y| nearest[place(x, y)].0);
    }
    quads
}

/// All fragments before the far plane, in the order of the triangles.
pub(super) fn in_order(triangles: &[Triangle]) -> Vec<Quad> {
    let mut quads = Vec::new();
    for (i, triangle) in triangles.iter().enumerate() {
        before(triangle, i, &mut quads, |_, _| 1.0);
    }
    quads
}

/// The fragments of a triangle, the `i`-th, that are nearer than what is at their pixel.
fn before(triangle: &Triangle, i: usize, quads: &mut Vec<Quad>, nearest: impl Fn(u32, u32) -> f32) {
    triangle.scan(|x, y, mask| {
        let mask = pixels(x, y, mask)
            .filter(|&(x, y)| triangle.depth(x, y).is_some_and(|d| d < nearest(x, y)))
            .fold(0, |kept, (px, py)| kept | 1 << (px - x + 2 * (py - y)));
        if mask != 0 {
            quads.push(Quad {
                triangle: i as u32,
                x,
                y,
                mask,
            });
        }
    });
}

/// The quads of each draw, in the order in which they are. `ends` says where the triangles of each draw end.
pub(super) fn by_draw(quads: Vec<Quad>, ends: &[usize]) -> Vec<Vec<Quad>> {
    if ends.len() == 1 {
        return vec![quads];
    }
    let mut draws: Vec<Vec<Quad>> = ends.iter().map(|_| Vec::new()).collect();
    for quad in quads {
        let draw = ends.partition_point(|end| *end <= quad.triangle as usize);
        if let Some(draw) = draws.get_mut(draw) {
            draw.push(quad);
        }
    }
    draws
}

/// Packs the quads of each draw into blocks and computes the inputs of the fragment program.
pub(super) fn blocks(
    draws: &[Vec<Quad>],
    triangles: &[Triangle],
    vertices: &Vertices,
    outputs: &[Slot],
    inputs: &[Slot],
    target: &Target,
) -> Vec<Block> {
    let sources = sources(inputs, outputs);
    let mut blocks: Vec<Block> = draws
        .par_iter()
        .enumerate()
        .flat_map(|(draw, quads)| {
            let blocks = quads.par_chunks(LANES / 4);
            blocks.map({
                let sources = &sources;
                move |quads| block(quads, draw, triangles, vertices, sources, target)
            })
        })
        .collect();
    let mut first = 0;
    for block in &mut blocks {
        block.first = first;
        first += block.covered_count();
    }
    blocks
}

/// Where the inputs of a fragment program come from, of a vertex program's outputs among others.
pub(super) fn sources(inputs: &[Slot], outputs: &[Slot]) -> Vec<Source> {
    inputs.iter().map(|s| Source::of(s, outputs)).collect()
}

/// A block of quads, with the inputs that come from the sources.
pub(super) fn block(
    quads: &[Quad],
    draw: usize,
    triangles: &[Triangle],
    vertices: &Vertices,
    sources: &[Source],
    target: &Target,
) -> Block {
    let mut block = Block {
        inputs: vec![[0; LANES]; sources.len()],
        active: Mask::default(),
        covered: Mask::default(),
        pixels: [u32::MAX; LANES],
        depths: [0.0; LANES],
        draw,
        first: 0,
        quads: Vec::with_capacity(quads.len()),
        recall: None,
    };
    let linear = sources
        .iter()
        .any(|s| matches!(s, Source::Linear(_) | Source::Barycentric(_, false)));
    for (i, quad) in quads.iter().enumerate() {
        let triangle = &triangles[quad.triangle as usize];
        block.quads.push(Quad {
            triangle: triangle.index,
            ..*quad
        });
        let bit = i % 16 * 4;
        block.active.0[i / 16] |= 15 << bit;
        block.covered.0[i / 16] |= u64::from(quad.mask) << bit;
        // A helper at or beyond the horizon, where w ends, takes the place of a covered fragment: the
        // extrapolated values would not be finite.
        let some = quad.mask.trailing_zeros();
        let fragments: [Fragment; 4] = [0_u32, 1, 2, 3].map(|j| {
            let own = (quad.x + (j & 1), quad.y + (j >> 1));
            let at = if triangle.inverse_w(own.0, own.1) > 0.0 {
                own
            } else {
                (quad.x + (some & 1), quad.y + (some >> 1))
            };
            Fragment::new(triangle, own, at, linear, target)
        });
        for (j, fragment) in fragments.iter().enumerate() {
            let lane = i * 4 + j;
            block.depths[lane] = fragment.position[2];
            if quad.mask >> j & 1 == 1 {
                let (x, y) = (quad.x + (j as u32 & 1), quad.y + (j as u32 >> 1));
                block.pixels[lane] = y * target.width + x;
            }
        }
        for (words, source) in block.inputs.iter_mut().zip(sources) {
            let words = &mut words[i * 4..i * 4 + 4];
            let corners = |output: usize| {
                let all = &vertices.outputs[output];
                triangle.corners.map(|corner| all[corner as usize])
            };
            match *source {
                Source::Perspective(output) => {
                    let values = corners(output).map(|word| f64::from(f32::from_bits(word)));
                    for (word, fragment) in words.iter_mut().zip(&fragments) {
                        *word = blend(values, fragment.perspective);
                    }
                }
                Source::Linear(output) => {
                    let values = corners(output).map(|word| f64::from(f32::from_bits(word)));
                    for (word, fragment) in words.iter_mut().zip(&fragments) {
                        *word = blend(values, fragment.linear);
                    }
                }
                Source::Flat(output) => words.fill(corners(output)[0]),
                Source::Position(component) => {
                    for (word, fragment) in words.iter_mut().zip(&fragments) {
                        *word = fragment.position[component].to_bits();
                    }
                }
                Source::Barycentric(corner, perspective) => {
                    for (word, fragment) in words.iter_mut().zip(&fragments) {
                        let weights = if perspective {
                            fragment.perspective
                        } else {
                            fragment.linear
                        };
                        *word = (weights[corner] as f32).to_bits();
                    }
                }
                Source::Front => words.fill(u32::from(triangle.front)),
                Source::Primitive => words.fill(triangle.index),
                Source::Constant(word) => words.fill(word),
            }
        }
    }
    block
}

/// The weighted sum of the corners' values, as the bits of an f32.
fn blend(values: [f64; 3], weights: [f64; 3]) -> u32 {
    let sum = values[0] * weights[0] + values[1] * weights[1] + values[2] * weights[2];
    (sum as f32).to_bits()
}

/// Where a word of the fragment program's input comes from.
pub(super) enum Source {
    /// A vertex output by its slot, interpolated.
    Perspective(usize),
    Linear(usize),
    /// A vertex output by its slot, of the first vertex.
    Flat(usize),
    /// A component of the position.
    Position(usize),
    /// The weight of a corner; perspective-correct or linear on screen.
    Barycentric(usize, bool),
    /// Whether the front is seen.
    Front,
    /// The triangle's place in the mesh.
    Primitive,
    Constant(u32),
}

impl Source {
    fn of(slot: &Slot, outputs: &[Slot]) -> Self {
        let wanted = match slot.binding {
            Binding::BuiltIn(BuiltIn::Position { .. }) => return Source::Position(slot.component),
            Binding::BuiltIn(BuiltIn::FrontFacing) => return Source::Front,
            Binding::BuiltIn(BuiltIn::PrimitiveIndex) => return Source::Primitive,
            Binding::BuiltIn(BuiltIn::Barycentric { perspective }) => {
                return Source::Barycentric(slot.component.min(2), perspective);
            }
            Binding::BuiltIn(BuiltIn::SampleMask) => return Source::Constant(1),
            Binding::BuiltIn(_) => return Source::Constant(0),
            Binding::Location { location, .. } => location,
        };
        let output = outputs.iter().position(|output| {
            matches!(output.binding, Binding::Location { location, .. } if location == wanted)
                && output.component == slot.component
        });
        match (output, slot.kind, slot.interpolation) {
            (None, ..) => Source::Constant(0),
            (Some(output), ScalarKind::Float, None | Some(Interpolation::Perspective)) => {
                Source::Perspective(output)
            }
            (Some(output), ScalarKind::Float, Some(Interpolation::Linear)) => {
                Source::Linear(output)
            }
            (Some(output), ..) => Source::Flat(output),
        }
    }
}

/// Where a lane is on its triangle.
struct Fragment {
    perspective: [f64; 3],
    linear: [f64; 3],
    /// The built-in: x and y in pixels, depth, one over w.
    position: [f32; 4],
}

impl Fragment {
    /// The fragment of pixel `own`, with the values of the triangle at pixel `at`.
    fn new(
        triangle: &Triangle,
        own: (u32, u32),
        at: (u32, u32),
        linear: bool,
        target: &Target,
    ) -> Self {
        let in_pixels =
            |fine: u32, i: usize| (fine as f32 + 0.5) / target.grid as f32 + target.offset[i];
        Self {
            perspective: triangle.perspective(at.0, at.1),
            linear: if linear {
                triangle.linear(at.0, at.1)
            } else {
                [0.0; 3]
            },
            position: [
                in_pixels(own.0, 0),
                in_pixels(own.1, 1),
                triangle.depth(at.0, at.1).unwrap_or(1.0),
                triangle.inverse_w(at.0, at.1) as f32,
            ],
        }
    }
}

/// The pixels of a quad whose bits are set.
pub(super) fn pixels(x: u32, y: u32, mask: u8) -> impl Iterator<Item = (u32, u32)> {
    (0..4)
        .filter(move |i| mask >> i & 1 == 1)
        .map(move |i| (x + (i & 1), y + (i >> 1)))
}

fn steps(from: u32, to: u32, step: u32) -> impl Iterator<Item = u32> + Clone {
    (from..to).step_by(step as usize)
}
