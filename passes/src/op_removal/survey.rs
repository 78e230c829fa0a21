//! Which of the possible removals are offered, by what the facts say of them.

use super::fit::Simpler;
use super::{
    If, OpRemoval, all_of, fit, follow, has_mean, ifs, may_change, mean_components, own_operands,
    take, without,
};
use crate::cost::{self, Work};
use crate::flow::{Dynamic, Flow, Holes, Value};
use crate::recipe::{Candidate, Considered, Declined, Pass};
use crate::{Facts, constants, operands};
use naga::{BinaryOperator as Op, Expression, MathFunction as Math, Statement};
use std::collections::BTreeSet;

/// How far samples have to stay away from a guard's limit, as a part of the range that they covered.
const MARGIN: f32 = 0.125;

/// The work, in full-rate scalar operations, that has to die with a value for `without` to be offered.
const COSTLY: f64 = 8.0;

/// The lower and upper limits that an operation keeps `operand` within.
#[derive(Default)]
struct Limits {
    low: Option<Limit>,
    high: Option<Limit>,
}

enum Limit {
    Number(f32),
    Value(Value),
}

/// Which guard is lost when an operation becomes its operand. `direct` says that a hole comes next.
fn lost_limits(flow: &Flow, site: Value, kept: Value, direct: bool) -> Limits {
    let number = |number| Some(Limit::Number(number));
    let mut limits = Limits::default();
    match flow.function.expressions[site] {
        Expression::Math {
            fun,
            arg,
            arg1,
            arg2,
            ..
        } => match (fun, arg1, arg2) {
            (Math::Abs, ..) => limits.low = number(0.0),
            (Math::Saturate, ..) => (limits.low, limits.high) = (number(0.0), number(1.0)),
            (Math::Clamp, Some(low), Some(high)) if kept == arg => {
                (limits.low, limits.high) = (Some(Limit::Value(low)), Some(Limit::Value(high)));
            }
            (Math::Max, Some(arg1), _) => {
                limits.low = Some(Limit::Value(if kept == arg { arg1 } else { arg }));
            }
            (Math::Min, Some(arg1), _) => {
                limits.high = Some(Limit::Value(if kept == arg { arg1 } else { arg }));
            }
            _ => {}
        },
        Expression::Binary {
            op: Op::Add,
            left,
            right,
        } if direct => {
            let added = if kept == left { right } else { left };
            if flow.is_constant(added) {
                limits.low = number(0.0);
            }
        }
        _ => {}
    }
    limits
}

/// One listing of the candidates of a stage.
pub(super) struct Survey<'a> {
    flow: &'a Flow<'a>,
    facts: &'a Facts,
    /// For each value, on which sides there are holes before it.
    holes: Vec<Holes>,
    /// For each value, whether it differs between fragments.
    varying: Vec<bool>,
    /// For each value, whether a texture coordinate is computed from it.
    leads_to_read: Vec<bool>,
    /// What each value alone costs.
    work: Vec<Work>,
    /// What depends on something that may take any value.
    dynamic: Dynamic,
}

impl<'a> Survey<'a> {
    pub(super) fn new(flow: &'a Flow<'a>, facts: &'a Facts) -> Self {
        let types = cost::types(flow.module, flow.function).expect("a valid module is well typed");
        Self {
            flow,
            facts,
            holes: flow.holes(),
            varying: flow.varying(),
            leads_to_read: leads_to_read(flow),
            work: cost::of_expressions(flow.module, &flow.function.expressions, &types),
            dynamic: Dynamic::of(flow, facts),
        }
    }

