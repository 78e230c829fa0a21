//! The same choice by the clock: which of the variants of one interval is fastest, measured.
//!
//! All members of the frontier are timed, and what was found by the estimate. A model of run times is refined by what is known so far, and ranks what
//! else was seen and holds its bound on the search set: a few at a time, what it puts within reach of the fastest is timed
//! too, until nothing untimed is. The fastest that all samples confirm is the result, unless the estimate's own choice is as
//! fast within the noise.

use super::confirm::Finding;
use super::descend::{Bottom, Confirmed};
use super::frontier::Seen;
use crate::eval::program::Refused;
use crate::time::Timing;
use crate::time::clock::{Clock, is_faster, worst_ratio, worst_regrets};
use crate::time::model::{Features, Model};
use lodc_passes::{Fingerprint, Recipe, Shader};
use std::collections::BTreeMap;

/// How many variants beside the frontier are ranked: those that cost least.
const NEAR: usize = 256;
/// How many variants are timed at a time between two corrections of the estimate.
const BATCH: usize = 8;
/// How often that is done.
const ROUNDS: usize = 6;
/// The least relative error that the estimate is thought to have.
const LEAST_REACH: f64 = 0.05;

/// A variant that may be timed.
struct Runner {
    recipe: Recipe,
    shader: Shader,
    /// What it costs by the goal, as a share of the original's, estimated.
    cost: f64,
    /// Its estimated time as a share of the original's.
    estimate: f64,
    /// What it executes.
    features: Features,
    /// Its place in the frontier.
    member: Option<usize>,
    /// What all samples say; `None` before they were asked.
    finding: Option<Finding>,
    timed: Vec<Timing>,
    /// Whether it was tried to be timed.
    tried: bool,
}

/// What the clock said of one interval.
#[derive(Default)]
pub(super) struct Timed {
    /// The timings of the frontier's members, in their order; of one that could not be timed, none.
    pub(super) frontier: Vec<Vec<Timing>>,
    /// How many variants were timed.
    pub(super) count: usize,
}

impl Bottom<'_, '_> {
    /// Times what was seen, and finds the fastest variant that all samples confirm in the place of the one with the least
    /// estimated cost.
    pub(super) fn choose_by(&mut self, times: &mut Times<'_>) -> Result<Timed, Refused> {
        let distance = self.checks.start().distance();
        let start = self.interval.start();
        let original = start.features(&start.original());
        let mut runners = self.runners()?;
        let first: Vec<usize> = (0..runners.len())
            .filter(|&at| runners[at].member.is_some() || runners[at].finding.is_some())
            .collect();
        times.time(&mut runners, &first, (distance, &original));
        let goal = start.stand.scene.goal;
        let rounds = match goal.weight_of_time() > 0.0 {
            true => ROUNDS,
            false => 0,
        };
        for _ in 0..rounds {
            let next = self.within_reach(&mut runners, &times.refined(), &original)?;
            if next.is_empty() {
                break;
            }
            times.time(&mut runners, &next, (distance, &original));
        }
        let winner = self.winner(&mut runners)?;
        let mut timed = Timed {
            frontier: vec![Vec::new(); self.frontier.members().len()],
            count: (runners.iter())
                .filter(|runner| !runner.timed.is_empty())
                .count(),
        };
        for runner in &runners {
            if let Some(member) = runner.member {
                timed.frontier[member].clone_from(&runner.timed);
            }
        }
        if let Some(winner) = winner {
            let Runner {
                recipe, finding, ..
            } = runners.swap_remove(winner);
            if let Some(Finding::Confirmed(measured)) = finding {
                self.found = Some(Confirmed { recipe, measured });
            }
        }
        Ok(timed)
    }

