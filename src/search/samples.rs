//! What errors are measured over: the frames of a scene at one distance, rasterised once, with the pixels of
//! the reference beside them. A variant is then one run of its fragment program.

use super::error::{ErrorSum, ReferencePixel, displayed, encoded};
use crate::eval::draw::{Shading, each_visible, resolve, seen, shade_into};
use crate::eval::machine::Bindings;
use crate::eval::program::{Program, Refused};
use crate::eval::raster::{Coverage, rasterize};
use crate::scene::{Output, Scene};
use lodc_passes::{Shader, Stage, Work};
use naga::{Expression, Handle};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Fine pixels of the reference to a pixel, along each axis.
const GRID: u32 = 4;
/// Squares of 2 x 2 pixels that a search set has, over all of its frames; a frame has at least one block full.
const SEARCH_SQUARES: usize = 1024;

/// What a search stands on.
pub struct Stand<'a> {
    /// The original in normal form.
    pub base: &'a Shader,
    /// The vertex program that every variant is drawn with.
    pub vertex: &'a Program,
    /// What errors are measured over.
    pub scene: &'a Scene,
}

/// Which samples of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Samples {
    /// A part that is quick to shade: squares of pixels spread evenly over every frame.
    Search,
    /// All of them.
    Full,
}

/// What was measured of a variant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Its error against the reference.
    pub error: ErrorSum,
    /// Executed work of a covered fragment.
    pub work: Work,
}

/// The samples at one distance.
pub struct SampleSet<'a> {
    pub(super) stand: &'a Stand<'a>,
    distance: f64,
    pub(super) frames: Vec<Rasterised>,
    original: Measured,
}

/// One frame, rasterised, with the reference's pixels.
pub(super) struct Rasterised {
    pub(super) bindings: Bindings,
    pub(super) coverage: Coverage,
    /// Those fragments alone that the original shows, where others are shaded too and hidden afterwards.
    pub(super) seen: Option<Coverage>,
    /// The pixels that the reference or a fragment covers.
    reference: Vec<ReferencePixel>,
    /// For each covered fragment, its place in `reference`.
    places: Vec<u32>,
    /// The reference's coverage, in pixels.
    covered: f64,
}

impl<'a> SampleSet<'a> {
    /// Draws the reference: the original, 4 x 4 samples a pixel, and keeps the fragments to be shaded.
    ///
    /// # Errors
    /// When the evaluator refuses the original.
    pub fn new(stand: &'a Stand<'a>, distance: f64, samples: Samples) -> Result<Self, Refused> {
        let original = compile(stand.base, &[])?;
        let frames = stand.scene.frames(distance);
        let squares = match samples {
            Samples::Full => usize::MAX,
            Samples::Search => (SEARCH_SQUARES / frames.len().max(1)).max(64),
        };
        let output = stand.scene.output;
        let frames = frames
            .into_par_iter()
            .enumerate()
            .map(|(index, frame)| {
                let mut coverage = rasterize(stand.vertex, &original, &frame);
                let mut fine = frame;
                fine.grid = GRID;
                let mut reference = rasterize(stand.vertex, &original, &fine);
                let all = coverage.squares();
                if all.len() > squares {
                    let kept = choose(&all, squares, stand.scene.seed.wrapping_add(index as u64));
                    coverage = coverage.part(|square| kept.contains(&square));
                    reference = reference.part(|square| kept.contains(&square));
                }
                Rasterised::new(&original, coverage, &reference, fine.bindings, output)
            })
            .collect();
        let mut set = Self {
            stand,
            distance,
            frames,
            original: Measured {
                error: ErrorSum::default(),
                work: Work::default(),
            },
        };
        set.original = set.measure_program(&original);
        Ok(set)
    }

    /// The distance of its frames, in world units.
    pub fn distance(&self) -> f64 {
        self.distance
    }

    /// What was measured of the original: the floor.
    pub fn original(&self) -> &Measured {
        &self.original
    }

    /// Measures a variant.
    ///
    /// # Errors
    /// When the evaluator refuses it; a variant of an original that runs, runs.
    pub fn measure(&self, shader: &Shader) -> Result<Measured, Refused> {
        Ok(self.measure_program(&compile(shader, &[])?))
    }