    pub(super) fn list(&self, found: &mut Vec<Considered>) {
        let ifs = ifs(self.flow);
        for (site, _) in self.flow.function.expressions.iter() {
            if ifs.iter().any(|branch| branch.condition == site) {
                for (side, word) in [(true, "accept"), (false, "reject")] {
                    let verdict = self.take(site, &ifs, side).map(|()| Vec::new());
                    found.push(self.considered(site, word.into(), verdict));
                }
            }
            if !self.flow.is_float(site) || self.flow.is_constant(site) {
                continue;
            }
            for kept in own_operands(self.flow, site) {
                if !self.flow.is_constant(kept) {
                    let choice = format!("keep {}", self.flow.id(kept));
                    let verdict = self.keep(site, kept).map(|()| Vec::new());
                    found.push(self.considered(site, choice, verdict));
                }
            }
            for operand in self.fits(site) {
                let within = self.holes[site.index()] != Holes::default();
                let word = if within { "fit-within" } else { "fit" };
                let choice = format!("{word} {}", self.flow.id(operand));
                found.push(self.considered(site, choice, self.fit(site, operand)));
            }
            if let Some(count) = mean_components(self.flow, site)
                && !self.is_dominated(site)
                && all_of(self.flow, site).first() == Some(&site)
            {
                found.push(self.considered(site, "mean".into(), self.mean(site, count)));
            }
            if self.is_costly(site)
                && let Ok(changes) = without(self.flow, site)
            {
                let verdict = self.without(&changes).map(|()| Vec::new());
                found.push(self.considered(site, "without".into(), verdict));
            }
        }
    }

    fn considered(
        &self,
        site: Value,
        choice: String,
        verdict: Result<Vec<u32>, Declined>,
    ) -> Considered {
        let (value, declined) = match verdict {
            Ok(value) => (value, None),
            Err(declined) => (Vec::new(), Some(declined)),
        };
        let candidate = Candidate {
            pass: OpRemoval.name().into(),
            site: self.flow.id(site).clone(),
            choice,
            value,
        };
        Considered {
            candidate,
            declined,
        }
    }

    /// The operands that a value may be fitted to for less than what goes with it costs.
    pub(super) fn fits(&self, site: Value) -> Vec<Value> {
        let count = self.flow.floats(site).unwrap_or(0);
        let limited = self.holes[site.index()] != Holes::default();
        let mut operands = fit::operands(self.flow, site);
        operands.retain(|operand| {
            let cost = fit::work(count, limited);
            self.varying[operand.index()] && self.dies_with(site, Some(*operand), cost + 0.5) > cost
        });
        operands
    }

    fn fit(&self, site: Value, operand: Value) -> Result<Vec<u32>, Declined> {
        may_change(self.flow, site)?;
        has_mean(self.flow, site)?;
        self.holds_for_all(site)?;
        let pair = (self.flow.id(site).clone(), self.flow.id(operand).clone());
        let seen = self.facts.pairs.get(&pair);
        let seen = seen.filter(|seen| seen.iter().all(|moments| moments.weight > 0.0));
        let seen = seen.ok_or_else(|| Declined("no sample of the scene computes it".into()))?;
        let mut simpler = Vec::new();
        if self.flow.inner(operand) == self.flow.inner(site) && self.keep(site, operand).is_ok() {
            simpler.push(Simpler::Kept);
        }
        simpler.extend(self.number_beside(site, operand));
        let mut numbers = fit::numbers(seen, &simpler)?;
        if self.holes[site.index()] != Holes::default() {
            let range = self.facts.values.get(self.flow.id(site));
            let range = range.filter(|range| {
                let all = range.min.iter().chain(&range.max);
                all.clone().count() == numbers.len() && all.clone().all(|n| n.is_finite())
            });
            let range = range.ok_or_else(|| {
                Declined(
                    "it comes before an operation with holes, and its range is not known".into(),
                )
            })?;
            numbers.extend(range.min.iter().chain(&range.max));
        }
        Ok(numbers.iter().map(|number| number.to_bits()).collect())
    }

    /// What is left of a sum or product when its other operand becomes a number; nothing when that one is used elsewhere
    /// too, or has fewer components than the line has numbers, or no mean.
    fn number_beside(&self, site: Value, operand: Value) -> Option<Simpler> {
        let (simpler, other) = Simpler::of(&self.flow.function.expressions[site], operand)?;
        let count = mean_components(self.flow, other)?;
        let alone = self.flow.users(other).all(|user| user == site);
        let free = alone && self.flow.floats(site) == Some(count);
        (free && self.mean(other, count).is_ok()).then_some(simpler)
    }

    /// Declines a number for what may take any value.
    fn holds_for_all(&self, value: Value) -> Result<(), Declined> {
        match self.dynamic.is(value) {
            true => Err(Declined(
                "it depends on something that may take any value".into(),
            )),
            false => Ok(()),
        }
    }