    /// What was found, the frontier, and what is near to it, each shader once.
    fn runners(&self) -> Result<Vec<Runner>, Refused> {
        let mut runners: Vec<Runner> = Vec::new();
        let mut known: BTreeMap<Fingerprint, usize> = BTreeMap::new();
        let mut add = |recipe: &Recipe, member, finding| -> Result<(), Refused> {
            let Ok(shader) = recipe.replay(self.checks.base()) else {
                return Ok(());
            };
            let identity = shader.fingerprint();
            if let Some(&same) = known.get(&identity) {
                let same: &mut Runner = &mut runners[same];
                same.member = same.member.or(member);
                return Ok(());
            }
            known.insert(identity, runners.len());
            let start = self.interval.start();
            let (seen, original) = (start.measure(&shader)?, start.original());
            runners.push(Runner {
                recipe: recipe.clone(),
                cost: start.share(seen.cost),
                estimate: seen.used.work.total() / original.used.work.total(),
                features: start.features(&seen),
                shader,
                member,
                finding,
                timed: Vec::new(),
                tried: false,
            });
            Ok(())
        };
        if let Some(found) = &self.found {
            add(
                &found.recipe,
                None,
                Some(Finding::Confirmed(found.measured)),
            )?;
        }
        for (at, seen) in self.frontier.members().iter().enumerate() {
            add(&seen.recipe, Some(at), None)?;
        }
        let mut near: Vec<&Seen> = self.frontier.near().iter().collect();
        near.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        for seen in near.into_iter().take(NEAR) {
            add(&seen.recipe, None, None)?;
        }
        Ok(runners)
    }

    /// The variants that have not been timed, and that a model puts nearest to the fastest or before it: those that all
    /// samples confirm.
    fn within_reach(
        &self,
        runners: &mut [Runner],
        model: &Model,
        original: &Features,
    ) -> Result<Vec<usize>, Refused> {
        let predicted: Vec<f64> = (runners.iter())
            .map(|runner| model.ratio(&runner.features, original))
            .collect();
        let known = runners.iter().zip(&predicted);
        let mut off: Vec<f64> = known
            .filter_map(|(runner, predicted)| {
                Some((worst_ratio(&runner.timed)? / predicted).ln().abs())
            })
            .collect();
        off.sort_by(f64::total_cmp);
        let spread = off.get(off.len() / 2).map_or(0.0, |off| off.exp_m1());
        let best = (runners.iter())
            .filter(|runner| matches!(runner.finding, Some(Finding::Confirmed(_))))
            .filter_map(|runner| self.score(runner))
            .fold(f64::INFINITY, f64::min);
        let reach = best * (1.0 + spread.max(LEAST_REACH));
        let mut untimed: Vec<(f64, usize)> = (runners.iter().zip(predicted).enumerate())
            .filter(|(_, (runner, _))| !runner.tried)
            .map(|(at, (runner, predicted))| (self.weighed(runner, predicted), at))
            .filter(|(score, _)| *score < reach)
            .collect();
        untimed.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut next = Vec::new();
        for (_, at) in untimed {
            let runner = &mut runners[at];
            let finding = match runner.finding {
                Some(finding) => finding,
                None => self.checks.judge(&runner.shader)?.finding,
            };
            runner.finding = Some(finding);
            match finding {
                Finding::Confirmed(_) => next.push(at),
                Finding::Over | Finding::Withdrawn | Finding::Unstable => runner.tried = true,
            }
            if next.len() == BATCH {
                break;
            }
        }
        Ok(next)
    }

    /// What a variant costs by the goal, as a share of the original's, with its time as it was measured.
    fn score(&self, runner: &Runner) -> Option<f64> {
        Some(self.weighed(runner, worst_ratio(&runner.timed)?))
    }

    fn weighed(&self, runner: &Runner, time: f64) -> f64 {
        let goal = self.interval.start().stand.scene.goal;
        runner.cost + goal.weight_of_time() * (time - runner.estimate)
    }

