//! From distances to levels: the cheapest variant at each distance whose error stays within the bound there.
//!
//! Distances are spaced evenly in the logarithm from the nearest to the farthest of the scene. The bound
//! at a distance is Liang's `e_a(d)` (2022, eq. 4). A descent works on a search set of samples; what it
//! finds becomes a level only when all samples confirm it, at the start, in the middle and at the end of the
//! interval in which the level is used, and pictures that the search has not seen do not contradict.

use super::confirm::Checks;
use super::descend::Bottom;
use super::exact::{Exact, Scope};
use super::frontier::{Frontier, Seen};
use super::greedy::{Prices, Variant};
use super::guard::Guard;
use super::interval::Interval;
use super::kept::Kept;
use super::parameters;
use super::samples::{SampleSet, Samples};
use super::timed::{Timed, Times};
use crate::error::{ErrorFigures, HeldOut};
use crate::eval::program::Refused;
use crate::eval::programs::Stand;
use crate::scene::{Scene, Split};
use crate::stability::{Battery, Blamed, Judged, Stiff, Ways};
use crate::time::clock::{Clock, is_faster, worst_ratio};
use crate::time::{Timing, Verdict};
use lodc_passes::{Candidate, Pass, Recipe, Shader, Used, WITH_PARAMETERS, WITH_TEXTURES};

/// Neighbouring levels of which the later saves less than this share of the earlier's cost are merged.
const MERGE_BELOW: f64 = 0.04;

/// How often an interval is searched anew because a hunt brought down what was found.
const HUNTS: usize = 3;

/// A level: a variant and the distance from which it is used.
#[derive(Clone, Debug)]
pub struct Level {
    /// The threshold: halvings of scale on screen since the nearest view.
    pub autolod: f64,
    /// From the eye to the centre of the bounding sphere, in world units.
    pub distance: f64,
    /// Whether it is the original as it stands.
    pub is_original: bool,
    /// How it is made from what the exact tier made of the original; empty for the original.
    pub recipe: Recipe,
    /// The shader that the recipe makes.
    pub shader: Shader,
    /// Its error at `distance`, over the full set of samples.
    pub error: ErrorFigures,
    /// FLIP at `distance`, 0..1.
    pub flip: f64,
    /// Its error there on pictures that decided nothing.
    pub held_out: Option<HeldOut>,
    /// What it uses up at `distance`.
    pub used: Used,
    /// What it costs by the goal, as a share of the original's at the same distance.
    pub cost: f64,
    /// The work as a share of the original's at the same distance: an estimate of the run time.
    pub time: f64,
    /// Its run time at `distance`, of each adapter; none where it was not timed.
    pub timed: Vec<Timing>,
    /// The same of the text that holds all levels and branches, where that was timed.
    pub branching: Vec<Timing>,
    /// What `cost` would be with all that is the same for a whole draw moved to parameters, where the host does not allow
    /// that and it would be less.
    pub with_parameters: Option<f64>,
    /// The same with textures made for levels.
    pub with_textures: Option<f64>,
    /// How it holds inputs beyond the pictures; nothing where it was not asked.
    pub stability: Option<Judged>,
    /// Why it is unstable, where it is and that is allowed.
    pub unstable: Vec<Blamed>,
    /// Jumps and slopes that it has and the original has not, or has elsewhere, and those that are gone.
    pub stiff: Vec<Stiff>,
    /// For each step of the recipe, the RMSE after it, over the samples that the search looked at.
    pub error_after: Vec<f64>,
}

impl Level {
    /// The original, from a distance on.
    fn original(stand: &Stand<'_>, set: &SampleSet<'_>) -> Self {
        Self {
            autolod: threshold(stand.scene, set.distance()),
            distance: set.distance(),
            is_original: true,
            recipe: Recipe::default(),
            shader: stand.base.clone(),
            error: set.floor(),
            flip: set.flip(stand.base).unwrap_or(1.0),
            held_out: None,
            used: set.original().used,
            cost: 1.0,
            time: 1.0,
            timed: Vec::new(),
            branching: Vec::new(),
            with_parameters: None,
            with_textures: None,
            stability: None,
            unstable: Vec::new(),
            stiff: Vec::new(),
            error_after: Vec::new(),
        }
    }

