//! From distances to levels: the cheapest variant at each distance whose error stays within the bound there.
//!
//! Distances are spaced evenly in the logarithm from the nearest to the farthest of the scene. The bound
//! at a distance is Liang's `e_a(d)` (2022, eq. 4). A descent works on a search set of samples; what it
//! finds becomes a level only when the full set confirms it, at the start, in the middle and at the end of the
//! interval in which the level is used.

use super::error::ErrorFigures;
use super::frontier::{Frontier, Seen};
use super::greedy::{Descent, Prices, Variant};
use super::interval::Interval;
use super::samples::{Measured, SampleSet, Samples, Stand};
use crate::eval::program::Refused;
use crate::scene::Scene;
use lodc_passes::{Recipe, Shader, Work};

/// Neighbouring levels of which the later saves less than this share of the earlier's cost are merged.
const MERGE_BELOW: f64 = 0.04;

/// A level: a variant and the distance from which it is used.
#[derive(Clone, Debug)]
pub struct Level {
    /// The threshold: halvings of scale on screen since the nearest view.
    pub autolod: f64,
    /// From the eye to the centre of the bounding sphere, in world units.
    pub distance: f64,
    /// How it is made from the original; empty for the original.
    pub recipe: Recipe,
    /// The shader that the recipe makes.
    pub shader: Shader,
    /// Its error at `distance`, over the full set of samples.
    pub error: ErrorFigures,
    /// Executed work of a covered fragment at `distance`.
    pub work: Work,
    /// The work as a share of the original's at the same distance: an estimate of the run time.
    pub cost: f64,
    /// For each step of the recipe, the RMSE after it, over the full set.
    pub error_after: Vec<f64>,
}

impl Level {
    /// The original, from a distance on.
    fn original(stand: &Stand<'_>, set: &SampleSet<'_>) -> Self {
        Self {
            autolod: threshold(stand.scene, set.distance()),
            distance: set.distance(),
            recipe: Recipe::default(),
            shader: stand.base.clone(),
            error: set.floor(),
            work: set.original().work,
            cost: 1.0,
            error_after: Vec::new(),
        }
    }

    /// Whether it is within the bound at every one of these distances.
    fn holds(&self, checks: &[SampleSet<'_>]) -> bool {
        let holds = |set: &SampleSet<'_>| set.measure(&self.shader).is_ok_and(|m| m.strain <= 1.0);
        self.recipe.0.is_empty() || checks.iter().all(holds)
    }
}

/// What was seen at one distance.
#[derive(Clone, Debug)]
pub struct AtDistance {
    /// In world units.
    pub distance: f64,
    /// Its autoLOD value.
    pub autolod: f64,
    /// The original's own work there.
    pub original: Work,
    /// The original's `E^2` on the search set.
    pub floor_square: f64,
    /// Cheapest first.
    pub frontier: Vec<Seen>,
}

/// Everything that a search found.
#[derive(Clone, Debug)]
pub struct Found {
    /// Level 0, the original, and those that are worth having, nearest first.
    pub levels: Vec<Level>,
    /// What was seen at each distance.
    pub distances: Vec<AtDistance>,
    /// How many variants were measured.
    pub variants: u64,
    /// Pixels per object unit at the nearest distance, where autoLOD is 0.
    pub rho0: f64,
}

/// How far a search has come.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// The distance that is worked on, from 1.
    pub distance: usize,
    /// How many distances there are.
    pub of: usize,
    /// Variants measured so far.
    pub variants: u64,
    /// The cost of the current variant as a share of the original's.
    pub share: f64,
}