    fn keep(&self, site: Value, kept: Value) -> Result<(), Declined> {
        may_change(self.flow, site)?;
        if self.dynamic.loses(site, kept) {
            return Err(Declined(
                "what would go depends on something that may take any value".into(),
            ));
        }
        if !self.varying[kept.index()] && self.stills_a_read(site) {
            return Err(Declined("a texture would be read at one place only".into()));
        }
        let holes = self.holes[site.index()];
        if holes == Holes::default() {
            return Ok(());
        }
        let limits = lost_limits(self.flow, site, kept, self.is_before_hole(site));
        let holds = |hole: bool, limit: Option<Limit>, above: bool| {
            !hole || limit.is_none_or(|limit| self.stays_away(kept, &limit, above))
        };
        if holds(holes.low, limits.low, true) && holds(holes.high, limits.high, false) {
            Ok(())
        } else {
            Err(Declined(
                "it guards an operation with holes, and samples come near its limit".into(),
            ))
        }
    }

    fn mean(&self, site: Value, count: usize) -> Result<Vec<u32>, Declined> {
        let sites = all_of(self.flow, site);
        for site in &sites {
            may_change(self.flow, *site)?;
            has_mean(self.flow, *site)?;
            self.holds_for_all(*site)?;
            if self.stills_a_read(*site) {
                return Err(Declined("a texture would be read at one place only".into()));
            }
        }
        let ids = sites.iter().map(|site| self.flow.id(*site));
        let mean = self.facts.mean(ids, count)?;
        follow(self.flow, &sites, &mean)?;
        Ok(mean.iter().map(|number| number.to_bits()).collect())
    }

    fn without(&self, changes: &[(Value, Value)]) -> Result<(), Declined> {
        changes
            .iter()
            .try_for_each(|(user, kept)| self.keep(*user, *kept))
    }

    fn take(&self, condition: Value, ifs: &[If], side: bool) -> Result<(), Declined> {
        let taken = take(self.flow, condition, ifs, side)?;
        self.holds_for_all(condition)?;
        for branch in taken {
            // How many samples came to the test, as far as the facts know.
            let mut came = 0;
            let mut open = BTreeSet::from([condition]);
            // The highest first: its operands lie below, so that none is met twice.
            while let Some(value) = open.pop_last() {
                came = came.max(self.times_seen(value));
                operands::each(&self.flow.function.expressions[value], |operand| {
                    open.insert(operand);
                });
            }
            let mut untried = false;
            operands::walk(branch.side(side), &mut |statement| {
                if let Statement::Emit(values) = statement {
                    untried |= values.clone().any(|value| {
                        self.has_hole(value) && (came == 0 || self.times_seen(value) < came)
                    });
                }
            });
            if untried {
                return Err(Declined(
                    "that side has an operation with holes, and not all samples took it".into(),
                ));
            }
        }
        Ok(())
    }

    /// How many samples computed a value.
    fn times_seen(&self, value: Value) -> u64 {
        let seen = self.facts.values.get(self.flow.id(value));
        seen.map_or(0, |seen| seen.count)
    }

    /// Whether an operation has a hole in the domain of an operand that is not constant.
    fn has_hole(&self, value: Value) -> bool {
        let mut found = false;
        if !self.flow.is_float(value) {
            return false;
        }
        operands::each(&self.flow.function.expressions[value], |operand| {
            found |= !self.flow.is_constant(operand) && self.flow.has_hole(value, operand);
        });
        found
    }

    /// Whether a texture would be read at the same coordinate by every fragment if a value were the
    /// same for all.
    fn stills_a_read(&self, site: Value) -> bool {
        if !self.leads_to_read[site.index()] {
            return false;
        }
        let mut still = BTreeSet::from([site]);
        let mut next = BTreeSet::from_iter(self.flow.users(site));
        // Operands come before users, so that each value is settled when it is met.
        while let Some(value) = next.pop_first() {
            let expression = &self.flow.function.expressions[value];
            if let Expression::ImageSample { coordinate, .. }
            | Expression::ImageLoad { coordinate, .. } = *expression
            {
                if still.contains(&coordinate) {
                    return true;
                }
                continue;
            }
            let mut all = true;
            operands::each(expression, |operand| {
                all &= !self.varying[operand.index()] || still.contains(&operand);
            });
            if all {
                still.insert(value);
                next.extend(self.flow.users(value));
            }
        }
        false
    }

