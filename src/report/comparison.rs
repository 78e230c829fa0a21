//! What `lodc compare` found, as data and as a table.

use super::terminal::columns;
use super::{CostReport, ErrorReport, Input};
use crate::Diagnostic;
use crate::error::ErrorFigures;
use crate::search::Measured;
use serde::Serialize;

/// One shader against another, as data.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// lodc's own version.
    pub version: &'static str,
    /// The command that reproduces it.
    pub command: String,
    /// The shader that the reference is drawn with, as it was named.
    pub original: String,
    /// The shader whose error it is, as it was named.
    pub other: String,
    /// The scene file, when there is one.
    pub scene: Option<String>,
    /// What drew the pictures: `evaluator` or `gpu`.
    pub renderer: &'static str,
    /// The GPU that drew them.
    pub adapter: Option<String>,
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
    /// Nearest first.
    pub distances: Vec<ComparedAt>,
    /// What should be known about this result.
    pub warnings: Vec<String>,
    /// What was inferred because the scene does not say it.
    pub inferences: Vec<String>,
}

/// The error of the other shader at a distance.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct ComparedAt {
    /// In world units.
    pub distance: f64,
    /// What the other shader's `autoLOD` was; null when it has none.
    pub autolod: Option<f64>,
    /// In displayed colour, 0..1.
    pub error: ErrorReport,
    /// Whether everything that is bounded is within its bound.
    pub within: bool,
    /// Executed work of a covered fragment of the other shader; only the evaluator counts it.
    pub cost: Option<CostReport>,
    /// That work as a share of the original's: an estimate of the run time.
    pub ratio: Option<f64>,
}

impl ComparedAt {
    /// From what was measured of the other shader against the original; `measured` are the original and the other.
    pub(crate) fn new(
        (distance, autolod): (f64, Option<f64>),
        error: &ErrorFigures,
        flip: f64,
        measured: Option<&[Measured; 2]>,
    ) -> Self {
        Self {
            distance,
            autolod,
            error: ErrorReport::new(error, flip, None),
            within: error.strain() <= 1.0,
            cost: measured.map(|[original, other]| CostReport {
                ratio: match original.cost > 0.0 {
                    true => other.cost / original.cost,
                    false => 1.0,
                },
                estimated_time: other.used.work.total() / original.used.work.total(),
                operations: other.used.work.operations(),
                texture_samples: other.used.work.samples,
                active_textures: other.used.textures,
                active_texture_bytes: other.used.texture_bytes,
                moved_operations: 0.0,
                vertex_operations: 0.0,
                parameters: 0,
                ratio_with_parameters: None,
                ratio_with_textures: None,
                texture_bytes: 0,
            }),
            ratio: measured.and_then(|both| {
                let [original, other] = both.map(|one| one.used.work.total());
                (original > 0.0).then(|| other / original)
            }),
        }
    }
}

impl Comparison {
    /// As JSON, with a line end at the end.
    pub fn json(&self) -> String {
        // Serialising plain data to a string cannot fail: no map has keys that are not strings.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }

    /// What is wrong with the other shader, when it is over its bound somewhere.
    pub fn failed(&self) -> Option<Box<Diagnostic>> {
        let over = self.distances.iter().filter(|at| !at.within);
        let over: Vec<String> = over.map(|at| format!("{:.2}", at.distance)).collect();
        if over.is_empty() {
            return None;
        }
        let failed = Diagnostic::error(format!(
            "`{}` is over its bound at distance {}",
            self.other,
            over.join(", ")
        ));
        Some(failed.with_note("the bound grows with distance, from 0 at `distance.nearest` to `e_max` at `distance.farthest`: change them in the scene, or look further away with `--at`"))
    }

    /// What a person sees: what was inferred, and a row for each distance.
    pub fn table(&self) -> String {
        let mut out = String::new();
        for (i, inference) in self.inferences.iter().enumerate() {
            let title = if i == 0 { "inferred" } else { "" };
            out += &format!("  {title:<16}{inference}\n");
        }
        out += &format!("  {:<16}{}\n", "original", self.original);
        out += &format!("  {:<16}{}\n", "compared", self.other);
        if let Some(adapter) = &self.adapter {
            out += &format!("  {:<16}{adapter}\n", "drawn by");
        }
        out.push('\n');
        let mut rows = vec![
            [
                "distance", "autoLOD", "error", "floor", "excess", "bound", "view", "tile",
                "shimmer", "max", "PSNR", "FLIP", "cost", "within",
            ]
            .map(str::to_owned),
        ];
        for at in &self.distances {
            let error = &at.error;
            let number = |number: f64| format!("{number:.3}");
            rows.push([
                format!("{:.2}", at.distance),
                at.autolod
                    .map_or("-".to_owned(), |autolod| format!("{autolod:.2}")),
                number(error.rmse),
                number(error.floor),
                number(error.excess),
                number(error.bound),
                number(error.worst_view),
                number(error.worst_tile),
                number((error.shimmer - error.shimmer_floor).max(0.0)),
                number(error.max),
                error
                    .psnr
                    .map_or("-".to_owned(), |psnr| format!("{psnr:.1}")),
                number(error.flip),
                at.ratio
                    .map_or("-".to_owned(), |ratio| format!("{ratio:.2}")),
                if at.within { "yes" } else { "no" }.to_owned(),
            ]);
        }
        out += &columns(&rows, &[false; 14]);
        out += "  view, tile, shimmer: what the worst view and the worst tile add, and how much more it shimmers than the original\n";
        if self.adapter.is_none() {
            out += "  cost is estimated, not timed: executed operations, a texture sample counted as 100\n";
        }
        out
    }
}
