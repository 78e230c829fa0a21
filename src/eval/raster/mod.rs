//! The rasteriser: triangles to quads of fragments, with depth, near clipping and perspective-correct inputs.
//!
//! ```text
//! Frame x vertex Program --vertices--> clip positions and varyings
//!   --triangle--> which pixels each triangle covers
//!   --quads--> Coverage: blocks of 64 quads, the fragment program's inputs ready in them
//! ```
//!
//! WebGPU's rules: clip space has y up and z in 0..1, the framebuffer has y down; depth is tested with
//! `less` against a buffer of f32 cleared to 1; nothing is culled; front faces are counter-clockwise on screen.
//! Positions are snapped to 1/256 pixel for coverage (top-left rule) and exact for interpolation.

mod more;
mod part;
mod quads;
#[cfg(feature = "mesh")]
mod retained;
mod shape;
mod spots;
#[cfg(test)]
mod tests;
mod triangle;
mod vertices;

pub(crate) use quads::Quad;
#[cfg(feature = "mesh")]
pub(crate) use retained::{Retained, Squares};
pub(crate) use shape::{Shape, shape};
pub(crate) use spots::{Spot, on_spots};
#[cfg(feature = "gpu")]
pub(crate) use vertices::attribute;
pub(crate) use vertices::{hand_over_the_same, profile as vertex_profile};

use super::draw::{Blend, DrawState, state_of};
use super::generated::Store;
use super::lane::{LANES, Mask, Words};
use super::machine::{Bindings, Profile, Recall};
use super::program::{Program, Slot};
use crate::scene::camera::Shot;
use crate::scene::mesh::Mesh;
use naga::{Binding, BuiltIn};
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

/// The longest edge of a frame in fine pixels (`width * grid`).
pub const MAX_EDGE: u32 = 16_384;

/// What feeds a vertex input. Components that the mesh does not have, and attributes that
/// it has none of, read as (0, 0, 0, 1). Integer inputs get the value converted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Attribute {
    /// Object-space position.
    Position,
    /// Normal.
    Normal,
    /// Texture coordinates.
    Uv,
    /// The second set of texture coordinates; where the mesh has none, the first.
    SecondUv,
    /// Tangent, with the sign of the bitangent in w.
    Tangent,
    /// The bitangent: the normal times the tangent, with its sign.
    Bitangent,
    /// The sign of the bitangent alone.
    BitangentSign,
    /// Colour.
    Colour,
    /// The same words for every vertex, in the input's own kind.
    Fixed([u32; 4]),
}

/// One picture to draw.
#[derive(Clone, Debug)]
pub struct Frame {
    /// The triangles.
    pub mesh: Arc<Mesh>,
    /// Which attribute feeds each vertex-input location; other locations read (0, 0, 0, 1).
    pub attributes: BTreeMap<u32, Attribute>,
    /// The resources of both stages.
    pub bindings: Bindings,
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Where in a pixel it is sampled, from the centre, in pixels, -0.5..0.5.
    pub offset: [f32; 2],
    /// How many fine pixels a pixel has along each axis: 1 to draw, 4 for the reference.
    /// Derivatives are those between fine pixels.
    pub grid: u32,
    /// How each of the mesh's draws gets into the picture; one beyond the last is as the last, and without any all
    /// is opaque.
    pub states: Arc<[DrawState]>,
    /// What it is a picture of.
    pub shot: Shot,
    /// The textures that were made of its own.
    pub baked: Store,
}

/// What a frame shows before it is shaded: fragments in a fixed order, with the inputs of the fragment program.
#[derive(Clone, Debug)]
pub struct Coverage {
    /// Width in fine pixels.
    pub width: u32,
    /// Height in fine pixels.
    pub height: u32,
    /// Fine pixels to a pixel, along each axis.
    pub grid: u32,
    /// The fragments, 64 quads a block, draw by draw; they all are full but the last of each draw.
    pub blocks: Vec<Block>,
    /// How many fragments are covered, in all blocks.
    pub fragments: usize,
    /// The same in the whole picture, where this is a part of it.
    pub drawn: usize,
    /// What each word of [`Block::inputs`] is: the fragment program's inputs.
    pub slots: Vec<Slot>,
    /// Whether fragments hide each other only after shading, since the shader may discard them or move their
    /// depth. If not, each pixel has one covered fragment of opaque draws at most, in tiles of 16 x 16 pixels, and
    /// those of blended draws that it does not hide, in the order of the triangles.
    /// If so, all of a pixel's fragments are here, in the order of the triangles.
    pub late: bool,
    /// As [`Frame::states`].
    pub states: Arc<[DrawState]>,
    /// What the vertex program executed.
    pub vertex_profile: Profile,
}

/// 64 quads of fragments.
#[derive(Clone, Debug)]
pub struct Block {
    /// One entry per slot of [`Coverage::slots`].
    pub inputs: Vec<Words>,
    /// The lanes that run: all four of every quad.
    pub active: Mask,
    /// The fragments that count; the other active lanes are helpers, their inputs extrapolated.
    pub covered: Mask,
    /// The pixel of each covered lane, `y * width + x` in fine pixels; `u32::MAX` for the others.
    pub pixels: Words,
    /// The depth of each active lane, 0..1 where covered.
    pub depths: [f32; LANES],
    /// Which of the mesh's draws it is of.
    pub draw: usize,
    /// The place of the first covered fragment among all of [`Coverage::fragments`].
    pub first: usize,
    /// Where its quads are, in their order.
    pub(crate) quads: Vec<Quad>,
    /// What is remembered of the textures between the programs that are run over it.
    pub recall: Option<Arc<Recall>>,
}

