//! What meshes alone, shaders alone and both together come to, for several objects: for `lodc bench table2`.
//!
//! All of it is read off one joint search for each object, so that the same errors and times stand behind every column.
//!
//! This work is based on: Liang 2022, table 2.

use super::clock::untimed;
use super::search::Ready;
use super::{Request, Strategy};
use crate::eval::refusal;
use crate::joint::{Scores, Took};
use crate::search::{self, Progress};
use crate::time::clock::Clock;
use crate::{Diagnostic, Result};
use lodc_passes::autolod::BoundReading;
use std::path::Path;
use std::time::{Duration, Instant};

/// An object, and what levels of it come to.
#[derive(Clone, Debug)]
pub struct Row {
    /// The name of its shader, or of its scene where that has another one.
    pub name: String,
    /// Of its mesh.
    pub triangles: usize,
    /// What the ways to choose levels come to. Times are means over the distances, as shares of the original's.
    pub scores: Scores,
    /// How many levels there are, the original left out.
    pub levels: usize,
    /// The largest share of its bound that a level takes up on pictures that the search has not seen.
    pub held_out: f64,
    /// How many meshes and shaders there were to make pairs of, and how many pairs a distance looked at, at most.
    pub pairs: [usize; 3],
    /// Half of the interval of 99 % of the times of levels as a share of the ratio, at most; nothing where they are estimated.
    pub spread: Option<f64>,
    /// How long the search of shaders took.
    pub shaders_took: Duration,
    /// How long the rest took.
    pub took: Took,
}

/// The table.
#[derive(Debug)]
pub struct Table2 {
    /// A row for each object.
    pub rows: Vec<Row>,
    /// What times were measured on, without one they are estimated.
    pub adapter: Option<String>,
    /// What should be known, located.
    pub warnings: Vec<Box<Diagnostic>>,
}

/// Searches levels of meshes and shaders for each object, and writes nothing. `done` is told of each row.
///
/// # Errors
/// As [`super::compile`], at the first object that cannot be searched.
pub fn table2(
    requests: &[Request],
    progress: &(dyn Fn(Progress) + Sync),
    done: &dyn Fn(&Row),
) -> Result<Table2> {
    // What cannot be read should be known before anything is searched.
    let all: Vec<Ready> = requests.iter().map(Ready::read).collect::<Result<_>>()?;
    let mut table = Table2 {
        rows: Vec::new(),
        adapter: None,
        warnings: Vec::new(),
    };
    for (ready, request) in all.iter().zip(requests) {
        if request.search == Strategy::Greedy {
            return Err(
                Diagnostic::error("shaders alone have no meshes to be compared with")
                    .with_note("ask for `--search separate` or `exhaustive`"),
            );
        }
        ready.may_join(request)?;
        let vertex = ready.vertex()?;
        ready.ends(&vertex)?;
        let kept = ready.kept(request)?;
        let mut watch = match ready.watch(request)? {
            Ok(watch) => watch,
            Err(error) => {
                if table.warnings.is_empty() {
                    table.warnings.push(untimed(&error));
                }
                None
            }
        };
        let start = Instant::now();
        let stand = ready.stand(&vertex);
        let clock = watch.as_mut().map(|watch| watch as &mut dyn Clock);
        let found = search::find_from(&stand, (request.exact, &kept), &[], clock, progress)
            .map_err(|refused| refusal(&refused, &ready.source))?;
        let shaders_took = start.elapsed();
        let clock = watch.as_mut().map(|watch| watch as &mut dyn Clock);
        let Some(joint) = ready.join(request, &vertex, &found, &kept, clock)? else {
            continue;
        };
        let levels = joint.levels.iter().skip(1).map(|level| &level.level);
        let held_out = levels.clone().filter_map(|level| {
            let held_out = level.held_out.as_ref()?;
            let excess = match ready.scene.reading {
                BoundReading::Excess => held_out.excess,
                BoundReading::Paper => held_out.rmse,
            };
            Some(excess / level.error.bound)
        });
        let spreads = levels.clone().flat_map(|level| &level.timed);
        let spreads = spreads.map(|timing| (timing.high - timing.low) / 2.0 / timing.ratio);
        let looked = joint.walked.iter().map(|walked| walked.pairs);
        let row = Row {
            name: name(request),
            triangles: ready.scene.mesh.indices.len() / 3,
            scores: joint.scores,
            levels: joint.levels.len() - 1,
            held_out: held_out.fold(0.0, f64::max),
            pairs: [
                joint.meshes.len() - joint.finer - joint.spawned,
                joint.shaders,
                looked.max().unwrap_or_default(),
            ],
            spread: spreads.reduce(f64::max),
            shaders_took,
            took: joint.took,
        };
        if let Some(watch) = &watch {
            table.adapter = watch.adapters().first().cloned();
        }
        done(&row);
        table.rows.push(row);
    }
    Ok(table)
}

/// What an object is called.
fn name(request: &Request) -> String {
    let file: &Path = request.scene.as_ref().unwrap_or(&request.shader);
    let name = file.file_stem().unwrap_or_default();
    name.to_string_lossy().into_owned()
}
