//! How much of a frame a device shades: fragments that pass the depth test when their turn comes, in quads with helper
//! lanes, and in the blocks of 4 x 4 pixels that a program on a CPU draws at once.

use super::quads::pixels;
use super::triangle::Triangle;
use super::{Frame, Target, Triangles, vertices};
use crate::eval::program::Program;

/// What a device shades of one frame. Triangles are tested in their order, so that a fragment counts that another one
/// hides later.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Shape {
    /// Fragments.
    pub(crate) fragments: u64,
    /// Squares of 2 x 2 pixels that are shaded for one triangle.
    pub(crate) quads: u64,
    /// Squares of 4 x 4 pixels that are shaded for one triangle.
    pub(crate) stamps: u64,
    /// Triangles that may cover something.
    pub(crate) triangles: u64,
}

/// The shape of a frame, where a vertex program says the positions.
///
/// # Panics
/// As [`super::rasterize`].
pub(crate) fn shape(vertex: &Program, frame: &Frame) -> Shape {
    let vertices = vertices::run(vertex, frame);
    let target = Target::of(frame);
    let all = Triangles::of(&vertices.positions, &frame.mesh, &target, &frame.states);
    Shape::of(&all, &target)
}

impl Shape {
    pub(super) fn of(all: &Triangles, target: &Target) -> Self {
        let mut nearest = vec![1.0_f32; target.width as usize * target.height as usize];
        let mut shape = Self {
            triangles: all.triangles.len() as u64,
            ..Self::default()
        };
        for (i, triangle) in all.triangles.iter().enumerate() {
            let writes = !all.blended.iter().any(|range| range.contains(&i));
            shape.add(triangle, writes, &mut nearest, target.width);
        }
        shape
    }

    /// Draws a triangle; `nearest` are the depths that it is tested against, and that it changes where it `writes`.
    fn add(&mut self, triangle: &Triangle, writes: bool, nearest: &mut [f32], width: u32) {
        let mut stamps = Vec::new();
        triangle.scan(|x, y, mask| {
            let before = self.fragments;
            for (x, y) in pixels(x, y, mask) {
                let seen = &mut nearest[(y * width + x) as usize];
                if let Some(depth) = triangle.depth(x, y).filter(|depth| depth < seen) {
                    self.fragments += 1;
                    if writes {
                        *seen = depth;
                    }
                }
            }
            if self.fragments > before {
                self.quads += 1;
                stamps.push((y / 4, x / 4));
            }
        });
        stamps.sort_unstable();
        stamps.dedup();
        self.stamps += stamps.len() as u64;
    }
}