/// Runs the vertex program over the mesh and finds the fragments of the frame.
///
/// # Panics
/// When a resource of the vertex program is not bound, `grid` is 0, or the frame is larger than [`MAX_EDGE`].
pub fn rasterize(vertex: &Program, fragment: &Program, frame: &Frame) -> Coverage {
    let vertices = vertices::run(vertex, frame);
    cover(
        vertices,
        vertex.outputs(),
        fragment.inputs(),
        &frame.mesh,
        &Target::of(frame),
        (is_late(fragment), &frame.states),
    )
}

/// Whether fragments of a program hide each other only after shading.
fn is_late(fragment: &Program) -> bool {
    fragment.discards()
        || fragment.outputs().iter().any(|slot| {
            matches!(
                slot.binding,
                Binding::BuiltIn(BuiltIn::FragDepth | BuiltIn::SampleMask)
            )
        })
}

/// The fragments of a mesh's triangles whose vertices have been shaded.
fn cover(
    vertices: vertices::Vertices,
    outputs: &[Slot],
    inputs: &[Slot],
    mesh: &Mesh,
    target: &Target,
    (late, states): (bool, &Arc<[DrawState]>),
) -> Coverage {
    let all = Triangles::of(&vertices.positions, mesh, target, states);
    all.cover(&vertices, [outputs, inputs], target, (late, states), |_| {
        true
    })
}

/// The triangles of a mesh that may cover something, draw by draw.
struct Triangles {
    triangles: Vec<triangle::Triangle>,
    /// Where the triangles of each draw end.
    ends: Vec<usize>,
    /// Those of blended draws.
    blended: Vec<Range<usize>>,
}

impl Triangles {
    /// All of a mesh.
    fn of(positions: &[[f32; 4]], mesh: &Mesh, target: &Target, states: &Arc<[DrawState]>) -> Self {
        let draws = mesh.draws().into_iter().map(|draw| {
            let indices = mesh
                .indices
                .get(3 * draw.triangles.start..3 * draw.triangles.end);
            let corners = indices.unwrap_or_default().chunks_exact(3);
            (0..).zip(corners.map(|corners| [corners[0], corners[1], corners[2]]))
        });
        Self::of_draws(positions, draws, target, states)
    }

    /// Some of each draw: their numbers in the draw, and their vertices.
    fn of_draws(
        positions: &[[f32; 4]],
        draws: impl Iterator<Item = impl Iterator<Item = (u32, [u32; 3])>>,
        target: &Target,
        states: &[DrawState],
    ) -> Self {
        let mut all = Self {
            triangles: Vec::new(),
            ends: Vec::new(),
            blended: Vec::new(),
        };
        for (number, draw) in draws.enumerate() {
            let state = state_of(states, number);
            let first = all.triangles.len();
            all.triangles.extend(draw.filter_map(|(index, corners)| {
                triangle::Triangle::new(index, corners, positions, target)
                    .filter(|triangle| triangle.front || !state.front_only)
            }));
            all.ends.push(all.triangles.len());
            if state.blend != Blend::Opaque {
                all.blended.push(first..all.triangles.len());
            }
        }
        all
    }

    /// Their fragments, of the quads that are kept, from the outputs of the vertex program for the inputs of the fragment
    /// program.
    fn cover(
        &self,
        vertices: &vertices::Vertices,
        [outputs, inputs]: [&[Slot]; 2],
        target: &Target,
        (late, states): (bool, &Arc<[DrawState]>),
        keep: impl Fn(&Quad) -> bool,
    ) -> Coverage {
        let mut quads = if late {
            quads::in_order(&self.triangles)
        } else {
            quads::visible(&self.triangles, &self.blended, target)
        };
        quads.retain(keep);
        let quads = quads::by_draw(quads, &self.ends);
        let blocks = quads::blocks(&quads, &self.triangles, vertices, outputs, inputs, target);
        let fragments = blocks.last().map_or(0, |b| b.first + b.covered_count());
        Coverage {
            width: target.width,
            height: target.height,
            grid: target.grid,
            blocks,
            fragments,
            drawn: fragments,
            slots: inputs.to_vec(),
            late,
            states: states.clone(),
            vertex_profile: vertices.profile.clone(),
        }
    }
}

impl Coverage {
    /// How a draw gets into the picture.
    pub(crate) fn state(&self, draw: usize) -> DrawState {
        state_of(&self.states, draw)
    }

    /// From now on what programs read of textures is remembered, which takes some 200 KiB a block. All are to be run with
    /// the same resources, which live as long as this.
    pub(crate) fn remember(&mut self) {
        for block in &mut self.blocks {
            block.recall = Some(Arc::default());
        }
    }

    /// Whether fragments are blended.
    pub fn blends(&self) -> bool {
        let mut states = self.states.iter();
        states.any(|state| state.blend != Blend::Opaque)
    }
}

impl Block {
    /// How many of its lanes are covered.
    pub fn covered_count(&self) -> usize {
        self.covered
            .0
            .iter()
            .map(|word| word.count_ones() as usize)
            .sum()
    }
}

/// The grid of fine pixels that triangles are drawn to.
struct Target {
    /// In fine pixels.
    width: u32,
    /// In fine pixels.
    height: u32,
    /// Fine pixels to a pixel.
    grid: u32,
    /// Where a fine pixel is sampled, from its centre, in pixels.
    offset: [f32; 2],
}

impl Target {
    fn of(frame: &Frame) -> Self {
        assert!(frame.grid > 0, "a grid has at least one cell");
        let [width, height] = [frame.width, frame.height].map(|n| {
            n.checked_mul(frame.grid)
                .filter(|&n| n <= MAX_EDGE)
                .expect("a frame is no larger than MAX_EDGE")
        });
        Self {
            width,
            height,
            grid: frame.grid,
            offset: frame.offset,
        }
    }
}
