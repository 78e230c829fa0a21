//! Greedy simplification for one interval of distances: Olano's loop.
//!
//! The price of a candidate is the squared error that it adds, in units of the squared bound, for each unit of work
//! that it saves.
//! Every candidate is priced once; the cheapest is taken; then only the candidates at the front of the queue
//! are priced again, until one that is up to date leads it. That is Olano's "re-compute costs for
//! area local to site" without having to know how far an edit reaches.
//!
//! This work is based on: Olano, Kuehne, Simmons, "Automatic Shader Level of Detail", 2003,
//! section 2; the lazy queue is that of Minoux, "Accelerated greedy algorithms", 1978.

use super::best::best;
use super::frontier::{Frontier, Seen};
use super::guard::Guard;
use super::interval::Interval;
use super::kept::Kept;
use super::parameters;
use super::samples::{Measured, SampleSet};
use crate::eval::program::Refused;
use lodc_passes::{Candidate, Facts, Fingerprint, Recipe, Shader, recipe};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// How many stale candidates at the front of the queue are priced again at a time: enough to keep
/// the cores busy, few enough that little is priced in vain.
const BATCH: usize = 8;
/// How often the front of the queue may be priced again before the best that is known is taken.
const ROUNDS: usize = 6;

/// A variant with what was measured of it.
#[derive(Clone, Debug)]
pub(crate) struct Variant {
    pub(crate) recipe: Recipe,
    pub(crate) shader: Shader,
    pub(crate) measured: Measured,
}

impl Variant {
    /// Measures a shader that a recipe made.
    pub(crate) fn new(
        interval: &Interval<'_>,
        recipe: Recipe,
        shader: Shader,
    ) -> Result<Self, Refused> {
        let measured = interval.measure(&shader)?;
        Ok(Self {
            recipe,
            shader,
            measured,
        })
    }

    pub(crate) fn seen(&self) -> Seen {
        Seen {
            recipe: self.recipe.clone(),
            square: self.measured.error.square(),
            strain: self.measured.strain,
            cost: self.measured.cost,
        }
    }
}

/// What is known of a candidate's price: lower is better, and an edit that costs no error comes
/// before any that does, the largest saving first.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
struct Price(f64, f64);

impl Price {
    fn of(before: &Measured, after: &Measured) -> Option<Self> {
        let saved = before.cost - after.cost;
        let added = after.load - before.load;
        if saved <= 0.0 || saved.is_nan() || added.is_nan() {
            return None;
        }
        Some(if added <= 0.0 {
            Self(0.0, -saved)
        } else {
            Self(added / saved, -saved)
        })
    }
}

/// A candidate is known from step to step by what it does; the numbers that it bakes move a little.
type Key = (String, String, String);

fn key(candidate: &Candidate) -> Key {
    (
        candidate.pass.clone(),
        candidate.site.path().to_owned(),
        candidate.choice.clone(),
    )
}

/// The keys of a step that a recipe has: with the best numbers it goes by another choice than it was offered as.
fn keys(step: &Candidate) -> impl Iterator<Item = Key> {
    let (pass, site, choice) = key(step);
    let words = match choice.as_str() {
        "best" => vec!["mean", "seen-mean", "texture-mean"],
        choice => vec![choice],
    };
    let words: Vec<String> = words.into_iter().map(str::to_owned).collect();
    words
        .into_iter()
        .map(move |word| (pass.clone(), site.clone(), word))
}

/// Prices that earlier steps, or the search at another distance, found. Only their order is used;
/// `None` stands for a candidate that saved no work.
#[derive(Clone, Debug, Default)]
pub(crate) struct Prices(BTreeMap<Key, Option<Price>>);

/// A variant on the way down.
#[derive(Clone, Debug)]
pub(crate) struct Stop {
    pub(crate) variant: Variant,
    /// What was over its bound on the way here. Errors seldom shrink: it is not tried again further down.
    over: BTreeSet<Key>,
}

impl Stop {
    /// A variant from which some candidates are not tried.
    pub(crate) fn without<'a>(
        variant: Variant,
        banned: impl Iterator<Item = &'a Candidate>,
    ) -> Self {
        let over = banned.flat_map(keys).collect();
        Self { variant, over }
    }

    /// Everything may be tried again from here.
    pub(crate) fn forget(&mut self) {
        self.over.clear();
    }
}

impl From<Variant> for Stop {
    fn from(variant: Variant) -> Self {
        let over = BTreeSet::new();
        Self { variant, over }
    }
}