    /// Whether an operation with a hole uses a value as it stands, or a part of it.
    fn is_before_hole(&self, site: Value) -> bool {
        self.flow
            .users(site)
            .any(|user| match self.flow.function.expressions[user] {
                Expression::Binary { .. } | Expression::Math { .. } => {
                    self.flow.has_hole(user, site)
                }
                Expression::Swizzle { .. }
                | Expression::AccessIndex { .. }
                | Expression::Splat { .. }
                | Expression::Compose { .. } => self.is_before_hole(user),
                _ => false,
            })
    }

    /// Whether every sample of a value stays on one side of a limit, with margin.
    fn stays_away(&self, value: Value, limit: &Limit, above: bool) -> bool {
        let id = |value| self.flow.id(value);
        let Some(seen) = self
            .facts
            .values
            .get(id(value))
            .filter(|seen| seen.count > 0)
        else {
            return false;
        };
        let known;
        let limits: &[f32] = match *limit {
            Limit::Number(number) => &[number],
            Limit::Value(limit) => match constants::numbers(self.flow, limit) {
                Some(numbers) => {
                    known = numbers;
                    &known
                }
                None => match self
                    .facts
                    .values
                    .get(id(limit))
                    .filter(|seen| seen.count > 0)
                {
                    Some(seen) if above => &seen.max,
                    Some(seen) => &seen.min,
                    None => return false,
                },
            },
        };
        if limits.is_empty() {
            return false;
        }
        seen.min
            .iter()
            .zip(&seen.max)
            .enumerate()
            .all(|(i, (min, max))| {
                let limit = limits.get(i).copied().unwrap_or(limits[0]);
                let margin = MARGIN * (max - min);
                // A comparison with NaN fails, and so declines.
                if above {
                    *min >= limit + margin.max(limit.abs())
                } else {
                    *max <= limit - margin.max(MARGIN * limit.abs())
                }
            })
    }

    /// Whether the mean of the only user does at least as well, for less.
    fn is_dominated(&self, site: Value) -> bool {
        let mut users = self.flow.users(site);
        let (Some(user), None, false) = (users.next(), users.next(), self.flow.is_stated(site))
        else {
            return false;
        };
        let Some(count) = mean_components(self.flow, user) else {
            return false;
        };
        let mut alone = true;
        operands::each(&self.flow.function.expressions[user], |operand| {
            alone &= operand == site || self.flow.is_constant(operand);
        });
        alone && self.mean(user, count).is_ok()
    }

    /// Whether what dies with a value is worth an edit of all its users.
    fn is_costly(&self, site: Value) -> bool {
        let mut users = self.flow.users(site);
        if users.next().is_none() {
            return false;
        }
        if self.flow.input(site).is_some() {
            return true;
        }
        self.dies_with(site, None, COSTLY) >= COSTLY
    }

    /// The work, in full-rate scalar operations, that goes with a value and is not needed for another one that stays;
    /// counted until it is `enough`.
    fn dies_with(&self, site: Value, stays: Option<Value>, enough: f64) -> f64 {
        let mut work = 0.0;
        let mut dead = vec![site];
        let mut next = 0;
        while next < dead.len() && work < enough {
            let value = dead[next];
            next += 1;
            work += self.work[value.index()].total();
            operands::each(&self.flow.function.expressions[value], |operand| {
                let dies = Some(operand) != stays
                    && !dead.contains(&operand)
                    && !self.flow.is_stated(operand)
                    && self.flow.users(operand).all(|user| dead.contains(&user));
                if dies {
                    dead.push(operand);
                }
            });
        }
        work
    }
}