    /// Measures any fragment program with the original's interface.
    pub fn measure_program(&self, fragment: &Program) -> Measured {
        let output = self.stand.scene.output;
        let results: Vec<(ErrorSum, u64, Work)> = self
            .frames
            .par_iter()
            .map(|frame| {
                let mut shading = Shading::default();
                shade_into(fragment, &frame.coverage, &frame.bindings, &mut shading);
                let error = frame.error(&shading, output);
                (error, shading.profile.lanes, shading.profile.work)
            })
            .collect();
        let mut error = ErrorSum::default();
        let mut lanes = 0;
        let mut work = Work::default();
        for (sum, count, executed) in results {
            error.merge(&sum);
            lanes += count;
            work += executed;
        }
        Measured {
            error,
            work: work * (1.0 / lanes.max(1) as f64),
        }
    }
}

impl Rasterised {
    fn new(
        original: &Program,
        coverage: Coverage,
        fine: &Coverage,
        bindings: Bindings,
        output: Output,
    ) -> Self {
        let mut shading = Shading::default();
        shade_into(original, fine, &bindings, &mut shading);
        let mut picture = resolve(fine, &shading);
        for (colour, covered) in picture.pixels.iter_mut().zip(&picture.covered) {
            if *covered > 0.0 {
                let [r, g, b] = displayed(output, *colour);
                *colour = [r, g, b, 1.0];
            }
        }
        let picture = picture.box_filtered(fine.grid);
        let mut pixels: Vec<u32> = (0..)
            .zip(&picture.covered)
            .filter(|(_, c)| **c > 0.0)
            .map(|(i, _)| i)
            .collect();
        pixels.extend(coverage.pixels());
        pixels.sort_unstable();
        pixels.dedup();
        let mut places = vec![0; coverage.fragments];
        for (fragment, pixel) in coverage.pixels().enumerate() {
            // Every covered pixel has been entered above.
            places[fragment] = pixels.binary_search(&pixel).unwrap_or(0) as u32;
        }
        let covered = |pixel: &u32| picture.covered[*pixel as usize];
        Self {
            covered: pixels.iter().map(|pixel| f64::from(covered(pixel))).sum(),
            reference: pixels
                .iter()
                .map(|pixel| {
                    let [r, g, b, _] = picture.pixels[*pixel as usize];
                    ReferencePixel::new([r, g, b], covered(pixel))
                })
                .collect(),
            seen: coverage.late.then(|| {
                shade_into(original, &coverage, &bindings, &mut shading);
                seen(&coverage, &shading)
            }),
            places,
            bindings,
            coverage,
        }
    }

    fn error(&self, shading: &Shading, output: Output) -> ErrorSum {
        let mut colours: Vec<Option<[f32; 3]>> = vec![None; self.reference.len()];
        each_visible(
            &self.coverage,
            shading,
            colours.len(),
            |fragment, _| self.places[fragment],
            |place, fragment| {
                colours[place as usize] = Some(encoded(output, shading.colours[fragment]));
            },
        );
        let mut sum = ErrorSum {
            coverage: self.covered,
            ..ErrorSum::default()
        };
        for (pixel, colour) in self.reference.iter().zip(colours) {
            let (square, largest) = pixel.difference(colour);
            sum.squares += square;
            sum.max = sum.max.max(largest);
        }
        sum
    }
}

pub(super) fn compile(shader: &Shader, probes: &[Handle<Expression>]) -> Result<Program, Refused> {
    // A shader always has a fragment stage.
    let entry = shader.index(Stage::Fragment).unwrap_or(0);
    Program::compile(shader.module(), entry, probes)
}

/// Some of the squares, `count` of them, spread evenly: sorted by a hash of their place and the seed.
fn choose(all: &[(u32, u32)], count: usize, seed: u64) -> BTreeSet<(u32, u32)> {
    let mut order: Vec<(u64, (u32, u32))> = all
        .iter()
        .map(|square| {
            (
                mix(seed ^ mix(u64::from(square.0) << 32 | u64::from(square.1))),
                *square,
            )
        })
        .collect();
    order.sort_unstable();
    order
        .into_iter()
        .take(count)
        .map(|(_, square)| square)
        .collect()
}

/// SplitMix64's finaliser (Steele, Lea, Flood 2014): a hash of one word.
fn mix(word: u64) -> u64 {
    let word = word.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let word = (word ^ word >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let word = (word ^ word >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    word ^ word >> 31
}