/// What one greedy descent is told.
pub(crate) struct Descent<'a, 'b> {
    /// The samples that it is judged on, within their bounds.
    pub(crate) interval: &'a Interval<'b>,
    /// Whether a host may be asked for what the scene allows.
    pub(crate) asks: bool,
    /// What every step has to pass.
    pub(crate) guard: &'a Guard<'b>,
    /// Told how many variants have been measured, and the cost of the current one as a share of the
    /// original's.
    pub(crate) progress: &'a (dyn Fn(u64, f64) + Sync),
}

/// The candidates of one step, and what this step has found of them.
struct Step<'a> {
    current: &'a Variant,
    candidates: Vec<Candidate>,
    keys: Vec<Key>,
    /// Measured in this step.
    fresh: Vec<Option<Measured>>,
    /// By identity, so that two candidates that do the same are measured once.
    tried: BTreeMap<Fingerprint, Measured>,
}

impl Descent<'_, '_> {
    /// Simplifies the last variant of a way down until nothing is left that saves work within the limit, and adds each
    /// step to the way. Every variant that was measured goes to the frontier. Returns how many that were.
    pub(crate) fn run(
        &self,
        way: &mut Vec<Stop>,
        prices: &mut Prices,
        frontier: &mut Frontier,
    ) -> u64 {
        let Some(Stop {
            variant: mut current,
            mut over,
        }) = way.last().cloned()
        else {
            return 0;
        };
        let mut measured = 0;
        let mut swept = false;
        loop {
            let facts = self.interval.start().facts(&current.shader);
            let host = self.interval.start().stand.scene.host;
            let asks = [self.asks && host.parameters, self.asks && host.textures];
            let candidates = changes(&current.shader, &facts, asks, self.guard.kept());
            let mut step = Step {
                keys: candidates.iter().map(key).collect(),
                fresh: vec![None; candidates.len()],
                tried: BTreeMap::new(),
                candidates,
                current: &current,
            };
            let mut next = None;
            while let Some(leader) =
                self.lead(&mut step, prices, &mut over, frontier, &mut measured, swept)
            {
                next = step.take(leader).filter(|next| self.allows(next));
                if next.is_some() {
                    break;
                }
                over.insert(step.keys[leader].clone());
            }
            let next =
                next.map(|next| self.with_best_numbers(next, &current, frontier, &mut measured));
            match next {
                Some(next) => {
                    current = next;
                    swept = false;
                    way.push(Stop {
                        variant: current.clone(),
                        over: over.clone(),
                    });
                }
                // What saved nothing may save something now that its other users are gone.
                None if !swept => swept = true,
                None => return measured,
            }
        }
    }

    fn allows(&self, variant: &Variant) -> bool {
        self.guard
            .allows(&variant.recipe, &variant.shader, &variant.measured)
    }

    /// The variant with the best numbers in its last step, found only now that it is worth a step.
    fn with_best_numbers(
        &self,
        mut next: Variant,
        current: &Variant,
        frontier: &mut Frontier,
        measured: &mut u64,
    ) -> Variant {
        let better = next
            .recipe
            .0
            .last()
            .and_then(|last| best(self.interval, &current.shader, last, &next.measured));
        let Some(better) = better else {
            return next;
        };
        let mut recipe = next.recipe.clone();
        recipe.0.pop();
        recipe.0.push(better.candidate);
        if self.guard.allows(&recipe, &better.shader, &better.measured) {
            *measured += 1;
            next.recipe = recipe;
            next.shader = better.shader;
            next.measured = better.measured;
            frontier.add(next.seen());
        }
        next
    }

    /// The candidate with the best price that this step has confirmed.
    fn lead(
        &self,
        step: &mut Step<'_>,
        prices: &mut Prices,
        over: &mut BTreeSet<Key>,
        frontier: &mut Frontier,
        measured: &mut u64,
        sweep: bool,
    ) -> Option<usize> {
        let all = 0..step.candidates.len();
        let mut batch: Vec<usize> = all
            .clone()
            .filter(|i| match prices.0.get(&step.keys[*i]) {
                None => true,
                Some(None) => sweep && step.fresh[*i].is_none(),
                Some(Some(_)) => false,
            })
            .collect();
        for round in 0.. {
            step.measure(self, &batch, prices, over, frontier);
            *measured += batch.len() as u64;
            let share = step.current.measured.cost / self.interval.start().original().cost;
            (self.progress)(*measured, share);
            let mut queue: Vec<(Price, usize)> = all
                .clone()
                .filter(|i| !over.contains(&step.keys[*i]))
                .filter_map(|i| Some((prices.0.get(&step.keys[i]).copied()??, i)))
                .collect();
            let kept = self.guard.kept();
            let last = |i: usize| !kept.is_first(&step.candidates[i]);
            queue.sort_by(|a, b| {
                last(a.1)
                    .cmp(&last(b.1))
                    .then(a.0.0.total_cmp(&b.0.0))
                    .then(a.0.1.total_cmp(&b.0.1))
                    .then(a.1.cmp(&b.1))
            });
            let leader = queue.iter().position(|(_, i)| step.fresh[*i].is_some());
            if leader == Some(0) || queue.is_empty() || (round >= ROUNDS && leader.is_some()) {
                return leader.map(|at| queue[at].1);
            }
            batch = queue
                .iter()
                .map(|(_, i)| *i)
                .filter(|i| step.fresh[*i].is_none())
                .take(BATCH)
                .collect();
        }
        None
    }
}

