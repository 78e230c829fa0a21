//! The report: error against cost, level by level, as data and as a table.
//!
//! [`Report`] is the one source of both. What is not known is null, never left out, so that a program that
//! reads it need not ask which version wrote it.

mod calibration;
mod comparison;
mod difference;
mod exact;
#[cfg(feature = "mesh")]
mod joint;
#[cfg(feature = "mesh")]
mod meshes;
#[cfg(feature = "mesh")]
mod table2;
mod terminal;

pub use calibration::calibration;
pub use comparison::{ComparedAt, Comparison};
pub use difference::{BindingDifference, Fate, ShaderDifference, Totals, ValueAt, ValueDifference};
#[cfg(feature = "mesh")]
pub use joint::{JointReport, PricesReport, ScoreReport, WalkReport};
#[cfg(feature = "mesh")]
pub use meshes::{mesh_error, mesh_error_json, mesh_levels, seen_mesh};
#[cfg(feature = "mesh")]
pub use table2::{table2_head, table2_json, table2_means, table2_row};
pub use terminal::{inspection, next, summary, table};

use crate::emit::LockedGenerated;
use crate::error::{ErrorFigures, HeldOut};
use crate::front::{Place, Source};
use crate::search::{AtDistance, Found, Level, work_of};
use crate::time::{Timing, TimingWarning, Verdict};
use lodc_passes::{Class, Goal, Recipe, Shader, Stage};
use serde::Serialize;

/// The report as data: `<stem>.lod.json`.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct Report {
    /// lodc's own version.
    pub version: &'static str,
    /// The command that reproduces it.
    pub command: String,
    /// The seed of everything that is sampled.
    pub seed: u64,
    /// What was read, each with the hash of its bytes.
    pub inputs: Vec<Input>,
    /// Pixels per object unit where autoLOD is 0.
    pub rho0: f64,
    /// Pixels per degree of what is looked at, for FLIP.
    pub pixels_per_degree: f64,
    /// How errors were held against the bound: `excess` or `paper`.
    pub bound: &'static str,
    /// What was to become cheaper: `time`, or as `--goal` says it.
    pub goal: String,
    /// How many variants' errors were measured.
    pub variants: u64,
    /// How many variants were timed.
    pub timed: usize,
    /// What costs no error, and is done before everything else that is done to a level; null when nothing was.
    pub exact: Option<ExactReport>,
    /// Level 0 first: the original, or what takes its place.
    pub levels: Vec<LevelReport>,
    /// Every variant that nothing beat in error and cost, distance by distance.
    pub frontier: Vec<FrontierReport>,
    /// The textures that were made for levels.
    pub generated: Vec<GeneratedReport>,
    /// What a joint search of meshes and shaders has looked at; not there without one.
    #[cfg(feature = "mesh")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint: Option<JointReport>,
    /// What was left out, and why.
    pub left_out: Vec<String>,
    /// What should be known about this result.
    pub warnings: Vec<String>,
    /// What was inferred because the scene does not say it.
    pub inferences: Vec<String>,
}

/// A texture that was made for levels.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct GeneratedReport {
    /// Its variable.
    pub name: String,
    /// Its file, in the folder of such files.
    pub file: String,
    /// How its texels are stored, as WebGPU calls it.
    pub format: String,
    /// Width and height in texels.
    pub size: [u32; 2],
    /// How many layers it has; null where it is no array.
    pub layers: Option<u32>,
    /// How many MIP levels it has.
    pub levels: u32,
    /// The hash of the file.
    pub hash: String,
}

impl From<LockedGenerated> for GeneratedReport {
    fn from(locked: LockedGenerated) -> Self {
        Self {
            name: locked.name,
            file: locked.file,
            format: locked.format,
            size: locked.size,
            layers: locked.layers,
            levels: locked.levels,
            hash: locked.hash,
        }
    }
}

/// The exact tier: what every level below the original is made from.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct ExactReport {
    /// Work at the nearest distance, as a share of the original's.
    pub cost: f64,
    /// Arithmetic of a covered fragment there, of the original and of this, in full-rate scalar operations.
    pub operations: [f64; 2],
    /// Texture samples of a covered fragment there, of both.
    pub texture_samples: [f64; 2],
    /// What a vertex costs when all branches are taken once, in full-rate scalar operations, of both.
    pub vertex_operations: [f64; 2],
    /// The changes. Lossless: `error_after` is null.
    pub recipe: Vec<StepReport>,
    /// How much of the interface the fragment stages of both read.
    pub read: ReadReport,
    /// What of the interface only the original reads.
    pub unread: Unread,
}

