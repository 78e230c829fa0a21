//! The figures of a level: its own, those of the original, and how much of its bound it uses up.

use super::tally::{ErrorSum, FrameError};
use lodc_passes::autolod::BoundReading;

/// How many times the bound the worst view and the worst tile may exceed, and a level shimmer.
const VIEW_FACTOR: f64 = 2.0;
const TILE_FACTOR: f64 = 4.0;
const SHIMMER_FACTOR: f64 = 0.5;

/// What was measured of one program over a set of frames.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Details {
    /// Over all frames.
    pub error: ErrorSum,
    /// For each frame.
    pub(crate) frames: Vec<ErrorSum>,
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
            details.frames.push(frame.sum);
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
#[non_exhaustive]
pub struct ErrorFigures {
    /// E(v): root mean square difference of the level from the reference.
    pub rmse: f64,
    /// E(o): that of the original, which aliases.
    pub floor: f64,
    /// The bound `e_a(d)`.
    pub bound: f64,
    /// How it is read.
    pub reading: BoundReading,
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
    pub(crate) fn new(
        level: &Details,
        original: &Details,
        (bound, reading): (f64, BoundReading),
    ) -> Self {
        let worst = |pairs: &mut dyn Iterator<Item = (f64, f64)>| {
            pairs.map(|(v, o)| v - o).fold(0.0_f64, f64::max).sqrt()
        };
        let views = level.views.iter().zip(&original.views);
        let tiles = level.tiles.iter().zip(&original.tiles);
        Self {
            rmse: level.error.square().sqrt(),
            floor: original.error.square().sqrt(),
            bound,
            reading,
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
    /// `e_a / 2`. It is feasible when this is at most 1. In the paper's reading it is the error alone, with all of the
    /// original's own in it.
    pub fn strain(&self) -> f64 {
        if self.reading == BoundReading::Paper {
            return self.strain_of_means();
        }
        self.strain_of_means()
            .max(self.strain_of_tiles())
            .max(self.share(self.shimmer - self.shimmer_floor, SHIMMER_FACTOR))
    }

    /// The part of the strain that a few pixels of each frame tell: that of the excess and of the worst view.
    pub(crate) fn strain_of_means(&self) -> f64 {
        if self.reading == BoundReading::Paper {
            // The paper's norm sums three channels where E^2 is their mean; both sides are divided by the size on screen.
            return self.share(3.0 * self.rmse * self.rmse, 1.0);
        }
        self.share(self.excess(), 1.0)
            .max(self.share(self.worst_view, VIEW_FACTOR))
    }

    /// That of the worst tile, which only whole tiles tell.
    pub(crate) fn strain_of_tiles(&self) -> f64 {
        match self.reading {
            BoundReading::Excess => self.share(self.worst_tile, TILE_FACTOR),
            BoundReading::Paper => 0.0,
        }
    }

    /// `E^2` that a tile may have more than the original.
    pub(crate) fn tile_limit(&self) -> f64 {
        (TILE_FACTOR * self.bound).powi(2)
    }

    /// What part of its limit, some bounds, something uses up.
    fn share(&self, what: f64, bounds: f64) -> f64 {
        let limit = bounds * self.bound;
        if what <= 0.0 {
            0.0
        } else if limit > 0.0 {
            what / limit
        } else {
            f64::INFINITY
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::{BACKGROUNDS, Reference, ReferencePixel, Tally};

    /// What a picture of 4 x 4 pixels shows; `None` is background.
    type Colours = [Option<[f32; 3]>; 16];

    /// A reference of 4 x 4 pixels: linear grey (premultiplied) and coverage of each.
    fn reference(pixel: impl Fn(usize) -> (f32, f32)) -> Reference {
        Reference::new((0..16).map(|i| {
            let (grey, coverage) = pixel(i);
            let shown = ReferencePixel::new([grey; 3], [1.0 - coverage; 3]);
            ([i as u32 % 4, i as u32 / 4], shown, coverage)
        }))
    }

    fn details(reference: &Reference, drawings: &[Colours]) -> Details {
        Details::new([(0, frame(reference, drawings))])
    }

    fn frame(reference: &Reference, drawings: &[Colours]) -> FrameError {
        let mut tally = Tally::new(reference);
        for drawing in drawings {
            let shown = drawing.map(|colour| colour.map_or(BACKGROUNDS, |colour| [colour; 2]));
            tally.add(&shown);
        }
        tally.finish()
    }

    fn close(found: f64, by_hand: f64) {
        assert!((found - by_hand).abs() < 1e-6, "{found}, not {by_hand}");
    }

    const WHITE: Option<[f32; 3]> = Some([1.0; 3]);
    const BLACK: Option<[f32; 3]> = Some([0.0; 3]);

    #[test]
    fn error_maximum_and_psnr() {
        // A white square; four pixels are off by 0.5, 0.25 and 0 in the three channels.
        let white = reference(|_| (1.0, 1.0));
        let level: Colours = std::array::from_fn(|i| match i {
            0..4 => Some([0.5, 0.75, 1.0]),
            _ => WHITE,
        });
        let level = details(&white, &[level]);
        // 4 of 16 pixels, (0.25 + 0.0625 + 0) / 3 each.
        close(level.error.square(), 4.0 / 16.0 * 0.3125 / 3.0);
        let figures = ErrorFigures::new(
            &level,
            &details(&white, &[[WHITE; 16]]),
            (0.1, BoundReading::Excess),
        );
        close(figures.rmse, 0.161_374_3);
        close(figures.max, 0.5);
        // -10 log10(0.02604167)
        close(figures.psnr(), 15.843_312);
        assert_eq!((figures.floor, figures.shimmer), (0.0, 0.0));
    }

    #[test]
    fn coverage_counts_over_black_and_over_white() {
        // A black object that covers the left half; the level has lost one column of it.
        let half = reference(|i| (0.0, if i % 4 < 2 { 1.0 } else { 0.0 }));
        let level: Colours = std::array::from_fn(|i| if i % 4 == 0 { BLACK } else { None });
        let level = details(&half, &[level]);
        // Lost: 0 over black, 1 over white, the mean 1/2, in 4 pixels; divided by the reference's 8, not the level's 4.
        close(level.error.square(), 4.0 * 0.5 / 8.0);
        // One column too many: no reference there, so black over white is wrong wholly; the union is 12 pixels.
        let more: Colours = std::array::from_fn(|i| if i % 4 < 3 { BLACK } else { None });
        close(details(&half, &[more]).error.square(), 4.0 * 0.5 / 8.0);
        let exact: Colours = std::array::from_fn(|i| if i % 4 < 2 { BLACK } else { None });
        assert_eq!(details(&half, &[exact]).error.square(), 0.0);
    }

    #[test]
    fn a_half_covered_pixel_is_compared_premultiplied() {
        // Every pixel half covered by white: linear 0.5 over black, 1 over white. Drawn whole, it is off by
        // 1 - 0.735357 over black alone; not drawn, by 0.735357 over black alone.
        let half = reference(|_| (0.5, 0.5));
        let encoded = 0.735_356_9_f64;
        let whole = details(&half, &[[WHITE; 16]]);
        close(whole.error.square(), (1.0 - encoded).powi(2) / 2.0 / 0.5);
        let none = details(&half, &[[None; 16]]);
        close(none.error.square(), encoded.powi(2) / 2.0 / 0.5);
    }

    #[test]
    fn excess_is_what_the_level_adds_to_the_floor() {
        let white = reference(|_| (1.0, 1.0));
        let off = |by: f32| details(&white, &[[Some([1.0 - by; 3]); 16]]);
        // 0.5^2 - 0.3^2 = 0.4^2
        let figures = ErrorFigures::new(&off(0.5), &off(0.3), (0.8, BoundReading::Excess));
        close(figures.rmse, 0.5);
        close(figures.floor, 0.3);
        close(figures.excess(), 0.4);
        close(figures.strain(), 0.5);
        // Better than the original is no excess.
        let better = ErrorFigures::new(&off(0.1), &off(0.3), (0.8, BoundReading::Excess));
        assert_eq!((better.excess(), better.strain()), (0.0, 0.0));
        // A bound of 0 takes nothing but what adds nothing.
        assert_eq!(
            ErrorFigures::new(&off(0.3), &off(0.3), (0.0, BoundReading::Excess)).strain(),
            0.0
        );
        let none = ErrorFigures::new(&off(0.4), &off(0.3), (0.0, BoundReading::Excess)).strain();
        assert_eq!(none, f64::INFINITY);
    }

    #[test]
    fn the_worst_tile_and_the_worst_view_are_bounded_too() {
        // One view is a whole tile that is right, the other a quarter of a tile that is off by 0.5.
        let white = reference(|_| (1.0, 1.0));
        let good = || frame(&white, &[[WHITE; 16]]);
        let bad = || frame(&white, &[[Some([0.5; 3]); 16]]);
        let level = Details::new([(0, good()), (0, good()), (0, good()), (1, bad())]);
        let original = Details::new([(0, good()), (0, good()), (0, good()), (1, good())]);
        let figures = ErrorFigures::new(&level, &original, (0.25, BoundReading::Excess));
        // A quarter of all pixels.
        close(figures.excess(), 0.25);
        close(figures.worst_view, 0.5);
        close(figures.worst_tile, 0.5);
        // 0.25 / e_a, 0.5 / 2 e_a, 0.5 / 4 e_a
        close(figures.strain(), 1.0);
        // A tile that is covered by less than a quarter counts as a quarter: 1 of 16 pixels.
        let corner = reference(|i| (1.0, if i == 0 { 1.0 } else { 0.0 }));
        let drawn = |c| std::array::from_fn(|i| if i == 0 { Some([c; 3]) } else { None });
        let off = details(&corner, &[drawn(0.5)]);
        let exact = details(&corner, &[drawn(1.0)]);
        let figures = ErrorFigures::new(&off, &exact, (1.0, BoundReading::Excess));
        close(figures.worst_tile, (0.25_f64 / 16.0).sqrt());
        close(figures.worst_view, 0.5);
    }

    #[test]
    fn tiles_of_eight_by_eight_pixels_are_apart() {
        // Four times four pixels at (6, 0) reach into two tiles; the right half of them is wrong.
        let white = Reference::new((0..16).map(|i| {
            (
                [6 + i % 4, i / 4],
                ReferencePixel::new([1.0; 3], [0.0; 3]),
                1.0,
            )
        }));
        let level: Colours = std::array::from_fn(|i| if i % 4 < 2 { WHITE } else { BLACK });
        let frame = frame(&white, &[level]);
        // 8 pixels of a tile count as 16.
        assert_eq!(frame.tiles, [0.0, 0.5]);
    }

    #[test]
    fn shimmer_is_the_standard_deviation_from_offset_to_offset() {
        // Two offsets: one pixel of sixteen shows 1, then 0.5. Variance of that pixel: 0.25^2 * 2 / (2 - 1).
        let white = reference(|_| (1.0, 1.0));
        let mut second = [WHITE; 16];
        second[5] = Some([0.5; 3]);
        let level = details(&white, &[[WHITE; 16], second]);
        close(level.shimmer(), (0.125_f64 / 16.0).sqrt());
        // Wrong, but always in the same way.
        let steady = details(&white, &[[BLACK; 16], [BLACK; 16]]);
        assert_eq!(steady.shimmer(), 0.0);
        // The mean over both offsets: 0.25 / 32.
        close(level.error.square(), 0.25 / 32.0);
        let figures = ErrorFigures::new(
            &level,
            &details(&white, &[[WHITE; 16]; 2]),
            (0.2, BoundReading::Excess),
        );
        // 0.0884 of 0.1 shimmer, 0.0884 of 0.2 excess.
        close(figures.strain(), 0.883_883_5);
        // A pixel that comes and goes shimmers as its contrast with the backgrounds does: 1 over black, 0 over white.
        let mut gone = [WHITE; 16];
        gone[5] = None;
        let flicker = details(&white, &[[WHITE; 16], gone]);
        close(flicker.shimmer(), (0.5 * 0.5_f64 / 16.0).sqrt());
    }

    #[test]
    fn the_papers_reading_sums_channels_and_knows_no_floor() {
        let white = reference(|_| (1.0, 1.0));
        let off = |by: f32| details(&white, &[[Some([1.0 - by; 3]); 16]]);
        // 16 pixels of 3 * 0.1^2 against 16 * 0.05, whatever the original does.
        for original in [0.0, 0.1, 0.4] {
            let figures = ErrorFigures::new(&off(0.1), &off(original), (0.05, BoundReading::Paper));
            close(figures.strain(), 0.6);
        }
    }

    #[test]
    fn a_blended_pixel_is_compared_over_each_background() {
        // Half transparent, 0.25 of premultiplied light: 0.537 over black, over white the encoding of 0.75.
        let half = Reference::new((0..16).map(|i| {
            let shown = ReferencePixel::new([0.25; 3], [0.5; 3]);
            ([i % 4, i / 4], shown, 1.0)
        }));
        let (black, white) = (0.537_098_7_f64, 0.880_825_f64);
        let square = |drawn: [f64; 2]| {
            let mut tally = Tally::new(&half);
            tally.add(&[drawn.map(|c| [c as f32; 3]); 16]);
            Details::new([(0, tally.finish())]).error.square()
        };
        close(square([black, white]), 0.0);
        // Drawn opaque in the same light, it is wrong over white alone; left out, over both.
        close(square([black, black]), (white - black).powi(2) / 2.0);
        let left_out = (black.powi(2) + (1.0 - white).powi(2)) / 2.0;
        close(square([0.0, 1.0]), left_out);
    }

    #[test]
    fn a_nan_is_the_worst_error() {
        let black = reference(|_| (0.0, 1.0));
        let mut broken = [BLACK; 16];
        broken[3] = Some([f32::NAN; 3]);
        let level = details(&black, &[broken]);
        close(level.error.square(), 1.0 / 16.0);
        assert_eq!(level.error.max, 1.0);
    }
}