    /// Whether it was timed, and is faster than the original beyond the noise on every adapter.
    fn is_faster(&self) -> bool {
        let mut timed = self.timed.iter();
        !self.timed.is_empty() && timed.all(|timing| timing.verdict() == Verdict::Faster)
    }

    /// What draws the same for less, at the nearest distance.
    fn exact(stand: &Stand<'_>, nearest: &SampleSet<'_>, exact: &Exact) -> Self {
        Self {
            is_original: false,
            shader: exact.shader.clone(),
            used: exact.used[1],
            cost: exact.cost(),
            time: exact.used[1].work.total() / exact.used[0].work.total(),
            ..Self::original(stand, nearest)
        }
    }

    /// What draws the same as the original, from a distance on at which no level before will do any more.
    fn back(stand: &Stand<'_>, set: &SampleSet<'_>, exact: &Exact) -> Result<Self, Refused> {
        let original = Self::original(stand, set);
        if exact.recipe.0.is_empty() {
            return Ok(original);
        }
        let measured = set.measure(&exact.shader)?;
        Ok(Self {
            is_original: false,
            shader: exact.shader.clone(),
            cost: set.share(measured.cost),
            time: measured.used.work.total() / original.used.work.total(),
            used: measured.used,
            ..original
        })
    }
}

/// What was seen at one distance.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct AtDistance {
    /// In world units.
    pub distance: f64,
    /// Its autoLOD value.
    pub autolod: f64,
    /// What the original costs there by the goal.
    pub original: f64,
    /// The original's `E^2` on the search set.
    pub floor_square: f64,
    /// Cheapest first.
    pub frontier: Vec<Seen>,
    /// The run times of those, each of every adapter; none of what was not timed.
    pub timed: Vec<Vec<Timing>>,
    /// How many variants were within the bound on all samples of the scene and were withdrawn, because on pictures
    /// that the search had not seen they were not.
    pub withdrawn: usize,
    /// Variants that were within the bound, and fail on an input on which the original holds.
    pub struck: Vec<Struck>,
}

/// A variant that was struck off, since it is unstable.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Struck {
    /// How it is made from what the exact tier made of the original.
    pub recipe: Recipe,
    /// Why.
    pub blamed: Blamed,
}

/// Everything that a search found.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Found {
    /// What costs no error: every level but the original is made from this.
    pub exact: Exact,
    /// Level 0, the original, and those that are worth having, nearest first.
    pub levels: Vec<Level>,
    /// What was seen at each distance.
    pub distances: Vec<AtDistance>,
    /// How many variants were measured.
    pub variants: u64,
    /// How many of them were timed.
    pub timed: usize,
    /// The adapters that timed them.
    pub adapters: Vec<String>,
    /// Pixels per object unit at the nearest distance, where autoLOD is 0.
    pub rho0: f64,
}

impl Found {
    /// The levels that are written, with their places: all but the original as it stands where it is the first one, since
    /// that is there already.
    pub fn written(&self) -> impl Iterator<Item = (usize, &Level)> {
        let levels = self.levels.iter().enumerate();
        levels.filter(|(at, level)| *at > 0 || !level.is_original)
    }
}

/// How far a search has come.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
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

/// Levels as they are found from distance to distance, and what was learnt on the way.
struct Chain<'a> {
    /// Whether they may ask the host for what the scene allows.
    asks: bool,
    levels: Vec<Level>,
    prices: Prices,
    guard: Guard<'a>,
}

impl<'a> Chain<'a> {
    fn new(asks: bool, first: Level, guard: Guard<'a>) -> Self {
        Self {
            asks,
            levels: vec![first],
            prices: Prices::default(),
            guard,
        }
    }

    fn last(&self) -> &Level {
        &self.levels[self.levels.len() - 1]
    }