/// How many parts of a shader's interface its fragment stage reads, and how many that of a variant does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ReadReport {
    /// Textures.
    pub textures: [usize; 2],
    /// Other bindings: samplers and buffers.
    pub bindings: [usize; 2],
    /// Inputs of the fragment stage.
    pub varyings: [usize; 2],
}

/// What of a shader's interface a variant of it does not read any more, by name.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Unread {
    /// Textures.
    pub textures: Vec<String>,
    /// Other bindings: samplers and buffers.
    pub bindings: Vec<String>,
    /// Inputs of the fragment stage.
    pub varyings: Vec<String>,
}

/// A file that decided the result.
#[derive(Clone, Debug, Serialize)]
pub struct Input {
    /// Its path as given.
    pub file: String,
    /// `blake3:` and the hash of its bytes.
    pub hash: String,
}

/// One level.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct LevelReport {
    /// Its threshold.
    pub autolod: f64,
    /// In world units.
    pub distance: f64,
    /// What changed, in words.
    pub says: String,
    /// In displayed colour, 0..1.
    pub error: ErrorReport,
    /// Measured or estimated run time.
    pub time: TimeReport,
    /// Executed work of a covered fragment.
    pub cost: CostReport,
    /// The mesh that goes with it.
    pub mesh: MeshReport,
    /// How it takes over from the level before; null when it pops.
    pub transition: Option<TransitionReport>,
    /// Its derivation.
    pub recipe: Vec<StepReport>,
    /// Numerical stability.
    pub stability: StabilityReport,
}

/// The errors of a level.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct ErrorReport {
    /// Root mean square difference from the reference.
    pub rmse: f64,
    /// That of the original.
    pub floor: f64,
    /// What the level adds.
    pub excess: f64,
    /// What it may add.
    pub bound: f64,
    /// The largest difference.
    pub max: f64,
    /// Peak signal-to-noise ratio, decibels; null when there is no difference.
    pub psnr: Option<f64>,
    /// FLIP, the mean over the covered pixels, 0..1.
    pub flip: f64,
    /// RMSE on pictures that decided nothing: other views, uniforms and offsets of the same ranges.
    pub held_out_rmse: Option<f64>,
    /// The standard error of `held_out_rmse`.
    pub held_out_standard_error: Option<f64>,
    /// What the level adds to the original's own error on the same pictures.
    pub held_out_excess: Option<f64>,
    /// The largest excess of one view.
    pub worst_view: f64,
    /// The largest excess of a tile of 8 x 8 pixels of one picture.
    pub worst_tile: f64,
    /// Standard deviation of a pixel from offset to offset.
    pub shimmer: f64,
    /// That of the original.
    pub shimmer_floor: f64,
    /// What is seen where the level takes the place of the one before, as a root mean square; null where that was not measured.
    pub transition: Option<f64>,
}

/// What is drawn where a level begins, beside popping.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct TransitionReport {
    /// `blend` or `dither`.
    pub kind: &'static str,
    /// The autoLOD where it begins, the level's own.
    pub from: f64,
    /// The autoLOD from which the level is drawn alone.
    pub until: f64,
    /// What is paid in between, as a share of the original's estimated time.
    pub cost: Option<f64>,
    /// The run time in the middle of the band, where it was measured; of several adapters where it is worst.
    pub time: Option<RatioReport>,
}

/// The run time of a level.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct TimeReport {
    /// `measured` or `estimated`.
    pub kind: &'static str,
    /// Milliseconds, when measured.
    pub ms: Option<f64>,
    /// As a share of the original's.
    pub ratio: f64,
    /// Lower end of the interval, when measured.
    pub low: Option<f64>,
    /// Upper end of the interval, when measured.
    pub high: Option<f64>,
    /// The adapter, when measured.
    pub adapter: Option<String>,
    /// How far the original was from itself on the spot, as the distance of a ratio from 1, when measured.
    pub floor: Option<f64>,
    /// `no difference`, `faster` or `slower`, when measured.
    pub verdict: Option<Verdict>,
    /// What is to be known before it is believed.
    pub warnings: Vec<TimingWarning>,
    /// The ratio, its interval and what is said of it where the text that holds all levels branches by a uniform, when
    /// that was timed.
    pub branching: Option<RatioReport>,
    /// The same of the other adapters, where recordings of several stand in.
    pub others: Vec<TimeReport>,
}

