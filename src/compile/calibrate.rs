//! Calibrating: variants of shaders, timed on a device, and the cost model that their times give.
//!
//! ```text
//! shader --candidates by chance, a greedy way--> variants x distances --clock--> measurements --> Calibration
//! ```

use super::clock::Timings;
use super::search::Ready;
use super::{Files, Request};
use crate::eval::programs::Stand;
use crate::eval::refusal;
use crate::scene::chance::{child, unit};
use crate::search::{SampleSet, Samples, trajectory};
use crate::time::clock::Clock;
use crate::time::model::{Calibration, Measurement};
use crate::time::{Timing, TimingWarning};
use crate::{Diagnostic, Result};
use lodc_passes::{Fingerprint, Shader, recipe};
use std::collections::BTreeSet;
use std::path::PathBuf;

/// How many variants are timed at a time. What was timed is kept after each.
const BATCH: usize = 6;
/// How many changes variants by chance have, in turns.
const CHANGES: [usize; 6] = [1, 2, 4, 8, 16, 32];

/// What is timed, and where the calibration goes.
#[derive(Clone, Debug, Default)]
pub struct CalibrateRequest {
    /// The shaders, each with its scene; all are timed as the first says.
    pub shaders: Vec<Request>,
    /// How many variants of each shader are timed, beside the original.
    pub variants: usize,
    /// The file that the calibration is written to.
    pub output: Option<PathBuf>,
}

/// What calibrating gives.
#[derive(Debug)]
#[non_exhaustive]
pub struct Calibrated {
    /// The calibration, to be written where a file was asked for.
    pub files: Files,
    /// The calibration itself.
    pub calibration: Calibration,
    /// The adapter.
    pub adapter: String,
    /// How many timings there were.
    pub timings: Timings,
    /// What could not be timed, and why.
    pub problems: Vec<String>,
    /// Of all timings, half of the interval of 99 % as a share of the ratio: the median, and what one in ten exceeds.
    pub spread: [f64; 2],
    /// How many timings had each warning.
    pub warned: Vec<(TimingWarning, usize)>,
}

/// How far it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Calibrating<'a> {
    /// The shader that is timed.
    pub shader: &'a str,
    /// Its place among all, from 0.
    pub place: usize,
    /// How many of its timings there are.
    pub done: usize,
    /// How many there will be.
    pub all: usize,
}

