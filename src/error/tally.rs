//! One frame's differences added up: over all pixels, by tile, and from offset to offset.

use super::flip::{flip, reach};
use super::{BACKGROUNDS, ReferencePixel, Shown};
use std::collections::BTreeMap;

/// Edge of a tile in pixels.
pub(crate) const TILE: u32 = 8;

/// The least coverage that a tile is judged by, in pixels: a quarter of it. Below that a sliver of the silhouette,
/// a pixel or two, would decide.
const LEAST_OF_TILE: f64 = (TILE * TILE / 4) as f64;

/// Error sums over a set of samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ErrorSum {
    /// Sum of squared differences, each the mean over backgrounds and channels.
    pub squares: f64,
    /// Sum of the reference's coverage, in pixels, once for each offset.
    pub coverage: f64,
    /// The largest difference of one channel of one pixel, 0..1.
    pub max: f32,
}

impl ErrorSum {
    /// `E^2`: the mean squared difference. 0 when nothing is covered.
    pub fn square(&self) -> f64 {
        if self.coverage > 0.0 {
            self.squares / self.coverage
        } else {
            0.0
        }
    }

    /// Adds the sums of another part of the samples.
    pub(crate) fn merge(&mut self, other: &Self) {
        self.squares += other.squares;
        self.coverage += other.coverage;
        self.max = self.max.max(other.max);
    }
}

/// The pixels of the reference that are looked at, in a fixed order.
#[derive(Clone, Debug, Default)]
pub(crate) struct Reference {
    pixels: Vec<ReferencePixel>,
    /// Where each is in the picture: column and row.
    places: Vec<[u32; 2]>,
    /// The reference's coverage, in pixels.
    coverage: f64,
    /// For each pixel, its tile, counted from 0 in the order of the tiles.
    tiles: Vec<u32>,
    /// Column and row of each tile.
    tile_places: Vec<(u32, u32)>,
    /// Each tile's coverage by the reference, in pixels.
    tile_coverage: Vec<f64>,
}

impl Reference {
    /// From each pixel's place, what it shows, and its covered share: that of its samples that show something.
    pub(crate) fn new(pixels: impl IntoIterator<Item = ([u32; 2], ReferencePixel, f32)>) -> Self {
        let mut reference = Self::default();
        let mut found = BTreeMap::new();
        let mut places = Vec::new();
        for ([x, y], pixel, coverage) in pixels {
            reference.pixels.push(pixel);
            reference.places.push([x, y]);
            reference.coverage += f64::from(coverage);
            let tile = (y / TILE, x / TILE);
            *found.entry(tile).or_insert(0.0) += f64::from(coverage);
            places.push(tile);
        }
        let numbers: BTreeMap<_, u32> = found.keys().copied().zip(0..).collect();
        reference.tiles = places.iter().map(|tile| numbers[tile]).collect();
        reference.tile_places = found.keys().map(|(row, column)| (*column, *row)).collect();
        reference.tile_coverage = found.into_values().collect();
        reference
    }

    /// The sum of FLIP over its pixels that it or the drawing covers, the mean over a black and a white
    /// background, and how many those are.
    pub(crate) fn flip(&self, colours: &[Shown], pixels_per_degree: f64) -> (f64, usize) {
        let bounds = |axis: usize| {
            let along = self.places.iter().map(|place| place[axis]);
            Some((along.clone().min()?, along.max()?))
        };
        let (Some((left, right)), Some((top, bottom))) = (bounds(0), bounds(1)) else {
            return (0.0, 0);
        };
        // What lies further out shows the background in both pictures.
        let margin = reach(pixels_per_degree);
        let width = (right - left) as usize + 1 + 2 * margin;
        let height = (bottom - top) as usize + 1 + 2 * margin;
        let at = |[x, y]: [u32; 2]| {
            (y - top) as usize * width + (x - left) as usize + margin * (width + 1)
        };
        let mut sum = 0.0;
        for (background, empty) in BACKGROUNDS.into_iter().enumerate() {
            let mut pictures = [(); 2].map(|()| vec![empty; width * height]);
            for ((place, pixel), colour) in self.places.iter().zip(&self.pixels).zip(colours) {
                pictures[0][at(*place)] = pixel.over()[background];
                pictures[1][at(*place)] = colour[background];
            }
            let map = flip(width, &pictures[0], &pictures[1], pixels_per_degree);
            sum += self.places.iter().map(|place| map[at(*place)]).sum::<f64>() / 2.0;
        }
        (sum, self.places.len())
    }