    /// Looks for the level of an interval. `plain` is the one there that asks a host for nothing, of a chain that may.
    fn go_on(
        &mut self,
        place: &Place<'a, '_>,
        plain: Option<&Level>,
        mut times: Option<&mut Times<'_>>,
        tally: &mut Tally,
        progress: &(dyn Fn(u64, f64) + Sync),
    ) -> Result<Timed, Refused> {
        let &Place {
            stand,
            exact,
            kept,
            search,
            checks,
            ..
        } = place;
        self.guard.start_at(search.start().distance());
        let base = Variant::new(search, Recipe::default(), exact.shader.clone())?;
        let before = self.last().clone();
        let start = |level: &Level| {
            // What was moved exactly is chosen anew where the level ends.
            let lossy = parameters::without_exact(&level.recipe);
            let (recipe, shader) = match lossy.replay(&exact.shader) {
                Ok(shader) if lossy != level.recipe => (lossy, shader),
                _ => (level.recipe.clone(), level.shader.clone()),
            };
            Variant::new(search, recipe, shader)
        };
        let mut starts = vec![start(&before)?];
        let mut bottom = Bottom {
            interval: search,
            checks,
            asks: self.asks,
            guard: &mut self.guard,
            prices: &mut self.prices,
            frontier: std::mem::take(&mut tally.frontier),
            found: None,
            variants: tally.variants,
            withdrawn: tally.withdrawn,
            struck: std::mem::take(&mut tally.struck),
            progress,
        };
        // What draws the same for less may be a level by itself.
        if exact.cost() < 1.0 - MERGE_BELOW {
            bottom.judge(&base)?;
        }
        if let Some(plain) = plain.filter(|plain| !plain.recipe.0.is_empty()) {
            let plain = start(plain)?;
            if bottom.guard.has_room(&plain.shader) {
                bottom.judge(&plain)?;
                starts.push(plain);
            }
        }
        for old in place.old {
            // What was moved exactly is chosen anew here too.
            let lossy = parameters::without_exact(old);
            let left = lossy.surviving(&exact.shader, stand.base);
            let mut steps = left.recipe.0.iter();
            let is_allowed = steps.all(|step| place.may_take(step, bottom.asks));
            if is_allowed && !left.recipe.0.is_empty() && bottom.guard.has_room(&left.shader) {
                let old = Variant::new(search, left.recipe, left.shader)?;
                bottom.judge(&old)?;
                starts.push(old);
            }
        }
        bottom.find(&base, starts.clone())?;
        for hunts in 1.. {
            let found = bottom.found.as_ref();
            let device = times.as_mut().and_then(|times| times.clock.device());
            let struck = found.map(|found| checks.hunt(found, device)).transpose()?;
            let Some(struck) = struck.flatten() else {
                break;
            };
            if let (Some(_), Some((_, step))) = (&struck.blamed.device, &struck.blamed.candidate) {
                // No input that the evaluator runs tells this of others.
                bottom.guard.forbid(step.clone());
            }
            bottom.struck.push(struck);
            bottom.found = None;
            if hunts == HUNTS {
                break;
            }
            bottom.find(&base, starts.clone())?;
        }
        let timed = match &mut times {
            Some(times) => bottom.choose_by(times)?,
            None => Timed::default(),
        };
        let Bottom {
            frontier,
            found,
            withdrawn,
            mut struck,
            variants,
            ..
        } = bottom;
        for (recipe, failure) in self.guard.unstable() {
            let more = checks.struck(&recipe, &failure);
            let step = |struck: &Struck| {
                let candidate = struck.blamed.candidate.as_ref();
                candidate.map(|(_, candidate)| candidate.clone())
            };
            struck.extend(more.filter(|more| struck.iter().all(|known| step(known) != step(more))));
        }
        *tally = Tally {
            frontier,
            variants,
            withdrawn,
            struck,
        };
        let found = found.and_then(|found| checks.level(&found, search.start(), kept, self.asks));
        // What vertices do weighs more the farther away it is.
        let cost_here = checks.cost(&before.shader)?;
        let without = plain.map(|plain| checks.cost(&plain.shader)).transpose()?;
        let is_dearer = without.is_some_and(|without| cost_here > without);
        // The steps of what was found were sifted since, and the level before is judged where this one begins.
        let mut before_here = Vec::new();
        let found = match (found, times) {
            (Some(level), Some(times)) => {
                let before = (!before.is_original).then_some(&before.shader);
                let shaders: Vec<&Shader> = [&level.shader].into_iter().chain(before).collect();
                let timed = times.clock.time(&shaders, search.start().distance());
                let mut timed = timed.into_iter();
                let of_level = timed.next().unwrap_or_default();
                before_here = timed.next().unwrap_or_default();
                Some(Level {
                    timed: of_level,
                    ..level
                })
            }
            (found, _) => found,
        };
        // What the clock says of both decides where time is all that counts; noise is no gain.
        let by_time = stand.scene.goal.weight_of_time() == 1.0;
        let time_here = match before.is_original {
            true => Some(1.0),
            false => worst_ratio(&before_here),
        };
        let worth = |level: &Level| match (worst_ratio(&level.timed), time_here) {
            (Some(time), Some(here)) if by_time => {
                let gains = match before.is_original {
                    true => level.is_faster(),
                    false => is_faster(&level.timed, &before_here),
                };
                gains && time < (1.0 - MERGE_BELOW) * here
            }
            _ if is_dearer => level.cost < cost_here,
            _ => level.cost < (1.0 - MERGE_BELOW) * cost_here,
        };
        // Without a level here the one before is used on, where it has not been looked at yet.
        let next_level = match found {
            Some(level) if worth(&level) => Some(level),
            _ if before.is_original => None,
            _ if cost_here <= 1.0 && checks.hold(&before.shader) => None,
            Some(level) => Some(level),
            None => Some(Level::back(stand, checks.start(), exact)?),
        };
        if let Some(level) = next_level {
            self.guard.beside(level.shader.clone());
            self.levels.push(level);
        }
        Ok(timed)
    }
}