/// For each value, whether a texture coordinate is computed from it, other than through a variable.
fn leads_to_read(flow: &Flow) -> Vec<bool> {
    let mut leads = vec![false; flow.function.expressions.len()];
    for (value, expression) in flow.function.expressions.iter().rev() {
        match *expression {
            Expression::ImageSample { coordinate, .. }
            | Expression::ImageLoad { coordinate, .. } => leads[coordinate.index()] = true,
            _ if leads[value.index()] => {
                operands::each(expression, |operand| leads[operand.index()] = true);
            }
            _ => {}
        }
    }
    leads
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::facts::ValueFacts;
    use crate::flow::tests::shader;
    use crate::shader::Shader;

    /// Facts in which `x` has this range, and everything else was seen between 0 and 1.
    fn facts(shader: &Shader, range: (f32, f32)) -> Facts {
        let flow = Flow::new(shader, crate::Stage::Fragment).expect("it has a fragment stage");
        let mut facts = Facts::default();
        for (value, _) in flow.function.expressions.iter() {
            if let Some(count) = flow.floats(value) {
                let id = flow.id(value).clone();
                let (min, max) = if id.path() == "x" { range } else { (0.0, 1.0) };
                let seen = ValueFacts {
                    count: 9,
                    weight: Vec::new(),
                    mean: vec![0.5 * (min + max); count],
                    min: vec![min; count],
                    max: vec![max; count],
                };
                facts.values.insert(id, seen);
            }
        }
        facts
    }

    /// Whether `site` may keep `x`, which has this range.
    fn may_keep(site: &str, range: (f32, f32)) -> bool {
        let shader = shader(&format!(
            "@fragment fn main(@location(0) x: f32, @location(1) y: f32) -> @location(0) vec4f {{
                 let guard = {site}; return vec4f(sqrt(guard), acos(guard), 1.0 / guard, y);
             }}"
        ));
        let facts = facts(&shader, range);
        OpRemoval
            .candidates(&shader, &facts)
            .iter()
            .any(|candidate| {
                candidate.site.path() == "guard" && candidate.choice.starts_with("keep x")
            })
    }

    #[test]
    fn a_guard_goes_only_when_samples_stay_away_from_its_limit() {
        // Twice the limit, and an eighth of the range above it.
        assert!(may_keep("max(x, 0.25)", (0.5, 0.75)));
        assert!(!may_keep("max(x, 0.25)", (0.45, 0.75)));
        assert!(may_keep("max(x, 0.0)", (0.125, 1.0)));
        assert!(!may_keep("max(x, 0.0)", (0.1, 1.0)));
        assert!(may_keep("abs(x)", (0.25, 1.0)));
        assert!(!may_keep("abs(x)", (-1.0, 1.0)));
        // Away from 1 by an eighth of the limit or of the range, above; by an eighth of the range, below.
        assert!(may_keep("saturate(x)", (0.2, 0.8)));
        assert!(!may_keep("saturate(x)", (0.2, 0.9)));
        assert!(!may_keep("saturate(x)", (0.01, 0.8)));
        assert!(may_keep("clamp(x, 0.125, 1.0)", (0.25, 0.75)));
        assert!(!may_keep("clamp(x, 0.125, 1.0)", (0.2, 0.75)));
        // A limit that varies counts with its worst number.
        assert!(may_keep("max(x, y * 0.5)", (2.0, 3.0)));
        assert!(!may_keep("max(x, y * 0.5)", (1.5, 3.0)));
        // Not a number, or never seen.
        assert!(!may_keep("max(x, 0.25)", (f32::NAN, f32::NAN)));
    }

    #[test]
    fn what_is_no_guard_goes_freely() {
        assert!(may_keep("x * y", (-1.0, 1.0)));
        assert!(may_keep("x + y", (-1.0, 1.0)));
        assert!(
            !may_keep("x + 0.001", (0.0, 1.0)),
            "a constant against zero"
        );
        assert!(may_keep("x + 0.001", (0.5, 1.0)));
    }

    #[test]
    fn a_shared_value_goes_from_a_chain_of_operations() {
        let shader = shader(
            "@fragment fn main(@location(0) x: f32, @location(1) y: f32) -> @location(0) vec4f {
                 let costly = exp(y) * sin(y); let first = x * costly; let second = first + costly;
                 return vec4f(second);
             }",
        );
        let facts = facts(&shader, (0.0, 1.0));
        let candidates = OpRemoval.candidates(&shader, &facts);
        let without = candidates
            .iter()
            .find(|candidate| candidate.site.path() == "costly" && candidate.choice == "without")
            .expect("both operations have another side");
        let after = OpRemoval.apply(&shader, without);
        let point = after.function(crate::Stage::Fragment).expect("it has one");
        let operations = point.expressions.iter();
        let operations = operations.filter(|(_, e)| matches!(e, Expression::Binary { .. }));
        assert_eq!(operations.count(), 0, "only x is left");
    }
}
