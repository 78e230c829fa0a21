//! All pairs that may become levels, at all distances: what there is to choose from, and the plans that are made of it.
//!
//! Pairs are measured at the scene's distances, and at twice the farthest, where the last level ends. In between, what a pair adds to the error, what
//! it takes and what is seen where it replaces another are interpolated in the logarithm of the distance. Bins divide the
//! way from one distance to the next evenly. How much of the time an object is seen in a bin is its width in the logarithm: a
//! scene says nothing of that.

use super::confirm::Refuted;
use super::seen::{At, Candidates, Seen, strain};
use crate::eval::program::Refused;
use crate::scene::Scene;
use lodc_joint::{Choice, MERGE_BELOW, Pair, Prices, Score, merge, smoothest};
use std::collections::BTreeSet;
use std::convert::Infallible;

/// There are at least so many bins.
const BINS: usize = 32;

/// By how much a load is corrected at most by one measurement.
const MOST_CORRECTION: f64 = 4.0;

/// What has been refuted so often may be used nowhere.
const PATIENCE: usize = 6;

/// A pair in neighbouring bins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Run {
    /// Which one.
    pub(super) pair: Pair,
    /// Its place in the table.
    place: usize,
    /// The first bin.
    bin: usize,
    /// Where it begins, world units.
    pub(super) from: f64,
    /// Where it ends.
    pub(super) until: f64,
}

/// What was measured of all pairs.
#[derive(Clone)]
pub(super) struct Table<'a> {
    scene: &'a Scene,
    pub(super) distances: Vec<f64>,
    /// Bins from each distance to the next.
    per: usize,
    pub(super) pairs: Vec<Pair>,
    /// For each distance, each pair.
    seen: Vec<Vec<Seen>>,
    /// For each distance, what is seen of each pair in place of each other one.
    shown: Vec<Vec<f64>>,
    /// What the load of each pair is multiplied by, since all samples said so.
    factors: Vec<f64>,
    refuted: Vec<usize>,
    barred: BTreeSet<(usize, usize)>,
    prices: Prices,
}

impl<'a> Table<'a> {
    /// Measures pairs at all distances; the first is the original.
    pub(super) fn new(
        candidates: &'a Candidates<'a>,
        pairs: Vec<Pair>,
        prices: Prices,
    ) -> Result<Self, Refused> {
        let scene = candidates.stands[0].scene;
        let mut distances = scene.distances.clone();
        distances.push(2.0 * scene.farthest);
        let meshes: BTreeSet<usize> = pairs.iter().map(|pair| pair.mesh).collect();
        let meshes: Vec<usize> = meshes.into_iter().collect();
        let (mut seen, mut shown) = (Vec::new(), Vec::new());
        for distance in &distances {
            let at = At::new(candidates, &meshes, *distance)?;
            seen.push(pairs.iter().map(|pair| at.seen(*pair)).collect());
            let pictures: Vec<Vec<[f32; 6]>> = pairs.iter().map(|pair| at.left(*pair)).collect();
            let of_all = pictures.iter().flat_map(|one| {
                let others = pictures.iter();
                others.map(|other| at.between(one, other))
            });
            shown.push(of_all.collect());
        }
        Ok(Self {
            scene,
            per: BINS.div_ceil(distances.len() - 1),
            distances,
            seen,
            shown,
            factors: vec![1.0; pairs.len()],
            refuted: vec![0; pairs.len()],
            barred: BTreeSet::new(),
            pairs,
            prices,
        })
    }

    /// The same without some pairs; the original stays.
    pub(super) fn without(mut self, is: impl Fn(&Pair) -> bool) -> Self {
        for (refuted, pair) in self.refuted.iter_mut().zip(&self.pairs).skip(1) {
            if is(pair) {
                *refuted = PATIENCE;
            }
        }
        self
    }

    /// Puts what a clock says in the place of what the model does: for each distance and each pair its time as a share of the original's.
    pub(super) fn timed(&mut self, times: &[Vec<f64>]) {
        for (seen, times) in self.seen.iter_mut().zip(times) {
            for (seen, time) in seen.iter_mut().zip(times) {
                seen.time = *time;
            }
        }
    }

    fn bins(&self) -> usize {
        self.per * (self.distances.len() - 1)
    }

    /// What lies where a bin begins, or the last one ends, of something that is known at the distances.
    fn between(&self, bin: usize, of: impl Fn(usize) -> f64) -> f64 {
        let (at, part) = (bin / self.per, bin % self.per);
        match part {
            0 => of(at),
            _ => {
                let part = part as f64 / self.per as f64;
                (1.0 - part) * of(at) + part * of(at + 1)
            }
        }
    }

    fn distance(&self, bin: usize) -> f64 {
        match bin % self.per {
            0 => self.distances[bin / self.per],
            _ => libm::exp(self.between(bin, |at| libm::log(self.distances[at]))),
        }
    }

    /// How much of the bound a pair uses up where a bin begins.
    fn strain(&self, bin: usize, pair: usize) -> f64 {
        let load = self.between(bin, |at| self.seen[at][pair].load);
        strain(
            self.factors[pair] * load,
            self.scene.bound(self.distance(bin)),
        )
    }