/// An interval that levels are searched in.
struct Place<'a, 'p> {
    stand: &'a Stand<'a>,
    exact: &'p Exact,
    kept: &'p Kept,
    search: &'p Interval<'a>,
    checks: &'p Checks<'a>,
    /// Recipes that another search has found, which levels may begin with.
    old: &'p [Recipe],
}

impl Place<'_, '_> {
    /// Whether levels may have a step that another search has found; `asks` says whether they may ask the host for what the scene
    /// allows.
    fn may_take(&self, step: &Candidate, asks: bool) -> bool {
        let host = self.stand.scene.host;
        let is_of = |passes: &[&dyn Pass]| passes.iter().any(|pass| pass.name() == step.pass);
        let asks_in_vain = (is_of(WITH_PARAMETERS) && !(asks && host.parameters))
            || (is_of(WITH_TEXTURES) && !(asks && host.textures));
        !asks_in_vain && self.kept.admits(&step.pass) && !self.kept.refuses(step)
    }
}

/// What was seen in an interval so far.
#[derive(Default)]
struct Tally {
    frontier: Frontier,
    variants: u64,
    withdrawn: usize,
    struck: Vec<Struck>,
}

/// Searches the levels of a shader in a scene: what costs no error first, then greedy at each distance, every variant that
/// was seen on the frontier, frontier members confirmed on the full set.
///
/// With a clock, variants are timed, and chosen by that; without, by their estimated time.
///
/// What a host allows opens steps that save much and lead to where little more can be saved. So where it allows anything, levels that
/// ask it for nothing are found as well, and what asks for something goes on from them, too: permission never makes a level
/// dearer, by its estimate.
///
/// # Errors
/// When the evaluator refuses the original, at the expression.
pub fn find(
    stand: &Stand<'_>,
    wanted: (Scope, &Kept),
    clock: Option<&mut dyn Clock>,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Found, Refused> {
    find_from(stand, wanted, &[], clock, progress)
}

/// As [`find`], with recipes that another search has found, for an older version of the source perhaps: what still applies of
/// each is judged and gone on from at every distance, beside what is found without it.
///
/// # Errors
/// As [`find`].
pub fn find_from(
    stand: &Stand<'_>,
    (scope, kept): (Scope, &Kept),
    old: &[Recipe],
    clock: Option<&mut dyn Clock>,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Found, Refused> {
    let scene = stand.scene;
    let mut times = clock.map(Times::new);
    let distances = &scene.distances;
    let nearest = SampleSet::new(stand, distances[0], Samples::Full)?;
    let exact = match scope {
        Scope::None => Exact::none(stand, &nearest),
        Scope::Levels | Scope::All => Exact::find(stand, &nearest, kept)?,
    };
    let mut first = match scope == Scope::All && !exact.recipe.0.is_empty() {
        true => Level::exact(stand, &nearest, &exact),
        false => Level::original(stand, &nearest),
    };
    if let Some(times) = &mut times
        && !first.is_original
    {
        let timed = times.clock.time(&[&first.shader], distances[0]).pop();
        first.timed = timed.unwrap_or_default();
    }
    // Where the original uses nothing of what is to become less, there is nothing to look for.
    let distances = match scene.goal.is_reached(&nearest.original().used) {
        true => &distances[..1],
        false => &distances[..],
    };
    drop(nearest);
    let mut seen = Vec::new();
    let whole = Battery::new(stand)?;
    let battery = Some(&whole).filter(|_| !kept.unstable);
    let guard = || Guard::new(stand, kept).with(battery);
    let chain = |asks| Chain::new(asks, first.clone(), guard());
    let mut without = (scene.host.parameters || scene.host.textures).then(|| chain(false));
    let mut chain = chain(true);
    let (mut variants, mut timed_variants) = (0, 0);
    let mut before_checks = None;
    for (at, distance) in distances.iter().copied().enumerate().skip(1) {
        let next = distances.get(at + 1).copied().unwrap_or(distance * 2.0);
        let middle = (distance * next).sqrt();
        let search = Interval::new(stand, &[distance, next], Samples::Search)?;
        let places = [distance, middle, next];
        let checks = Checks::new(stand, &exact.shader, places, battery, before_checks.take())?;
        let place = Place {
            stand,
            exact: &exact,
            kept,
            search: &search,
            checks: &checks,
            old,
        };
        let mut tally = Tally {
            frontier: match times {
                Some(_) => Frontier::with_near(),
                None => Frontier::default(),
            },
            variants,
            ..Tally::default()
        };
        let tell = |variants, share| {
            progress(Progress {
                distance: at,
                of: distances.len() - 1,
                variants,
                share,
            });
        };
        let levels = chain.levels.len();
        if let Some(without) = &mut without {
            without.go_on(&place, None, None, &mut tally, &tell)?;
        }
        let plain = without.as_ref().map(Chain::last);
        let timed = chain.go_on(&place, plain, times.as_mut(), &mut tally, &tell)?;
        timed_variants += timed.count;
        for level in &mut chain.levels[levels..] {
            level.held_out = Some(test(stand, level)?);
        }
        variants = tally.variants;
        before_checks = Some(checks);
        let original = search.start().original();
        seen.push(AtDistance {
            distance,
            autolod: scene.auto_lod(distance),
            original: original.cost,
            floor_square: original.error.square(),
            frontier: tally.frontier.members().to_vec(),
            timed: timed.frontier,
            withdrawn: tally.withdrawn,
            struck: tally.struck,
        });
    }
    let mut levels = chain.levels;
    examine(stand, (&whole, &exact), &mut levels)?;
    Ok(Found {
        exact,
        levels,
        distances: seen,
        variants,
        timed: timed_variants,
        adapters: times.map_or_else(Vec::new, |times| times.clock.adapters().to_vec()),
        rho0: scene.rho0(),
    })
}

/// Says how levels stand that were not asked, and what is stiff in them.
pub(crate) fn examine(
    stand: &Stand<'_>,
    (battery, exact): (&Battery<'_>, &Exact),
    levels: &mut [Level],
) -> Result<(), Refused> {
    let ways = Ways::new(stand)?;
    for level in levels {
        stand_of(battery, exact, level)?;
        if !level.is_original {
            let recipe = derivation(exact, level);
            level.stiff = ways.compare((stand.base, &recipe), &level.shader)?;
        }
    }
    Ok(())
}

/// How a level is made from the original.
fn derivation(exact: &Exact, level: &Level) -> Recipe {
    let steps = exact.recipe.0.iter().chain(&level.recipe.0);
    Recipe(steps.cloned().collect())
}

/// Says how a level stands that was not asked.
fn stand_of(battery: &Battery<'_>, exact: &Exact, level: &mut Level) -> Result<(), Refused> {
    if level.is_original {
        level.stability = Some(battery.original_alone());
    } else if level.stability.is_none() {
        let judged = battery.judge_and_hunt(&level.shader)?;
        let recipe = derivation(exact, level);
        let first = judged.failures.first();
        let blamed = first.map(|failure| battery.blame((battery.base(), &recipe), failure));
        level.unstable.extend(blamed);
        level.stability = Some(judged);
    }
    Ok(())
}

/// The autoLOD of a distance as a threshold: rounded up to hundredths, so that it reads well and no level
/// begins nearer than where it was confirmed.
pub(crate) fn threshold(scene: &Scene, distance: f64) -> f64 {
    (scene.auto_lod(distance) * 100.0).ceil() / 100.0
}

/// The error of a level on the test split, which decides nothing.
fn test(stand: &Stand<'_>, level: &Level) -> Result<HeldOut, Refused> {
    let set = SampleSet::new(stand, level.distance, Samples::HeldOut(Split::Test))?;
    let (details, original) = set.pair(&level.shader)?;
    Ok(HeldOut::new(&details, original))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compile::normal_form;
    use crate::eval::program::Program;
    use crate::front::Source;
    use std::path::Path;

    #[test]
    fn a_level_that_asks_for_nothing_is_where_others_go_on_from() {
        let source = Source::parse(
            "felt.wgsl",
            "@group(0) @binding(0) var soft: texture_2d<f32>;
             @group(0) @binding(1) var rough: texture_2d<f32>;
             @group(0) @binding(2) var filtering: sampler;
             @fragment fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
                 let dye = textureSample(soft, filtering, uv).xyz;
                 let felt = 0.9 + 0.2 * textureSample(rough, filtering, uv).x;
                 return vec4f(dye * felt, 1.0);
             }",
        )
        .expect("it parses");
        let text = "resolution = [64, 64]
             [textures]
             soft = \"textures/diffuse_lut.png\"
             rough = \"textures/grain_height.png\"";
        let materials = Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata/materials");
        let scene = Scene::resolve(&source, Some((&materials.join("felt.toml"), text)));
        let mut scene = scene.unwrap_or_else(|e| panic!("{e}"));
        scene.distances.truncate(2);
        let base = normal_form(&source).expect("it is small");
        let stage = scene.vertex_stage.clone().expect("lodc supplies one");
        let vertex = Program::compile(&stage.module, 0, &[]).expect("it is plain");
        let mut costs = Vec::new();
        let mut plain = None;
        for textures in [false, true] {
            scene.host.textures = textures;
            let stand = Stand {
                base: &base,
                vertex: &vertex,
                scene: &scene,
            };
            let kept = Kept::default();
            let found = find(&stand, (Scope::None, &kept), None, &|_| {}).expect("it runs");
            let level = &found.levels[found.levels.len() - 1];
            costs.push(level.cost);
            plain.get_or_insert(level.clone());
        }
        assert!(costs[0] < 0.6 && costs[1] <= costs[0], "{costs:?}");

        // One that finds nothing by itself has that level, too.
        let stand = Stand {
            base: &base,
            vertex: &vertex,
            scene: &scene,
        };
        let near = SampleSet::new(&stand, scene.nearest, Samples::Full).expect("it runs");
        let exact = Exact::none(&stand, &near);
        let distance = scene.distances[1];
        let places = [1.0, 1.5, 2.0].map(|times| distance * times);
        let search = Interval::new(&stand, &[distance, 2.0 * distance], Samples::Search);
        let search = search.expect("it runs");
        let checks = Checks::new(&stand, &base, places, None, None).expect("it runs");
        let kept = Kept {
            only: ["no pass".to_owned()].into(),
            ..Kept::default()
        };
        let place = Place {
            stand: &stand,
            exact: &exact,
            kept: &kept,
            search: &search,
            checks: &checks,
            old: &[],
        };
        let found = [None, plain.as_ref()].map(|plain| {
            let first = Level::original(&stand, &near);
            let mut chain = Chain::new(true, first, Guard::new(&stand, &kept));
            let mut tally = Tally::default();
            let gone = chain.go_on(&place, plain, None, &mut tally, &|_, _| {});
            gone.expect("it runs");
            chain.last().cost
        });
        assert_eq!(found, [1.0, costs[0]]);
    }
}
