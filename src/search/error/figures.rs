//! The figures of a level: its own, those of the original, and how much of its bound it uses up.

use super::tally::{ErrorSum, FrameError};

/// How many times the bound the worst view and the worst tile may exceed, and a level shimmer.
const VIEW_FACTOR: f64 = 2.0;
const TILE_FACTOR: f64 = 4.0;
const SHIMMER_FACTOR: f64 = 0.5;

/// What was measured of one program over a set of frames.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Details {
    /// Over all frames.
    pub error: ErrorSum,
    /// For each view, over its frames.
    pub(crate) views: Vec<ErrorSum>,
    /// For each tile of each frame, `E^2`.
    pub(crate) tiles: Vec<f64>,
    /// The square of the shimmer: the variance of a displayed colour from offset to offset, averaged over
    /// the frames, covered pixels, backgrounds and channels. 0 when there is one offset.
    pub(crate) variance: f64,
}

impl Details {
    /// From the frames in their order, each with its view.
    pub(crate) fn new(frames: impl IntoIterator<Item = (usize, FrameError)>) -> Self {
        let mut details = Self::default();
        let (mut variance, mut coverage) = (0.0, 0.0);
        for (view, frame) in frames {
            details.error.merge(&frame.sum);
            if details.views.len() <= view {
                details.views.resize(view + 1, ErrorSum::default());
            }
            details.views[view].merge(&frame.sum);
            details.tiles.extend(frame.tiles);
            variance += frame.variance;
            coverage += frame.coverage;
        }
        if coverage > 0.0 {
            details.variance = variance / coverage;
        }
        details
    }

    /// The shimmer: the root of the mean variance from offset to offset.
    pub fn shimmer(&self) -> f64 {
        self.variance.sqrt()
    }
}

/// The error of a level at its distance, in units of displayed colour, 0..1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorFigures {
    /// E(v): root mean square difference of the level from the reference.
    pub rmse: f64,
    /// E(o): that of the original, which aliases.
    pub floor: f64,
    /// The bound `e_a(d)` on the excess.
    pub bound: f64,
    /// The largest difference of a channel of a pixel.
    pub max: f64,
    /// The largest excess of one view.
    pub worst_view: f64,
    /// The largest excess of one tile of 8 x 8 pixels of one frame.
    pub worst_tile: f64,
    /// Standard deviation of a pixel from offset to offset.
    pub shimmer: f64,
    /// That of the original.
    pub shimmer_floor: f64,
}

impl ErrorFigures {
    /// From what was measured of the level and of the original, over the same frames.
    pub(crate) fn new(level: &Details, original: &Details, bound: f64) -> Self {
        let worst = |pairs: &mut dyn Iterator<Item = (f64, f64)>| {
            pairs.map(|(v, o)| v - o).fold(0.0_f64, f64::max).sqrt()
        };
        let views = level.views.iter().zip(&original.views);
        let tiles = level.tiles.iter().zip(&original.tiles);
        Self {
            rmse: level.error.square().sqrt(),
            floor: original.error.square().sqrt(),
            bound,
            max: f64::from(level.error.max),
            worst_view: worst(&mut views.map(|(v, o)| (v.square(), o.square()))),
            worst_tile: worst(&mut tiles.map(|(v, o)| (*v, *o))),
            shimmer: level.shimmer(),
            shimmer_floor: original.shimmer(),
        }
    }

    /// What the level adds to the original's own error: sqrt(max(0, rmse^2 - floor^2)).
    pub fn excess(&self) -> f64 {
        (self.rmse * self.rmse - self.floor * self.floor)
            .max(0.0)
            .sqrt()
    }

    /// Peak signal-to-noise ratio of the level, in decibels; infinite when it equals the reference.
    pub fn psnr(&self) -> f64 {
        -20.0 * self.rmse.log10()
    }

    /// How much of its bound the level uses up, the most of four: the excess over `e_a`, that of the worst
    /// view over `2 e_a`, that of the worst tile over `4 e_a`, and what it shimmers more than the original over
    /// `e_a / 2`. It is feasible when this is at most 1.
    pub fn strain(&self) -> f64 {
        let share = |what: f64, factor: f64| {
            let limit = factor * self.bound;
            if what <= 0.0 {
                0.0
            } else if limit > 0.0 {
                what / limit
            } else {
                f64::INFINITY
            }
        };
        share(self.excess(), 1.0)
            .max(share(self.worst_view, VIEW_FACTOR))
            .max(share(self.worst_tile, TILE_FACTOR))
            .max(share(self.shimmer - self.shimmer_floor, SHIMMER_FACTOR))
    }
}