/// Times variants of each shader at the nearest, a middle and the farthest distance of its scene, and fits a model.
///
/// # Errors
/// When a shader or its scene cannot be read, at its place, when there is no device to time on, or when none of the
/// variants could be timed.
pub fn calibrate(
    asked: &CalibrateRequest,
    progress: &dyn Fn(Calibrating<'_>),
) -> Result<Calibrated> {
    let mut measurements = Vec::new();
    let mut timed = Vec::new();
    let mut adapter = String::new();
    let mut timings = Timings::default();
    let mut problems: Vec<String> = Vec::new();
    // What cannot be read should be known before anything is timed.
    let all: Vec<Ready> = asked
        .shaders
        .iter()
        .map(Ready::read)
        .collect::<Result<_>>()?;
    for (place, ready) in all.iter().enumerate() {
        let vertex = ready.vertex()?;
        ready.ends(&vertex)?;
        let stand = ready.stand(&vertex);
        let request = &asked.shaders[place];
        let mut watch = match ready.watch(request)? {
            Ok(Some(watch)) => watch,
            Ok(None) => return Err(Diagnostic::error("estimated times calibrate nothing")),
            Err(error) => return Err(no_device(&error)),
        };
        if let Some(name) = watch.adapters().first() {
            adapter.clone_from(name);
        }
        let name = request.shader.file_name().unwrap_or_default();
        let name = name.to_string_lossy();
        let shaders = variants(ready, &stand, asked.variants)?;
        let distances = distances(ready);
        let whole = shaders.len() * distances.len();
        for (at, distance) in distances.into_iter().enumerate() {
            let refused = |refused| refusal(&refused, &ready.source);
            let set = SampleSet::new(&stand, distance, Samples::Search).map_err(refused)?;
            let mut of_distance: Vec<(u32, Timing)> = Vec::new();
            for (first, batch) in shaders.chunks(BATCH).enumerate() {
                let done = at * shaders.len() + first * BATCH;
                progress(Calibrating {
                    shader: &name,
                    place,
                    done,
                    all: whole,
                });
                let batch: Vec<&Shader> = batch.iter().collect();
                let taken = watch.time(&batch, distance).into_iter().enumerate();
                of_distance.extend(taken.filter_map(|(i, timings)| {
                    // The original is 0.
                    let number = (first * BATCH + i + 1) as u32;
                    Some((number, timings.into_iter().next()?))
                }));
            }
            let mut originals: Vec<f64> = of_distance.iter().map(|(_, t)| t.original_ms).collect();
            originals.sort_by(f64::total_cmp);
            let Some(original_ms) = originals.get(originals.len() / 2).copied() else {
                continue;
            };
            let features = set.features(&set.original());
            measurements.push(Measurement::new(
                (&name, 0),
                (distance, &features),
                original_ms,
                [1.0; 3],
            ));
            for (number, timing) in of_distance {
                let shader = &shaders[number as usize - 1];
                let measured = set.measure(shader).map_err(refused)?;
                measurements.push(Measurement::new(
                    (&name, number),
                    (distance, &set.features(&measured)),
                    // Ratios are of neighbours, and do not drift.
                    timing.ratio * original_ms,
                    [timing.low, timing.ratio, timing.high],
                ));
                timed.push(timing);
            }
        }
        let own = watch.problems();
        problems.extend(own.map(|problem| format!("{name}: {problem}")));
        let Timings {
            taken,
            found,
            missing,
        } = watch.counts;
        timings.taken += taken;
        timings.found += found;
        timings.missing += missing;
    }
    if measurements.is_empty() {
        let error = Diagnostic::error("no variant could be timed");
        return Err(problems.into_iter().fold(error, Diagnostic::with_reason));
    }
    let calibration = Calibration::new(measurements, &adapter);
    let output = asked.output.iter();
    let files = output.map(|file| (file.clone(), calibration.json().into_bytes()));
    Ok(Calibrated {
        files: files.collect(),
        calibration,
        adapter,
        timings,
        problems,
        spread: spread(&timed),
        warned: warned(&timed),
    })
}

fn no_device(missing: &Diagnostic) -> Box<Diagnostic> {
    let error = Diagnostic::error("there is nothing to calibrate on");
    let mut error = error.with_reason(&missing.message);
    error.notes.extend(missing.notes.iter().cloned());
    error
}

/// The nearest distance of a scene, a middle one and the farthest, each once.
fn distances(ready: &Ready) -> Vec<f64> {
    let scene = &ready.scene;
    let middle = (scene.nearest * scene.farthest).sqrt();
    let mut all = vec![scene.nearest, middle, scene.farthest];
    all.dedup();
    all
}

/// Variants of a shader, each once, and none of them the original: half of them those that a greedy search would pass
/// through, and as many with changes by chance.
fn variants(ready: &Ready, stand: &Stand<'_>, count: usize) -> Result<Vec<Shader>> {
    let refused = |refused| refusal(&refused, &ready.source);
    let middle = (ready.scene.nearest * ready.scene.farthest).sqrt();
    let set = SampleSet::new(stand, middle, Samples::Search).map_err(refused)?;
    let mut known: BTreeSet<Fingerprint> = [stand.base.fingerprint()].into();
    let mut found = Vec::new();
    let mut add = |shader: Shader, found: &mut Vec<Shader>| {
        // A texture that was made for it is not bound here.
        let plain = shader.made().next().is_none() && shader.parameter_block().is_none();
        if plain && known.insert(shader.fingerprint()) {
            found.push(shader);
        }
    };
    let kept = ready.kept(&ready.request)?;
    let steps = trajectory(stand, &kept, middle, None).map_err(refused)?;
    let greedy = count.div_ceil(2).min(steps.len().saturating_sub(1));
    for i in 1..=greedy {
        let step = &steps[i * (steps.len() - 1) / greedy];
        if let Ok(shader) = step.recipe.replay(stand.base) {
            add(shader, &mut found);
        }
    }
    let candidates = recipe::candidates(stand.base, &set.facts(stand.base));
    // Few candidates make few variants: it is not tried for ever.
    for i in 0..4 * count {
        if found.len() >= count || candidates.is_empty() {
            break;
        }
        let seed = child(ready.scene.seed, i as u64);
        let mut shader = stand.base.clone();
        for change in 0..CHANGES[i % CHANGES.len()] {
            let chosen = unit(child(seed, change as u64)) * candidates.len() as f64;
            // What an earlier change has left nothing of is not changed.
            if let Ok(changed) = recipe::apply(&shader, &candidates[chosen as usize]) {
                shader = changed;
            }
        }
        add(shader, &mut found);
    }
    Ok(found)
}

fn spread(timings: &[Timing]) -> [f64; 2] {
    let mut widths: Vec<f64> = timings
        .iter()
        .map(|timing| 0.5 * (timing.high - timing.low) / timing.ratio)
        .collect();
    widths.sort_by(f64::total_cmp);
    [0.5, 0.9].map(|part| {
        let at = (part * widths.len() as f64) as usize;
        widths.get(at).copied().unwrap_or(0.0)
    })
}

fn warned(timings: &[Timing]) -> Vec<(TimingWarning, usize)> {
    let all: BTreeSet<TimingWarning> = timings.iter().flat_map(|t| t.warnings.clone()).collect();
    all.into_iter()
        .map(|warning| {
            let with = timings.iter().filter(|t| t.warnings.contains(&warning));
            (warning, with.count())
        })
        .collect()
}
