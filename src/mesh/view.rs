//! A picture of a mesh from one side, kept up to date while the mesh loses edges: only squares that change are drawn again.

use super::{Subject, Triangles};
use crate::error::{BACKGROUNDS, GRID, Means, ReferencePixel, Shown, colours};
use crate::eval::draw::{Shading, shade_lit};
use crate::eval::raster::{Coverage, Frame, Retained, Squares, rasterize};

/// A picture, and what it should show.
pub(super) struct View {
    frame: Frame,
    retained: Retained,
    /// Whether something lights the picture as a whole, so that no part of it can be drawn alone.
    is_lit: bool,
    reference: Vec<ReferencePixel>,
    /// How many pixels the reference covers.
    coverage: f64,
    /// What is shown of the whole mesh, at the same samples.
    original: Vec<Shown>,
    picture: Picture,
}

/// For each pixel of a picture, or of some squares of it, how wrong it is.
#[derive(Clone, PartialEq)]
pub(super) struct Picture {
    /// The squared difference from the reference, the mean over backgrounds and channels.
    errors: Vec<f32>,
    /// The same from the whole mesh's picture with the same samples, which aliases alike.
    changes: Vec<f32>,
    /// The depth of what is seen; where nothing is, or where depths say nothing of what is seen, 1.
    depths: Vec<f32>,
}

/// What was drawn of some squares.
pub(super) struct Drawn {
    pub(super) coverage: Coverage,
    /// What a display shows of every pixel; outside of the squares anything.
    pub(super) shown: Vec<Shown>,
}

impl View {
    /// A frame of what is drawn, with its reference, the original's frame at 4 x 4 samples a pixel, and the picture of what is drawn with its
    /// whole mesh.
    pub(super) fn new(
        original: (&Subject<'_>, &Frame),
        subject: &Subject<'_>,
        frame: Frame,
    ) -> Self {
        let fine = Frame {
            offset: [0.0; 2],
            grid: GRID,
            ..original.1.clone()
        };
        let coverage = rasterize(original.0.vertex, original.0.fragment, &fine);
        let shading = shade(original.0, &fine, &coverage);
        let means = Means::of(&coverage, &shading, subject.scene.output);
        let covered = means.covered();
        let pixels = covered.len();
        let mut view = Self {
            retained: Retained::new(subject.vertex, subject.fragment, &frame),
            is_lit: subject.scene.lighting.is_some(),
            reference: (0..pixels).map(|at| means.pixel(at)).collect(),
            coverage: covered.iter().map(|c| f64::from(*c)).sum(),
            original: vec![BACKGROUNDS; pixels],
            picture: Picture {
                errors: vec![0.0; pixels],
                changes: vec![0.0; pixels],
                depths: vec![1.0; pixels],
            },
            frame,
        };
        let (whole, squares) = (Triangles::whole(&view.frame.mesh), view.squares(true));
        let of_whole = (&view.retained, &view.frame);
        let drawn = view.draw(subject, of_whole, &whole, &squares);
        view.original.clone_from(&drawn.shown);
        view.picture = view.judge(&drawn, &squares);
        view
    }

    /// The sum of the errors of another subject with its whole mesh, in a frame from the same side.
    pub(super) fn error_of(&self, subject: &Subject<'_>, frame: &Frame) -> f64 {
        let retained = Retained::new(subject.vertex, subject.fragment, frame);
        let (whole, squares) = (Triangles::whole(&frame.mesh), self.squares(true));
        let drawn = self.draw(subject, (&retained, frame), &whole, &squares);
        self.judge(&drawn, &squares).error()
    }

    /// How many pixels the reference covers.
    pub(super) fn coverage(&self) -> f64 {
        self.coverage
    }

    /// The frame, with the original's mesh.
    pub(super) fn frame(&self) -> &Frame {
        &self.frame
    }

    /// Where the vertices of the original are seen.
    pub(super) fn retained(&self) -> &Retained {
        &self.retained
    }

    /// Width and height in pixels.
    pub(super) fn size(&self) -> [u32; 2] {
        self.retained.size()
    }

    /// Squares of the picture, all or none; all where no part can be drawn alone.
    pub(super) fn squares(&self, marked: bool) -> Squares {
        Squares::new(self.size(), marked || self.is_lit)
    }

    /// Draws some squares with these triangles, with vertices as another frame of the same mesh has them.
    pub(super) fn draw(
        &self,
        subject: &Subject<'_>,
        (retained, frame): (&Retained, &Frame),
        triangles: &Triangles,
        squares: &Squares,
    ) -> Drawn {
        let (spots, size) = (retained.on_screen(), self.size());
        let is_near = |corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|vertex| spots.get(vertex as usize).copied().flatten());
            let (Some(a), Some(b), Some(c)) = (a, b, c) else {
                return true;
            };
            let low = [0, 1].map(|i| a.at[i].min(b.at[i]).min(c.at[i]));
            let high = [0, 1].map(|i| a.at[i].max(b.at[i]).max(c.at[i]));
            let around = Squares::around(size, low, high);
            around.is_some_and(|around| squares.any(&around))
        };
        let draws = frame.mesh.draws();
        let draws = draws.iter().map(|draw| {
            let own = triangles.0.get(draw.triangles.clone()).unwrap_or_default();
            let left = (0..).zip(own);
            let left = left.filter_map(|(number, corners)| Some((number, (*corners)?)));
            left.filter(|(_, corners)| is_near(corners)).collect()
        });
        let coverage = retained.cover(&draws.collect::<Vec<_>>(), squares);
        let shading = shade(subject, frame, &coverage);
        let shown = colours(
            &coverage,
            &shading,
            (self.reference.len(), |_, pixel| pixel),
            subject.scene.output,
        );
        Drawn { coverage, shown }
    }

    /// How wrong some squares are with these triangles; outside of them, anything.
    pub(super) fn look(
        &self,
        subject: &Subject<'_>,
        triangles: &Triangles,
        squares: &Squares,
    ) -> Picture {
        let drawn = self.draw(subject, (&self.retained, &self.frame), triangles, squares);
        self.judge(&drawn, squares)
    }

    /// How wrong some squares are of what was drawn of them.
    fn judge(&self, drawn: &Drawn, squares: &Squares) -> Picture {
        let square = |six: [f32; 6]| six.iter().map(|d| d * d).sum::<f32>() / 6.0;
        let pixels = self.reference.len();
        let (mut errors, mut changes) = (vec![0.0; pixels], vec![0.0; pixels]);
        // Most of the time few of them are marked.
        for pixel in squares.pixels(self.size()) {
            let (reference, shown) = (&self.reference[pixel], &drawn.shown[pixel]);
            let is_nothing = shown == &BACKGROUNDS && reference.over() == BACKGROUNDS;
            if !is_nothing {
                errors[pixel] = square(reference.difference(shown));
            }
            let original = &self.original[pixel];
            if original != shown {
                changes[pixel] = square(std::array::from_fn(|i| {
                    let change = shown[i / 3][i % 3] - original[i / 3][i % 3];
                    // As wrong as a colour can be.
                    if change.is_nan() { 1.0 } else { change }
                }));
            }
        }
        let mut depths = vec![1.0; pixels];
        if !self.retained.is_layered() && !self.is_lit {
            for (pixel, depth, _) in drawn.coverage.triangles() {
                depths[pixel as usize] = depth;
            }
        }
        Picture {
            errors,
            changes,
            depths,
        }
    }

    /// The picture as it is.
    pub(super) fn picture(&self) -> &Picture {
        &self.picture
    }

    /// Takes another picture for what it shows.
    pub(super) fn show(&mut self, picture: Picture) {
        self.picture = picture;
    }

    /// The same within a box of squares.
    pub(super) fn show_part(&mut self, picture: &Picture, of: &Part) {
        for at in of.pixels(self.size()) {
            self.picture.errors[at] = picture.errors[at];
            self.picture.changes[at] = picture.changes[at];
            self.picture.depths[at] = picture.depths[at];
        }
    }
}

