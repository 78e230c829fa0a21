//! A frame that is drawn again and again while its mesh loses triangles: its vertices are shaded once, and only some squares
//! of the picture are drawn anew.

use super::{Coverage, Frame, Target, Triangles, is_late, vertices};
use crate::eval::draw::{Blend, DrawState};
use crate::eval::program::{Program, Slot};
use std::ops::RangeInclusive;
use std::sync::Arc;

/// A frame whose vertices have been shaded.
pub(crate) struct Retained {
    vertices: vertices::Vertices,
    outputs: Vec<Slot>,
    inputs: Vec<Slot>,
    target: Target,
    late: bool,
    states: Arc<[DrawState]>,
    on_screen: Vec<Option<OnScreen>>,
}

/// Where a vertex is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct OnScreen {
    /// In fine pixels from the left and from the top.
    pub(crate) at: [f32; 2],
    /// 0 at the near plane, 1 at the far one.
    pub(crate) depth: f32,
}

/// Some of the squares of 2 x 2 fine pixels of a picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Squares {
    across: u32,
    down: u32,
    marks: Vec<bool>,
}

/// A box of such squares: columns and rows.
pub(crate) type SquareBox = [RangeInclusive<u32>; 2];

impl Squares {
    /// None of a picture's, or all.
    pub(crate) fn new([width, height]: [u32; 2], marked: bool) -> Self {
        let (across, down) = (width.div_ceil(2), height.div_ceil(2));
        Self {
            across,
            down,
            marks: vec![marked; across as usize * down as usize],
        }
    }

    /// The squares of a picture of a size that may show something of what is seen within a box of places; none when that is outside
    /// of the picture.
    pub(crate) fn around(size: [u32; 2], low: [f32; 2], high: [f32; 2]) -> Option<SquareBox> {
        let range = |i: usize| {
            let count = size[i].div_ceil(2);
            // A centre half a pixel away may be covered, since corners are snapped.
            let first = ((low[i] - 0.5) / 2.0).floor().max(0.0);
            let last = ((high[i] + 0.5) / 2.0).floor().min(count as f32 - 1.0);
            (first <= last).then_some(first as u32..=last as u32)
        };
        Some([range(0)?, range(1)?])
    }

    fn row(&self, row: u32, columns: &RangeInclusive<u32>) -> std::ops::Range<usize> {
        let start = row as usize * self.across as usize;
        start + *columns.start() as usize..start + *columns.end() as usize + 1
    }

    /// Whether one of a box is marked.
    pub(crate) fn any(&self, [columns, rows]: &SquareBox) -> bool {
        let mut rows = rows.clone();
        rows.any(|row| self.marks[self.row(row, columns)].contains(&true))
    }

    /// Marks a box.
    pub(crate) fn mark(&mut self, [columns, rows]: &SquareBox) {
        for row in rows.clone() {
            let range = self.row(row, columns);
            self.marks[range].fill(true);
        }
    }

    /// Whether the square of a fine pixel is marked.
    pub(crate) fn has(&self, x: u32, y: u32) -> bool {
        self.marks[(y / 2) as usize * self.across as usize + (x / 2) as usize]
    }

    /// The places of the pixels of marked squares in a picture of a size.
    pub(crate) fn pixels(&self, [width, height]: [u32; 2]) -> impl Iterator<Item = usize> {
        let marked = self.marks.iter().enumerate().filter(|(_, marked)| **marked);
        let corners = marked.map(|(at, _)| at as u32);
        let corners = corners.map(|at| [2 * (at % self.across), 2 * (at / self.across)]);
        corners.flat_map(move |[x, y]| {
            let rows = y..(y + 2).min(height);
            rows.flat_map(move |y| (x..(x + 2).min(width)).map(move |x| (y * width + x) as usize))
        })
    }

    /// Whether none is marked.
    pub(crate) fn is_empty(&self) -> bool {
        !self.marks.contains(&true)
    }
}

impl Retained {
    /// Shades the vertices of a frame.
    ///
    /// # Panics
    /// As [`super::rasterize`].
    pub(crate) fn new(vertex: &Program, fragment: &Program, frame: &Frame) -> Self {
        let vertices = vertices::run(vertex, frame);
        let target = Target::of(frame);
        let [width, height] = [target.width, target.height].map(f64::from);
        let on_screen = vertices.positions.iter().map(|position| {
            let [x, y, z, w] = position.map(f64::from);
            let grid = f64::from(target.grid);
            let at = [
                0.5 * (x / w + 1.0) * width - f64::from(target.offset[0]) * grid,
                0.5 * (1.0 - y / w) * height - f64::from(target.offset[1]) * grid,
            ];
            let depth = z / w;
            let is_seen = w > 0.0 && depth >= 0.0 && at.iter().all(|c| c.is_finite());
            is_seen.then_some(OnScreen {
                at: at.map(|c| c as f32),
                depth: depth as f32,
            })
        });
        Self {
            on_screen: on_screen.collect(),
            outputs: vertex.outputs().to_vec(),
            inputs: fragment.inputs().to_vec(),
            late: is_late(fragment),
            states: frame.states.clone(),
            vertices,
            target,
        }
    }

    /// Where each vertex of the mesh is seen; none that is not before the near plane.
    pub(crate) fn on_screen(&self) -> &[Option<OnScreen>] {
        &self.on_screen
    }

    /// Width and height in fine pixels.
    pub(crate) fn size(&self) -> [u32; 2] {
        [self.target.width, self.target.height]
    }

    /// Whether a picture's depth says nothing of what is seen: fragments are blended, or hide each other after shading.
    pub(crate) fn is_layered(&self) -> bool {
        let mut states = self.states.iter();
        self.late || states.any(|state| state.blend != Blend::Opaque)
    }

    /// The fragments that some triangles have in some squares: for each draw of the mesh the number of each triangle in the
    /// draw, and its vertices. Only triangles that may be seen in these squares need be given.
    pub(crate) fn cover(&self, draws: &[Vec<(u32, [u32; 3])>], squares: &Squares) -> Coverage {
        let draws = draws.iter().map(|draw| draw.iter().copied());
        let positions = &self.vertices.positions;
        let some = Triangles::of_draws(positions, draws, &self.target, &self.states);
        some.cover(
            &self.vertices,
            [&self.outputs, &self.inputs],
            &self.target,
            (self.late, &self.states),
            |quad| quad.is_in(squares),
        )
    }
}
