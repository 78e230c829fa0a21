//! The cheapest variant of one interval that all samples confirm: descents, and what they learn from being refused.
//!
//! A descent ends at a variant that the search set is content with. It is drawn in full. When that refuses it, the guard
//! keeps what spoke against it, and the descent goes on from the last variant on the way that the guard allows; when that
//! confirms it and leaves more room than the search set saw, the descent goes on too. Descents start from the level
//! before and from the original, from what was seen beside a way and is cheaper than where it ended, and from the best
//! that was found without its worst bargains. The cheapest that was confirmed is the result.
//!
//! This is search by counter-examples (Solar-Lezama, Tancau, Bodik, Seshia, Saraswat, "Combinatorial sketching for
//! finite programs", 2006).

use super::confirm::{Checks, Finding, Verdict};
use super::frontier::Frontier;
use super::greedy::{Descent, Prices, Stop, Variant};
use super::guard::Guard;
use super::interval::Interval;
use super::levels::Struck;
use super::samples::Measured;
use crate::eval::program::Refused;
use lodc_passes::{Candidate, Recipe, Shader, recipe};
use rayon::prelude::*;

/// How often one start goes down and is judged.
const ROUNDS: usize = 8;
/// What a shortcut must cost less than what was found: below that it is not worth being judged.
const SHORTCUT: f64 = 0.99;
/// How often the worst bargains are taken back.
const REPAIRS: usize = 2;
/// The part of its load that a variant is relieved of then.
const RELIEF: f64 = 0.3;
/// Of how many unstable variants of an interval it is said why.
const MOST_STRUCK: usize = 4;

/// A variant that all samples confirmed, with what they say of it where the interval starts.
pub(super) struct Confirmed {
    pub(super) recipe: Recipe,
    pub(super) measured: Measured,
}

/// What a search at one interval has, and finds.
pub(super) struct Bottom<'a, 'b> {
    pub(super) interval: &'a Interval<'b>,
    pub(super) checks: &'a Checks<'b>,
    /// Whether a host may be asked for what the scene allows.
    pub(super) asks: bool,
    pub(super) guard: &'a mut Guard<'b>,
    pub(super) prices: &'a mut Prices,
    /// Every variant that was seen.
    pub(super) frontier: Frontier,
    /// The cheapest variant that was confirmed.
    pub(super) found: Option<Confirmed>,
    /// How many variants have been measured.
    pub(super) variants: u64,
    /// How many variants the validation split withdrew.
    pub(super) withdrawn: usize,
    /// Some of those that are unstable.
    pub(super) struck: Vec<Struck>,
    /// Told how many variants have been measured, and the share of the original's cost that is left.
    pub(super) progress: &'a (dyn Fn(u64, f64) + Sync),
}

impl Bottom<'_, '_> {
    /// Searches from the original and from other starts.
    pub(super) fn find(&mut self, base: &Variant, starts: Vec<Variant>) -> Result<(), Refused> {
        self.frontier.add(base.seen());
        let mut ways = Vec::new();
        for start in starts {
            if !start.recipe.0.is_empty()
                && self
                    .guard
                    .allows(&start.recipe, &start.shader, &start.measured)
            {
                ways.push(vec![base.clone().into(), start.into()]);
            }
        }
        ways.push(vec![Stop::from(base.clone())]);
        let mut taken = Vec::new();
        for mut way in ways {
            let mut rounds = ROUNDS;
            while rounds > 0 {
                self.confirm(&mut way, &mut rounds)?;
                let Some(shortcut) = self.shortcut(&mut taken)? else {
                    break;
                };
                way = vec![base.clone().into(), shortcut.into()];
            }
        }
        for _ in 0..REPAIRS {
            let Some((relieved, cost)) = self.without_worst_bargains(base)? else {
                break;
            };
            self.confirm(
                &mut vec![base.clone().into(), relieved],
                &mut ROUNDS.clone(),
            )?;
            if self.cost() >= cost {
                break;
            }
        }
        Ok(())
    }

    /// What the cheapest confirmed variant costs.
    fn cost(&self) -> f64 {
        let found = self.found.as_ref();
        found.map_or(f64::INFINITY, |found| found.measured.cost)
    }