impl Step<'_> {
    /// Measures candidates in parallel and notes their prices.
    fn measure(
        &mut self,
        descent: &Descent<'_, '_>,
        batch: &[usize],
        prices: &mut Prices,
        over: &mut BTreeSet<Key>,
        frontier: &mut Frontier,
    ) {
        let results: Vec<Option<(Fingerprint, Measured, Option<Candidate>)>> = batch
            .par_iter()
            .map(|i| {
                let candidate = &self.candidates[*i];
                let shader = recipe::apply(&self.current.shader, candidate).ok()?;
                let fingerprint = shader.fingerprint();
                let measured = match self.tried.get(&fingerprint) {
                    Some(measured) => *measured,
                    None => descent.interval.measure(&shader).ok()?,
                };
                let pass = self.current.shader.passes().of_name(&candidate.pass);
                if pass.is_ok_and(|pass| pass.guesses(candidate))
                    && let Some(better) =
                        best(descent.interval, &self.current.shader, candidate, &measured)
                {
                    let fingerprint = better.shader.fingerprint();
                    return Some((fingerprint, better.measured, Some(better.candidate)));
                }
                Some((fingerprint, measured, None))
            })
            .collect();
        for (i, result) in batch.iter().copied().zip(results) {
            let mut price = None;
            if let Some((fingerprint, measured, better)) = result {
                if let Some(better) = better {
                    self.candidates[i] = better;
                }
                price = Price::of(&self.current.measured, &measured);
                self.tried.insert(fingerprint, measured);
                self.fresh[i] = Some(measured);
                let mut recipe = self.current.recipe.clone();
                recipe.0.push(self.candidates[i].clone());
                frontier.add(Seen {
                    recipe,
                    square: measured.error.square(),
                    strain: measured.strain,
                    cost: measured.cost,
                });
                let before = self.current.measured.error.square();
                let added = (measured.error.square() - before).max(0.0).sqrt();
                let most = descent.guard.kept().most(&self.candidates[i]);
                if !descent.guard.admits(&measured) || added > most {
                    over.insert(self.keys[i].clone());
                }
            }
            prices.0.insert(self.keys[i].clone(), price);
        }
    }

    /// The variant that a measured candidate makes.
    fn take(&self, i: usize) -> Option<Variant> {
        let mut recipe = self.current.recipe.clone();
        recipe.0.push(self.candidates[i].clone());
        Some(Variant {
            recipe,
            shader: recipe::apply(&self.current.shader, &self.candidates[i]).ok()?,
            measured: self.fresh[i]?,
        })
    }
}

/// What may be done to a shader that costs error: by passes that ask the host for parameters or for textures only where that is wanted.
pub(crate) fn changes(
    shader: &Shader,
    facts: &Facts,
    [parameters, textures]: [bool; 2],
    kept: &Kept,
) -> Vec<Candidate> {
    let passes = shader.passes().asking(parameters, textures);
    // What is exact was done before, or is not wanted.
    let passes = passes.filter(|pass| !pass.is_exact() && kept.admits(pass.name()));
    let all = passes.flat_map(|pass| pass.candidates(shader, facts));
    all.filter(|candidate| !parameters::is_exact(candidate) && !kept.refuses(candidate))
        .collect()
}

/// Each candidate applied alone to a shader, in parallel; `None` where it does not apply.
pub fn try_each(
    set: &SampleSet<'_>,
    shader: &Shader,
    candidates: &[Candidate],
) -> Vec<(Candidate, Option<Measured>)> {
    candidates
        .par_iter()
        .map(|candidate| {
            let measured = recipe::apply(shader, candidate)
                .ok()
                .and_then(|shader| set.measure(&shader).ok());
            (candidate.clone(), measured)
        })
        .collect()
}