/// A run time of the text that holds all levels, as a share of the original's alone.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct RatioReport {
    /// The ratio.
    pub ratio: f64,
    /// Lower end of its interval.
    pub low: f64,
    /// Upper end of its interval.
    pub high: f64,
    /// What can be said of it.
    pub verdict: Verdict,
}

impl RatioReport {
    /// What was measured.
    pub(crate) fn of(timing: &Timing) -> Self {
        Self {
            ratio: timing.ratio,
            low: timing.low,
            high: timing.high,
            verdict: timing.verdict(),
        }
    }
}

impl TimeReport {
    /// A share of the original's time as the cost model has it.
    fn estimated(ratio: f64) -> Self {
        Self {
            kind: "estimated",
            ms: None,
            ratio,
            low: None,
            high: None,
            adapter: None,
            floor: None,
            verdict: None,
            warnings: Vec::new(),
            branching: None,
            others: Vec::new(),
        }
    }

    fn measured(timing: &Timing, branching: Option<&Timing>, adapter: &str) -> Self {
        Self {
            kind: "measured",
            ms: Some(timing.ms),
            ratio: timing.ratio,
            low: Some(timing.low),
            high: Some(timing.high),
            adapter: Some(adapter.to_owned()),
            floor: Some(timing.floor),
            verdict: Some(timing.verdict()),
            warnings: timing.warnings.clone(),
            branching: branching.map(RatioReport::of),
            others: Vec::new(),
        }
    }

    /// What was measured on the adapter where it is worst, with the others behind it; the estimate where nothing was.
    fn of(estimate: f64, (timed, branching): (&[Timing], &[Timing]), adapters: &[String]) -> Self {
        let each = timed.iter().zip(adapters).enumerate();
        let mut all: Vec<Self> = each
            .map(|(at, (timing, adapter))| Self::measured(timing, branching.get(at), adapter))
            .collect();
        all.sort_by(|a, b| b.ratio.total_cmp(&a.ratio));
        let mut all = all.into_iter();
        match all.next() {
            Some(worst) => Self {
                others: all.collect(),
                ..worst
            },
            None => Self::estimated(estimate),
        }
    }
}

/// The work of a level.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct CostReport {
    /// What it costs by the goal, as a share of the original's.
    pub ratio: f64,
    /// The run time as a share of the original's, as the cost model has it.
    pub estimated_time: f64,
    /// Arithmetic of a covered fragment, in full-rate scalar operations.
    pub operations: f64,
    /// Texture samples of a covered fragment.
    pub texture_samples: f64,
    /// Textures that are bound, generated ones among them.
    pub active_textures: u32,
    /// Bytes of those with their MIP levels, at 4 bytes a texel.
    pub active_texture_bytes: u64,
    /// What was moved to the vertices or to parameters and is done there, and what handing it over costs, in full-rate scalar operations a
    /// covered fragment.
    pub moved_operations: f64,
    /// Arithmetic of a vertex, static, in full-rate scalar operations.
    pub vertex_operations: f64,
    /// Parameters that the host must fill.
    pub parameters: u32,
    /// What the ratio of the time would be if the host filled a block of parameters, where it does not and that is less.
    pub ratio_with_parameters: Option<f64>,
    /// The same if the host bound textures that are made for levels.
    pub ratio_with_textures: Option<f64>,
    /// Bytes of generated textures.
    pub texture_bytes: u64,
}

/// The mesh of a level.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct MeshReport {
    /// The generated file; null for the scene's own mesh.
    pub file: Option<String>,
    /// How many triangles it has.
    pub triangles: usize,
}

/// One step of a level's derivation.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct StepReport {
    /// The pass.
    pub pass: String,
    /// The value.
    pub site: String,
    /// What is done there.
    pub choice: String,
    /// Olano's class.
    pub class: Option<Class>,
    /// The file that the value is in, when it is not the shader's own but an imported module, or that of the
    /// vertex stage.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// The line of the value in its file, from 1.
    pub line: Option<u32>,
    /// RMSE of the variant after this step.
    pub error_after: Option<f64>,
}

/// Numerical stability of a level.
#[derive(Clone, Debug, Default, Serialize)]
pub struct StabilityReport {
    /// In a word; null where it was not asked.
    pub verdict: Option<String>,
    /// How many inputs it was held against: with no failure, the rate is below 3 in as many at 95 % confidence.
    pub inputs: Option<u64>,
    /// The worst places.
    pub worst: Vec<String>,
    /// Jumps and slopes that are added, moved, steeper or gone, which refuse nothing.
    pub stiff: Vec<String>,
}