    /// Goes down from the end of a way until all samples confirm where it ends.
    fn confirm(&mut self, way: &mut Vec<Stop>, rounds: &mut usize) -> Result<(), Refused> {
        let starts_at_base = way.len() == 1;
        let mut raised = false;
        while *rounds > 0 {
            *rounds -= 1;
            let descent = Descent {
                interval: self.interval,
                asks: self.asks,
                guard: self.guard,
                progress: &|measured, share| (self.progress)(self.variants + measured, share),
            };
            self.variants += descent.run(way, self.prices, &mut self.frontier);
            let Some(last) = way.last().filter(|_| way.len() > 1) else {
                return Ok(());
            };
            let last = last.variant.clone();
            let verdict = self.judge(&last)?;
            if matches!(verdict.finding, Finding::Confirmed(_)) {
                let strain = verdict.strain_of_means;
                if raised || !self.guard.raise(&last.measured, strain) {
                    return Ok(());
                }
                raised = true;
                // What was over a lower limit may be tried again.
                if let Some(last) = way.last_mut() {
                    last.forget();
                }
            } else {
                if verdict.failure.is_none() {
                    self.checks.teach(self.guard, &last.measured, &verdict)?;
                }
                while let Some(Stop { variant, .. }) = way.last().filter(|_| way.len() > 1)
                    && !self
                        .guard
                        .allows(&variant.recipe, &variant.shader, &variant.measured)
                {
                    way.pop();
                }
                let back = way.last().map(|stop| &stop.variant.recipe);
                // Where the way begins is known for as long as nothing else is.
                let found = self.found.as_ref().map(|found| &found.recipe);
                let known = found.is_some_and(|found| !found.0.is_empty()) && found == back;
                if known || (way.len() == 1 && !starts_at_base) {
                    return Ok(());
                }
            }
        }
        if self
            .found
            .as_ref()
            .is_none_or(|found| found.recipe.0.is_empty())
        {
            // A way is in the order of cost, and errors mostly in theirs.
            let (mut low, mut high) = (1, way.len());
            while low < high {
                let middle = low + (high - low) / 2;
                match self.judge(&way[middle].variant)?.finding {
                    Finding::Confirmed(_) => low = middle + 1,
                    Finding::Over | Finding::Withdrawn | Finding::Unstable => high = middle,
                }
            }
        }
        Ok(())
    }

    /// Draws a variant in full, and keeps it when that confirms the cheapest.
    pub(super) fn judge(&mut self, variant: &Variant) -> Result<Verdict, Refused> {
        let verdict = self.checks.judge(&variant.shader)?;
        match verdict.finding {
            Finding::Confirmed(measured) if measured.cost < self.cost() => {
                let recipe = variant.recipe.clone();
                self.found = Some(Confirmed { recipe, measured });
            }
            Finding::Withdrawn => self.withdrawn += 1,
            Finding::Confirmed(_) | Finding::Over | Finding::Unstable => {}
        }
        if let Some(failure) = &verdict.failure
            && self.struck.len() < MOST_STRUCK
        {
            let struck = self.checks.struck(&variant.recipe, failure);
            self.struck.extend(struck);
        }
        Ok(verdict)
    }

    /// The cheapest variant that was seen beside the ways, is cheaper than what was found, and that the guard allows.
    fn shortcut(&self, taken: &mut Vec<Recipe>) -> Result<Option<Variant>, Refused> {
        let share = self.cost() / self.checks.start().original().cost;
        let most = SHORTCUT * share * self.interval.start().original().cost;
        let members = self.frontier.members().iter();
        for seen in members.take_while(|seen| seen.cost < most) {
            if taken.contains(&seen.recipe) {
                continue;
            }
            let Ok(shader) = seen.recipe.replay(self.checks.base()) else {
                continue;
            };
            let variant = Variant::new(self.interval, seen.recipe.clone(), shader)?;
            if self
                .guard
                .allows(&variant.recipe, &variant.shader, &variant.measured)
            {
                taken.push(variant.recipe.clone());
                return Ok(Some(variant));
            }
        }
        Ok(None)
    }

    /// What was found without the steps that save the least work for the load that they add, which are not to be tried
    /// again, and what was found costs.
    fn without_worst_bargains(&self, base: &Variant) -> Result<Option<(Stop, f64)>, Refused> {
        let Some(found) = &self.found else {
            return Ok(None);
        };
        let steps = &found.recipe.0;
        let replayed = |left_out: &[usize]| -> (Recipe, Shader) {
            let mut shader = base.shader.clone();
            let mut kept = Vec::<Candidate>::new();
            for (i, step) in steps.iter().enumerate() {
                // A step may have been possible by one that is left out.
                if !left_out.contains(&i)
                    && let Ok(next) = recipe::apply(&shader, step)
                {
                    shader = next;
                    kept.push(step.clone());
                }
            }
            (Recipe(kept), shader)
        };
        let whole = self.interval.measure(&replayed(&[]).1)?;
        let without: Vec<Measured> = (0..steps.len())
            .into_par_iter()
            .map(|i| self.interval.measure(&replayed(&[i]).1))
            .collect::<Result<_, _>>()?;
        let mut bargains: Vec<(f64, f64, usize)> = without
            .iter()
            .enumerate()
            .map(|(i, without)| {
                let relief = whole.load - without.load;
                let work = without.cost - whole.cost;
                (relief / work.max(f64::MIN_POSITIVE), relief, i)
            })
            .filter(|(_, relief, _)| *relief > 0.0)
            .collect();
        bargains.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.2.cmp(&b.2)));
        let mut relieved = 0.0;
        let mut left_out = Vec::new();
        for (_, relief, i) in bargains {
            if relieved >= RELIEF * whole.load {
                break;
            }
            relieved += relief;
            left_out.push(i);
        }
        if left_out.is_empty() {
            return Ok(None);
        }
        let (kept, shader) = replayed(&left_out);
        let variant = Variant::new(self.interval, kept, shader)?;
        let banned = left_out.iter().map(|i| &steps[*i]);
        let stop = Stop::without(variant, banned);
        Ok(Some((stop, found.measured.cost)))
    }
}