/// A box of squares of 2 x 2 pixels, first and last column and row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Part(pub(super) [std::ops::RangeInclusive<u32>; 2]);

impl Part {
    /// The places of its pixels in a picture of a size.
    pub(super) fn pixels(&self, [width, height]: [u32; 2]) -> impl Iterator<Item = usize> + use<> {
        let range = |i: usize, most: u32| {
            let squares = &self.0[i];
            2 * squares.start()..(2 * squares.end() + 2).min(most)
        };
        let (columns, rows) = (range(0, width), range(1, height));
        rows.flat_map(move |y| columns.clone().map(move |x| (y * width + x) as usize))
    }
}

impl Picture {
    /// The sum of its errors.
    pub(super) fn error(&self) -> f64 {
        self.errors.iter().map(|e| f64::from(*e)).sum()
    }

    /// The sum of its changes.
    pub(super) fn change(&self) -> f64 {
        self.changes.iter().map(|e| f64::from(*e)).sum()
    }

    /// The sum of its errors within a part.
    pub(super) fn error_of(&self, part: &Part, size: [u32; 2]) -> f64 {
        part.pixels(size).map(|at| f64::from(self.errors[at])).sum()
    }

    /// The sum of its changes within a part.
    pub(super) fn change_of(&self, part: &Part, size: [u32; 2]) -> f64 {
        part.pixels(size)
            .map(|at| f64::from(self.changes[at]))
            .sum()
    }

    /// How far away the farthest thing is that is seen within a part.
    pub(super) fn farthest(&self, part: &Part, size: [u32; 2]) -> f32 {
        part.pixels(size)
            .map(|at| self.depths[at])
            .fold(0.0, f32::max)
    }
}

fn shade(subject: &Subject<'_>, frame: &Frame, coverage: &Coverage) -> Shading {
    let lit = subject.scene.lit(frame, coverage);
    let mut shading = Shading::default();
    shade_lit(
        lit.as_ref(),
        subject.fragment,
        coverage,
        &frame.bindings,
        &mut shading,
    );
    shading
}
