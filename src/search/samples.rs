//! What errors are measured over: the frames of a scene at one distance, rasterised once, with the pixels of
//! the reference beside them. A variant is then one run of its fragment program.

use super::error::{ErrorSum, ReferencePixel, displayed, encoded};
use crate::eval::draw::{Shading, each_visible, resolve, seen, shade_into};
use crate::eval::machine::Bindings;
use crate::eval::program::{Program, Refused};
use crate::eval::raster::{Coverage, rasterize};
use crate::eval::texture::Dimension;
use crate::scene::{Output, Scene, SceneTexture};
use glam::{Vec2, Vec3};
use lodc_passes::facts::{TextureFacts, ValueFacts};
use lodc_passes::{Facts, Shader, Stage, Work, autolod};
use naga::{Expression, Handle, Scalar, TypeInner};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

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
    stand: &'a Stand<'a>,
    distance: f64,
    frames: Vec<Rasterised>,
    original: Measured,
}

/// One frame, rasterised, with the reference's pixels.
struct Rasterised {
    bindings: Bindings,
    coverage: Coverage,
    /// Those fragments alone that the original shows, where others are shaded too and hidden afterwards.
    seen: Option<Coverage>,
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

    /// What the samples show of every float value of a shader, and of the scene's textures.
    pub fn facts(&self, shader: &Shader) -> Facts {
        let mut facts = Facts {
            values: BTreeMap::new(),
            textures: texture_facts(self.stand.scene, self.distance),
        };
        let probes = float_values(shader);
        let Ok(program) = compile(shader, &probes) else {
            return facts;
        };
        let profiles: Vec<_> = self
            .frames
            .par_iter()
            .map(|frame| {
                let mut shading = Shading::default();
                let seen = frame.seen.as_ref().unwrap_or(&frame.coverage);
                shade_into(&program, seen, &frame.bindings, &mut shading);
                shading.profile.probes
            })
            .collect();
        for (i, value) in probes.iter().enumerate() {
            let mut fact = ValueFacts::default();
            let components = profiles
                .iter()
                .map(|frame| frame[i].len())
                .max()
                .unwrap_or(0);
            for component in 0..components {
                let (mut count, mut sum) = (0, 0.0);
                let (mut min, mut max) = (f32::INFINITY, f32::NEG_INFINITY);
                for probe in profiles.iter().filter_map(|frame| frame[i].get(component)) {
                    count += probe.count;
                    sum += probe.sum;
                    // A NaN stays: it must be seen.
                    min = if min.is_nan() || probe.min > min {
                        min
                    } else {
                        probe.min
                    };
                    max = if max.is_nan() || probe.max < max {
                        max
                    } else {
                        probe.max
                    };
                }
                fact.count = count;
                fact.mean.push((sum / count.max(1) as f64) as f32);
                fact.min.push(min);
                fact.max.push(max);
            }
            if fact.count > 0 {
                facts
                    .values
                    .insert(shader.id(Stage::Fragment, *value).clone(), fact);
            }
        }
        facts
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

/// What is known of every texture that is not dynamic, at the MIP level that a distance leads to.
fn texture_facts(scene: &Scene, distance: f64) -> BTreeMap<String, TextureFacts> {
    let known = scene.textures.iter().filter(|texture| !texture.dynamic);
    known
        .map(|texture| {
            let level = texels_per_pixel(scene, texture, distance)
                .unwrap_or(1.0)
                .log2();
            (
                texture.name.clone(),
                texture.texture.facts(level.max(0.0) as f32),
            )
        })
        .collect()
}

/// Texels of a texture to a pixel at a distance, along an edge, when it is mapped by the mesh's own texture
/// coordinates: the mean over the mesh's area. `None` for a texture or a mesh that has no such coordinates.
pub(crate) fn texels_per_pixel(
    scene: &Scene,
    texture: &SceneTexture,
    distance: f64,
) -> Option<f64> {
    let mesh = &scene.mesh;
    if texture.texture.dimension() != Dimension::D2 || mesh.uvs.is_empty() {
        return None;
    }
    let (mut surface, mut mapped) = (0.0, 0.0);
    for corners in mesh.indices.chunks_exact(3) {
        let [a, b, c] = [0, 1, 2].map(|i| corners[i] as usize);
        let position = |i: usize| Vec3::from(mesh.positions[i]).as_dvec3();
        let uv = |i: usize| Vec2::from(mesh.uvs[i]).as_dvec2();
        surface += (position(b) - position(a))
            .cross(position(c) - position(a))
            .length();
        mapped += (uv(b) - uv(a)).perp_dot(uv(c) - uv(a)).abs();
    }
    let [width, height, _] = texture.texture.size(0);
    let texels = mapped * f64::from(width) * f64::from(height);
    let scale = (texels / surface).sqrt() / autolod::rho(&scene.view(distance));
    (scale.is_finite() && scale > 0.0).then_some(scale)
}

fn compile(shader: &Shader, probes: &[Handle<Expression>]) -> Result<Program, Refused> {
    // A shader always has a fragment stage.
    let entry = shader.index(Stage::Fragment).unwrap_or(0);
    Program::compile(shader.module(), entry, probes)
}

/// The fragment values that facts are wanted of: f32 scalars, vectors and matrices that are computed.
fn float_values(shader: &Shader) -> Vec<Handle<Expression>> {
    let Some(function) = shader.function(Stage::Fragment) else {
        return Vec::new();
    };
    function
        .expressions
        .iter()
        .filter(|(_, expression)| {
            !expression.needs_pre_emit() || matches!(expression, Expression::FunctionArgument(_))
        })
        .map(|(value, _)| value)
        .filter(|value| {
            matches!(
                shader.type_of(Stage::Fragment, *value),
                TypeInner::Scalar(Scalar::F32)
                    | TypeInner::Vector {
                        scalar: Scalar::F32,
                        ..
                    }
                    | TypeInner::Matrix {
                        scalar: Scalar::F32,
                        ..
                    }
            )
        })
        .collect()
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