    /// The fastest that all samples confirm; the estimate's choice where nothing is faster beyond the noise.
    fn winner(&mut self, runners: &mut [Runner]) -> Result<Option<usize>, Refused> {
        let chosen = self.found.as_ref().map(|_| 0);
        let goal = self.interval.start().stand.scene.goal;
        if goal.weight_of_time() == 0.0 {
            return Ok(chosen);
        }
        let timings: Vec<&[Timing]> = runners.iter().map(|runner| &*runner.timed).collect();
        let regrets = worst_regrets(&timings);
        let ratios = timings.iter().filter_map(|timings| worst_ratio(timings));
        let least = ratios.fold(f64::INFINITY, f64::min);
        let mut order: Vec<(f64, usize)> = (regrets.iter().enumerate())
            .filter(|(_, regret)| regret.is_finite())
            .map(|(at, regret)| (self.weighed(&runners[at], least * regret), at))
            .collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for (_, at) in order {
            if Some(at) == chosen {
                return Ok(chosen);
            }
            if let Some(chosen) = chosen
                && !runners[chosen].timed.is_empty()
                && !is_faster(&runners[at].timed, &runners[chosen].timed)
            {
                continue;
            }
            let finding = match runners[at].finding {
                Some(finding) => finding,
                None => self.checks.judge(&runners[at].shader)?.finding,
            };
            runners[at].finding = Some(finding);
            if matches!(finding, Finding::Confirmed(_)) {
                return Ok(Some(at));
            }
        }
        Ok(chosen)
    }
}

/// The clock, with the model that is refined by what it said.
pub(super) struct Times<'c> {
    pub(super) clock: &'c mut dyn Clock,
    model: Model,
    /// What was timed: what it executes, what the original does, and the ratio of their times.
    known: Vec<(Features, Features, f64)>,
}

impl<'c> Times<'c> {
    pub(super) fn new(clock: &'c mut dyn Clock) -> Self {
        Self {
            model: clock.model(),
            known: Vec::new(),
            clock,
        }
    }

    /// Times some of the variants at a distance, where the original executes what is given.
    fn time(
        &mut self,
        runners: &mut [Runner],
        which: &[usize],
        (distance, original): (f64, &Features),
    ) {
        for part in which.chunks(BATCH) {
            let shaders: Vec<&Shader> = part.iter().map(|&at| &runners[at].shader).collect();
            let timings = self.clock.time(&shaders, distance);
            for (&at, timed) in part.iter().zip(timings) {
                let runner = &mut runners[at];
                runner.timed = timed;
                runner.tried = true;
                if let Some(ratio) = worst_ratio(&runner.timed) {
                    let row = (runner.features, *original, ratio);
                    self.known.push(row);
                }
            }
        }
    }

    fn refined(&self) -> Model {
        self.model.refined(&self.known)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compile::normal_form;
    use crate::eval::program::Program;
    use crate::eval::programs::Stand;
    use crate::front::Source;
    use crate::scene::Scene;
    use crate::search::{Found, Kept, Scope, find};
    use lodc_mesh::Mesh;
    use lodc_passes::Stage;
    use lodc_passes::cost::of_function;
    use std::path::Path;
    use std::sync::Arc;

    /// A clock that says what a function of the static work makes of it, relative to the original's.
    struct Said<'a> {
        base: &'a Shader,
        adapters: Vec<String>,
        says: &'a dyn Fn(f64) -> Option<f64>,
    }

    impl Clock for Said<'_> {
        fn adapters(&self) -> &[String] {
            &self.adapters
        }

        fn time(&mut self, variants: &[&Shader], _: f64) -> Vec<Vec<Timing>> {
            let work = |shader: &Shader| {
                let entry = shader.index(Stage::Fragment).unwrap_or(0);
                let module = shader.module();
                of_function(module, &module.entry_points[entry].function)
                    .map_or(0.0, |work| work.total())
            };
            let whole = work(self.base);
            let timing = |ratio: f64| Timing::made_up(ratio, 0.001, 0.001);
            let said = variants
                .iter()
                .map(|shader| (self.says)(work(shader) / whole));
            said.map(|ratio| ratio.map(timing).into_iter().collect())
                .collect()
        }