    /// For each pixel, what is drawn less the reference, as [`ReferencePixel::difference`] has it.
    pub(crate) fn differences(&self, colours: &[Shown]) -> Vec<[f32; 6]> {
        let pixels = self.pixels.iter().zip(colours);
        pixels
            .map(|(pixel, colour)| pixel.difference(colour))
            .collect()
    }

    /// Column and row of each tile, in the order of [`FrameError::tiles`].
    pub(crate) fn tile_places(&self) -> &[(u32, u32)] {
        &self.tile_places
    }

    /// How many pixels it has.
    pub(crate) fn len(&self) -> usize {
        self.pixels.len()
    }
}

/// What was measured of one frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct FrameError {
    /// Over all of its pixels and offsets.
    pub(crate) sum: ErrorSum,
    /// For each tile, `E^2` over its pixels and offsets.
    pub(crate) tiles: Vec<f64>,
    /// Sum over pixels of the variance from offset to offset, each the mean over backgrounds and channels.
    pub(crate) variance: f64,
    /// The reference's coverage in pixels, counted once: what `variance` is divided by.
    pub(crate) coverage: f64,
}

impl FrameError {
    /// Adds a tile: its sum of squares over so many drawings, and the reference's coverage of it.
    #[cfg(feature = "gpu")]
    pub(crate) fn add_tile(&mut self, squares: f64, coverage: f64, drawings: u32) {
        let drawings = f64::from(drawings);
        self.sum.squares += squares;
        self.sum.coverage += coverage * drawings;
        self.coverage += coverage;
        self.tiles.push(of_tile(squares, coverage, drawings));
    }
}

/// `E^2` of a tile.
fn of_tile(squares: f64, coverage: f64, drawings: f64) -> f64 {
    squares / (coverage.max(LEAST_OF_TILE) * drawings.max(1.0))
}

/// Adds up the drawings of one frame, one for each offset.
pub(crate) struct Tally<'a> {
    reference: &'a Reference,
    drawings: u32,
    max: f32,
    /// For each pixel, the sum over drawings of the mean squared difference.
    squares: Vec<f64>,
    /// For each pixel, the sums over drawings of its differences.
    sums: Vec<[f64; 6]>,
}

impl<'a> Tally<'a> {
    /// Of no drawing yet.
    pub(crate) fn new(reference: &'a Reference) -> Self {
        Self {
            reference,
            drawings: 0,
            max: 0.0,
            squares: vec![0.0; reference.len()],
            sums: vec![[0.0; 6]; reference.len()],
        }
    }

    /// Adds a drawing: for each pixel of the reference what it shows.
    pub(crate) fn add(&mut self, colours: &[Shown]) {
        self.drawings += 1;
        let totals = self.squares.iter_mut().zip(&mut self.sums);
        for ((pixel, colour), (square, sums)) in
            self.reference.pixels.iter().zip(colours).zip(totals)
        {
            let mut six = 0.0;
            for (difference, sum) in pixel.difference(colour).into_iter().zip(sums) {
                let difference64 = f64::from(difference);
                six += difference64 * difference64;
                *sum += difference64;
                self.max = self.max.max(difference.abs());
            }
            *square += six / 6.0;
        }
    }

    /// What all drawings together show.
    pub(crate) fn finish(self) -> FrameError {
        let drawings = f64::from(self.drawings);
        let reference = self.reference;
        let mut tiles = vec![0.0; reference.tile_coverage.len()];
        let mut variance = 0.0;
        let mut squares = 0.0;
        for ((square, sums), tile) in self.squares.iter().zip(&self.sums).zip(&reference.tiles) {
            squares += square;
            tiles[*tile as usize] += square;
            if self.drawings > 1 {
                // The reference is the same for each drawing, so that the differences vary as the colours do.
                let of_mean = sums.iter().map(|sum| sum * sum).sum::<f64>() / (6.0 * drawings);
                variance += (square - of_mean).max(0.0) / (drawings - 1.0);
            }
        }
        for (tile, coverage) in tiles.iter_mut().zip(&reference.tile_coverage) {
            *tile = of_tile(*tile, *coverage, drawings);
        }
        FrameError {
            sum: ErrorSum {
                squares,
                coverage: reference.coverage * drawings,
                max: self.max,
            },
            tiles,
            variance,
            coverage: reference.coverage,
        }
    }
}