/// A non-dominated variant at a distance.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct FrontierReport {
    /// In world units.
    pub distance: f64,
    /// RMSE on the search set.
    pub rmse: f64,
    /// Cost as a share of the original's, estimated.
    pub cost: f64,
    /// Its run time, where it was measured.
    pub time: Option<TimeReport>,
    /// Its derivation, a step a string.
    pub recipe: Vec<String>,
}

/// What a report says of where it comes from.
#[derive(Clone, Debug, Default)]
pub struct Origin {
    /// The command that reproduces it.
    pub command: String,
    /// The seed.
    pub seed: u64,
    /// Pixels per degree of what is looked at.
    pub pixels_per_degree: f64,
    /// How errors were held against the bound.
    pub bound: &'static str,
    /// What was to become cheaper.
    pub goal: Goal,
    /// What was read.
    pub inputs: Vec<Input>,
    /// Triangles of the scene's mesh.
    pub triangles: usize,
    /// What should be known about this result.
    pub warnings: Vec<String>,
    /// What was inferred.
    pub inferences: Vec<String>,
    /// How each level takes over from the one before.
    pub transitions: Vec<Option<TransitionReport>>,
    /// The textures that were made for levels.
    pub generated: Vec<LockedGenerated>,
    /// The mesh of each level; the scene's own where there is none.
    pub meshes: Vec<MeshReport>,
    /// What is seen where each level begins.
    pub shown: Vec<Option<f64>>,
    /// What a joint search has looked at.
    #[cfg(feature = "mesh")]
    pub joint: Option<JointReport>,
}

impl Report {
    /// The report of a search. `says` words each level; `source` is what `base` is the normal form of.
    pub fn new(
        found: &Found,
        base: &Shader,
        source: &Source,
        says: &[String],
        origin: Origin,
    ) -> Self {
        let level = |(at, (level, says)): (usize, (&Level, &String))| {
            let mut report = LevelReport {
                transition: origin.transitions.get(at).cloned().flatten(),
                time: TimeReport::of(
                    level.time,
                    (&level.timed, &level.branching),
                    &found.adapters,
                ),
                ..level_report(level, says.clone(), base, source, &origin)
            };
            if let Some(mesh) = origin.meshes.get(at) {
                report.mesh = mesh.clone();
            }
            report.error.transition = origin.shown.get(at).copied().flatten();
            report
        };
        Self {
            version: env!("CARGO_PKG_VERSION"),
            rho0: found.rho0,
            pixels_per_degree: origin.pixels_per_degree,
            bound: origin.bound,
            goal: origin.goal.to_string(),
            variants: found.variants,
            exact: exact::report(found, base, source),
            levels: found
                .levels
                .iter()
                .zip(says)
                .enumerate()
                .map(level)
                .collect(),
            frontier: (found.distances.iter())
                .flat_map(|at| frontier(at, &found.adapters))
                .collect(),
            timed: found.timed,
            left_out: exact::left_out(found, base, source)
                .into_iter()
                .chain(found.distances.iter().filter_map(withdrawn))
                .chain(
                    found
                        .distances
                        .iter()
                        .flat_map(|at| struck(at, base, source)),
                )
                .collect(),
            command: origin.command,
            seed: origin.seed,
            inputs: origin.inputs,
            warnings: origin.warnings,
            inferences: origin.inferences,
            generated: origin.generated.into_iter().map(Into::into).collect(),
            #[cfg(feature = "mesh")]
            joint: origin.joint,
        }
    }