/// Searches the levels of a shader in a scene: greedy at each distance, every variant that was seen on
/// the frontier, frontier members confirmed on the full set.
///
/// # Errors
/// When the evaluator refuses the original, at the expression.
pub fn find(
    stand: &Stand<'_>,
    progress: &(dyn Fn(Progress) + Sync),
) -> std::result::Result<Found, Refused> {
    let scene = stand.scene;
    let distances = &scene.distances;
    let nearest = SampleSet::new(stand, distances[0], Samples::Full)?;
    let mut levels = vec![Level::original(stand, &nearest)];
    drop(nearest);
    let mut seen = Vec::new();
    let mut prices = Prices::default();
    let mut variants = 0;
    // The samples at the end of one interval are those at the start of the next.
    let mut end = None;
    for (at, distance) in distances.iter().copied().enumerate().skip(1) {
        let next = distances.get(at + 1).copied().unwrap_or(distance * 2.0);
        let middle = (distance * next).sqrt();
        let search = Interval::new(stand, &[distance, next], Samples::Search)?;
        let descent = Descent {
            interval: &search,
            progress: &|measured, share| {
                progress(Progress {
                    distance: at,
                    of: distances.len() - 1,
                    variants: variants + measured,
                    share,
                });
            },
        };
        let base = Variant::new(&search, Recipe::default(), stand.base.clone())?;
        let before = &levels[levels.len() - 1];
        let start = Variant::new(&search, before.recipe.clone(), before.shader.clone())
            .ok()
            .filter(|variant| variant.measured.strain <= 1.0)
            .unwrap_or_else(|| base.clone());
        let mut frontier = Frontier::default();
        frontier.add(base.seen());
        variants += descent.run(start, &mut prices, &mut frontier);
        let feasible: Vec<&Seen> = frontier
            .members()
            .iter()
            .filter(|member| member.strain <= 1.0)
            .collect();
        let begin = match end.take() {
            Some(set) => set,
            None => SampleSet::new(stand, distance, Samples::Full)?,
        };
        let checks = [
            begin,
            SampleSet::new(stand, middle, Samples::Full)?,
            SampleSet::new(stand, next, Samples::Full)?,
        ];
        let before = &levels[levels.len() - 1];
        let found = cheapest_confirmed(stand, &feasible, &checks);
        let worth = |level: &Level| level.cost < (1.0 - MERGE_BELOW) * before.cost;
        // Without a level here the one before is used on, where it has not been looked at yet.
        let next_level = match found {
            Some(level) if worth(&level) => Some(level),
            _ if before.holds(&checks) => None,
            other => Some(other.unwrap_or_else(|| Level::original(stand, &checks[0]))),
        };
        levels.extend(next_level);
        let [_, _, last] = checks;
        end = Some(last);
        let original = search.start().original();
        seen.push(AtDistance {
            distance,
            autolod: scene.auto_lod(distance),
            original: original.work,
            floor_square: original.error.square(),
            frontier: frontier.members().to_vec(),
        });
    }
    Ok(Found {
        levels,
        distances: seen,
        variants,
        rho0: scene.rho0(),
    })
}

/// The autoLOD of a distance as a threshold: rounded up to hundredths, so that it reads well and no level
/// begins nearer than where it was confirmed.
fn threshold(scene: &Scene, distance: f64) -> f64 {
    (scene.auto_lod(distance) * 100.0).ceil() / 100.0
}

/// The cheapest member that every check passes. Error falls as cost rises along a frontier, so the place is
/// found by bisection, and then confirmed upwards.
fn cheapest_confirmed(
    stand: &Stand<'_>,
    members: &[&Seen],
    checks: &[SampleSet<'_>],
) -> Option<Level> {
    let judge = |member: &Seen| -> Option<Measured> {
        let shader = member.recipe.replay(stand.base).ok()?;
        shader.validate().ok()?;
        let mut first = None;
        for check in checks {
            let measured = check.measure(&shader).ok()?;
            if measured.strain > 1.0 {
                return None;
            }
            first.get_or_insert(measured);
        }
        first
    };
    let (mut low, mut high) = (0, members.len());
    let mut best = None;
    while low < high {
        let middle = low + (high - low) / 2;
        match judge(members[middle]) {
            Some(measured) => {
                best = Some((members[middle], measured));
                high = middle;
            }
            None => low = middle + 1,
        }
    }
    let (member, measured) = best?;
    let start = &checks[0];
    let distance = start.distance();
    let recipe = minimal(stand.base, &member.recipe);
    let shader = recipe.replay(stand.base).ok()?;
    Some(Level {
        autolod: threshold(stand.scene, distance),
        distance,
        error: start.figures(&shader).ok()?,
        shader,
        work: measured.work,
        cost: measured.work.total() / start.original().work.total(),
        error_after: error_after(stand, &recipe, start),
        recipe,
    })
}

/// A recipe without the steps that later ones have made pointless: the same shader, with less to replay and to say.
fn minimal(base: &Shader, recipe: &Recipe) -> Recipe {
    let identity = |recipe: &Recipe| Some(recipe.replay(base).ok()?.fingerprint());
    let goal = identity(recipe);
    let mut kept = recipe.clone();
    for at in (0..recipe.0.len()).rev() {
        let mut fewer = kept.clone();
        fewer.0.remove(at);
        if goal.is_some() && identity(&fewer) == goal {
            kept = fewer;
        }
    }
    kept
}

/// The RMSE after each step of a recipe.
fn error_after(stand: &Stand<'_>, recipe: &Recipe, set: &SampleSet<'_>) -> Vec<f64> {
    let mut shader = stand.base.clone();
    let mut errors = Vec::new();
    for candidate in &recipe.0 {
        let Ok(next) = lodc_passes::recipe::apply(&shader, candidate) else {
            break;
        };
        shader = next;
        match set.measure(&shader) {
            Ok(measured) => errors.push(measured.error.square().sqrt()),
            Err(_) => break,
        }
    }
    errors
}