    /// Whether a pair may be used in a bin: from its beginning to its end. In the first one nothing but the original.
    fn allows(&self, bin: usize, pair: usize) -> bool {
        pair == 0
            || bin > 0
                && self.refuted[pair] < PATIENCE
                && !self.barred.contains(&(bin, pair))
                && [bin, bin + 1]
                    .into_iter()
                    .all(|bin| self.strain(bin, pair) <= 1.0)
    }

    /// Whether it may be used from a distance to the next.
    fn allows_from(&self, at: usize, pair: usize) -> bool {
        (at * self.per..(at + 1) * self.per).all(|bin| self.allows(bin, pair))
    }

    fn choice(&self) -> Choice {
        let bins = 0..self.bins();
        let pairs = || 0..self.pairs.len();
        let time = |bin, pair: usize| self.between(bin, |at| self.seen[at][pair].time);
        Choice {
            shares: bins
                .clone()
                .map(|bin| libm::log(self.distance(bin + 1) / self.distance(bin)))
                .collect(),
            times: bins
                .clone()
                .map(|bin| {
                    let times =
                        pairs().map(|pair| f64::midpoint(time(bin, pair), time(bin + 1, pair)));
                    times.collect()
                })
                .collect(),
            allowed: bins
                .map(|bin| pairs().map(|pair| self.allows(bin, pair)).collect())
                .collect(),
            prices: self.prices,
        }
    }

    fn shown(&self, bin: usize, from: usize, to: usize) -> f64 {
        self.between(bin, |at| self.shown[at][from * self.pairs.len() + to])
    }

    /// The plan that comes to least.
    pub(super) fn plan(&self) -> Vec<usize> {
        let best = self
            .choice()
            .best(|bin, from, to| self.shown(bin, from, to));
        // The original may be used everywhere.
        best.unwrap_or_else(|| vec![0; self.bins()])
    }

    /// The fastest pair of each bin.
    pub(super) fn fastest(&self) -> Vec<usize> {
        let fastest = self.choice().fastest();
        fastest.unwrap_or_else(|| vec![0; self.bins()])
    }

    /// What the paper's steps choose: the smoothest path through the pairs that are about the fastest at each distance but the first, without the
    /// levels that gain little.
    pub(super) fn paper(&self, near: &[Vec<Pair>]) -> Vec<usize> {
        let original = [vec![0]].into_iter();
        let rest = near.iter().enumerate().map(|(at, near)| {
            let places = (0..self.pairs.len()).filter(|place| near.contains(&self.pairs[*place]));
            let mut places: Vec<usize> = places
                .filter(|place| self.allows_from(at + 1, *place))
                .collect();
            if places.is_empty() {
                places.push(0);
            }
            places
        });
        let candidates: Vec<Vec<usize>> = original.chain(rest).collect();
        let counts: Vec<usize> = candidates.iter().map(Vec::len).collect();
        let shown = |at: usize, a: usize, b: usize| {
            let (from, to) = (candidates[at - 1][a], candidates[at][b]);
            Ok::<_, Infallible>(self.shown(at * self.per, from, to))
        };
        let Ok(path) = smoothest(&counts, shown);
        let path = path.map_or_else(Vec::new, |(path, _)| path);
        let path: Vec<usize> = path
            .iter()
            .zip(&candidates)
            .map(|(at, of)| of[*at])
            .collect();
        let time = |level: usize, at: usize| {
            // Up to where the next one begins that is kept, whichever that is.
            let may = self.allows_from(at, path[level]);
            Ok::<_, Infallible>(may.then(|| self.seen[at][path[level]].time))
        };
        let Ok(kept) = merge(path.len(), MERGE_BELOW, time);
        let levels: Vec<(usize, usize)> =
            kept.iter().map(|at| (at * self.per, path[*at])).collect();
        let plan = self.choice().plan_of(&levels);
        plan.unwrap_or_else(|| vec![0; self.bins()])
    }

    /// What a plan comes to.
    pub(super) fn score(&self, plan: &[usize]) -> Score {
        self.choice()
            .score(plan, |bin, from, to| self.shown(bin, from, to))
    }

    /// The runs of a plan, nearest first.
    pub(super) fn runs(&self, plan: &[usize]) -> Vec<Run> {
        let mut runs: Vec<Run> = Vec::new();
        for (bin, place) in plan.iter().enumerate() {
            let until = self.distance(bin + 1);
            match runs.last_mut().filter(|run| run.place == *place) {
                Some(run) => run.until = until,
                None => runs.push(Run {
                    pair: self.pairs[*place],
                    place: *place,
                    bin,
                    from: self.distance(bin),
                    until,
                }),
            }
        }
        runs
    }

    /// Corrects what is known of a pair that does not hold where it was to be used. Each time there is less to choose from.
    pub(super) fn refute(&mut self, run: &Run, by: Refuted) {
        self.refuted[run.place] += match by {
            Refuted::Unstable => PATIENCE,
            Refuted::Over(_) => 1,
        };
        self.barred.insert((run.bin, run.place));
        if let Refuted::Over(strain) = by {
            let bins = run.bin..=self.bins();
            let inside = bins.take_while(|bin| self.distance(*bin) <= run.until);
            let thought = inside.map(|bin| self.strain(bin, run.place));
            let thought = thought.fold(0.0, f64::max);
            if thought > 0.0 {
                self.factors[run.place] *= (strain / thought).clamp(1.0, MOST_CORRECTION);
            }
        }
    }
}