    /// As JSON, with a line end at the end.
    pub fn json(&self) -> String {
        // Serialising plain data to a string cannot fail: no map has keys that are not strings.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }
}

impl ErrorReport {
    fn new(error: &ErrorFigures, flip: f64, held_out: Option<&HeldOut>) -> Self {
        Self {
            rmse: error.rmse,
            floor: error.floor,
            excess: error.excess(),
            bound: error.bound,
            max: error.max,
            psnr: Some(error.psnr()).filter(|psnr| psnr.is_finite()),
            flip,
            held_out_rmse: held_out.map(|held_out| held_out.rmse),
            held_out_standard_error: held_out.and_then(|held_out| held_out.standard_error),
            held_out_excess: held_out.map(|held_out| held_out.excess),
            worst_view: error.worst_view,
            worst_tile: error.worst_tile,
            shimmer: error.shimmer,
            shimmer_floor: error.shimmer_floor,
            transition: None,
        }
    }
}

/// Arithmetic of a vertex, static, in full-rate scalar operations.
fn of_vertex(shader: &Shader) -> f64 {
    work_of(shader, Stage::Vertex).operations()
}

fn level_report(
    level: &Level,
    says: String,
    base: &Shader,
    source: &Source,
    origin: &Origin,
) -> LevelReport {
    LevelReport {
        autolod: level.autolod,
        distance: level.distance,
        says,
        error: ErrorReport::new(&level.error, level.flip, level.held_out.as_ref()),
        time: TimeReport::estimated(level.time),
        cost: CostReport {
            ratio: level.cost,
            estimated_time: level.time,
            operations: level.used.work.operations(),
            texture_samples: level.used.work.samples,
            active_textures: level.used.textures,
            active_texture_bytes: level.used.texture_bytes,
            moved_operations: level.used.work.moved,
            vertex_operations: of_vertex(&level.shader),
            parameters: level.shader.parameters().len() as u32,
            ratio_with_parameters: level.with_parameters,
            ratio_with_textures: level.with_textures,
            texture_bytes: level.used.generated_bytes,
        },
        mesh: MeshReport {
            file: None,
            triangles: origin.triangles,
        },
        transition: None,
        recipe: steps(&level.recipe, &level.error_after, base, source),
        stability: StabilityReport {
            verdict: level
                .stability
                .as_ref()
                .map(|judged| judged.verdict.name().to_owned()),
            inputs: level.stability.as_ref().map(|judged| judged.inputs),
            worst: (level.unstable.iter())
                .map(|blamed| blamed.says(base, source))
                .collect(),
            stiff: (level.stiff.iter())
                .map(|stiff| stiff.says(source))
                .collect(),
        },
    }
}

/// The steps of a recipe, each with the RMSE after it where that is known.
fn steps(recipe: &Recipe, error_after: &[f64], base: &Shader, source: &Source) -> Vec<StepReport> {
    let place = |site| base.find(site).and_then(|at| place_of(base, source, at));
    let steps = recipe.0.iter().enumerate();
    steps
        .map(|(i, candidate)| (i, candidate, place(&candidate.site)))
        .map(|(i, candidate, place)| StepReport {
            pass: candidate.pass.clone(),
            site: candidate.site.to_string(),
            choice: candidate.choice.clone(),
            class: (base.passes().of_name(&candidate.pass))
                .map(|pass| pass.class(candidate))
                .ok(),
            file: place
                .as_ref()
                .filter(|place| !place.is_in_main())
                .map(|place| place.file.name.to_owned()),
            line: place.map(|place| place.line()),
            error_after: error_after.get(i).copied(),
        })
        .collect()
}

/// What the validation split has withdrawn at a distance.
fn withdrawn(at: &AtDistance) -> Option<String> {
    let what = match at.withdrawn {
        0 => return None,
        1 => "a variant".to_owned(),
        several => format!("{several} variants"),
    };
    Some(format!(
        "at distance {:.2}, {what} within the bound on the scene's samples, and over it on pictures that the search \
         had not seen",
        at.distance
    ))
}

/// What was struck off at a distance, since it is unstable.
fn struck<'a>(
    at: &'a AtDistance,
    base: &'a Shader,
    source: &'a Source,
) -> impl Iterator<Item = String> + 'a {
    at.struck.iter().map(move |struck| {
        let why = struck.blamed.says(base, source);
        format!(
            "at distance {:.2}, a variant is unstable: {why}",
            at.distance
        )
    })
}

fn frontier<'a>(
    at: &'a AtDistance,
    adapters: &'a [String],
) -> impl Iterator<Item = FrontierReport> + 'a {
    at.frontier
        .iter()
        .enumerate()
        .map(move |(i, seen)| FrontierReport {
            time: (at.timed.get(i).filter(|timed| !timed.is_empty()))
                .map(|timed| TimeReport::of(1.0, (timed, &[]), adapters)),
            distance: at.distance,
            rmse: seen.square.sqrt(),
            cost: match at.original > 0.0 {
                true => seen.cost / at.original,
                false => 1.0,
            },
            recipe: seen.recipe.0.iter().map(ToString::to_string).collect(),
        })
}

/// Where a value of a source's normal form is in its files; `None` when it has no place there.
pub fn place_of<'s>(
    shader: &Shader,
    source: &'s Source,
    (stage, value): (lodc_passes::Stage, naga::Handle<naga::Expression>),
) -> Option<Place<'s>> {
    source.place(shader.function(stage)?.expressions.get_span(value))
}