        fn time_on(&mut self, pairs: &[(&Arc<Mesh>, &Shader)], distance: f64) -> Vec<Vec<Timing>> {
            let shaders: Vec<&Shader> = pairs.iter().map(|(_, shader)| *shader).collect();
            self.time(&shaders, distance)
        }
    }

    const SHADER: &str = "
        @fragment fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
            let rim = pow(uv.x, 4.0) + 0.2 * uv.y;
            let glow = exp(uv.y) * 0.1 + sin(uv.x * 3.0) * 0.02;
            let ripple = sin(uv.x * 40.0 + uv.y) * 0.03;
            return vec4f(rim, glow + ripple, ripple, 1.0);
        }";

    fn found(says: Option<&dyn Fn(f64) -> Option<f64>>) -> Found {
        let source = Source::parse("said.wgsl", SHADER).expect("it parses");
        let base = normal_form(&source).expect("it is small");
        let text = "resolution = [24, 24]\nlevels = 3\noffsets = 2\n";
        let scene = Scene::resolve(&source, Some((Path::new("said.toml"), text)));
        let scene = scene.unwrap_or_else(|e| panic!("{e}"));
        let stage = scene.vertex_stage.as_ref().expect("lodc supplies one");
        let vertex = Program::compile(&stage.module, 0, &[]).expect("it is plain");
        let stand = Stand {
            base: &base,
            vertex: &vertex,
            scene: &scene,
        };
        let mut clock = says.map(|says| Said {
            base: &base,
            adapters: vec!["a clock".into()],
            says,
        });
        let clock = clock.as_mut().map(|clock| clock as &mut dyn Clock);
        find(&stand, (Scope::Levels, &Kept::default()), clock, &|_| {}).expect("it runs")
    }

    #[test]
    fn a_clock_that_agrees_changes_nothing() {
        let (estimated, timed) = (found(None), found(Some(&|work| Some(work))));
        assert!(estimated.levels.len() > 1 && estimated.timed == 0);
        let recipes = |found: &Found| -> Vec<Recipe> {
            found
                .levels
                .iter()
                .map(|level| level.recipe.clone())
                .collect()
        };
        assert_eq!(recipes(&estimated), recipes(&timed));
        assert!(timed.timed > 0 && timed.adapters == ["a clock"]);
        for level in timed.levels.iter().skip(1) {
            assert!(worst_ratio(&level.timed).is_some_and(|ratio| ratio < 1.0));
        }
        for at in &timed.distances {
            assert_eq!(at.timed.len(), at.frontier.len());
            assert!(at.timed.iter().all(|timed| timed.len() == 1));
        }
    }

    #[test]
    fn nothing_is_a_level_that_the_clock_finds_no_faster() {
        for says in [|work: f64| Some(2.0 - work), |_| Some(1.0)] {
            assert_eq!(found(Some(&says)).levels.len(), 1);
        }
    }

    #[test]
    fn the_clock_decides_against_the_estimate() {
        // What is nearly as dear as the original is fast, what is cheap is slow.
        let says = |work: f64| {
            Some(if work >= 0.999 {
                1.0
            } else {
                0.2 + 0.3 * (1.0 - work)
            })
        };
        let timed = found(Some(&says));
        let [_, first, ..] = &timed.levels[..] else {
            panic!("there is no level");
        };
        let [estimated, other, ..] = &found(None).levels[..] else {
            panic!("there is no level");
        };
        assert!(
            estimated.is_original && first.time > other.time,
            "{} {}",
            first.time,
            other.time
        );
    }

    #[test]
    fn what_cannot_be_timed_is_chosen_by_its_estimate() {
        let (estimated, untimed) = (found(None), found(Some(&|_| None)));
        assert_eq!(estimated.levels.len(), untimed.levels.len());
        assert_eq!(untimed.timed, 0);
        for (a, b) in estimated.levels.iter().zip(&untimed.levels) {
            assert_eq!((&a.recipe, a.cost), (&b.recipe, b.cost));
        }
    }
}
