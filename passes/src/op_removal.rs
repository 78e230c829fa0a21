//! op-removal: an operation goes, and one of its operands or its mean takes its place.
//!
//! Precondition. The site is a float value of the fragment stage that nothing but the picture depends
//! on. To keep an operand, the site is an operator or built-in function, and the operand has the site's
//! own type; for a mean, the site is such an operation, a merged local variable, a vector made of
//! parts, or an input, and the samples saw it.
//!
//! Effect. `keep <operand>`: the site's users use that operand. `mean`: they use the value's mean over
//! the samples, a constant that the candidate carries. `without`: every operation that uses the site
//! keeps its other operand, as if the site were the zero of a sum, the one of a product, or the side of
//! a mix that is not chosen; so a costly value that several operations share dies at once, where each
//! removal alone would save nothing.
//!
//! Error. Not known here: it is measured. A mean is the constant with the least squared error in the
//! value itself, which is why the constant operand of an operation is not offered.
//!
//! Declines.
//! - What decides when a loop ends (unless a counter of integers ends it anyway), a built-in output
//!   such as the depth, or what is written to memory. The condition of a `discard` may change: the
//!   picture shows it.
//! - What would have a texture read at the same coordinate by every fragment: that is texture-removal,
//!   done the slow way.
//! - A guard, that is `max`, `min`, `clamp`, `saturate` or `abs` on the way to a division, root,
//!   logarithm, power or `normalize`, and a constant added right before one, unless the samples stay
//!   away from its limit by [`MARGIN`] of the range seen and of the limit, below by the limit itself.
//!   Samples that were not taken must not meet a hole that the guard covered. This needs facts, so it
//!   is decided when candidates are listed, not when they are replayed.
//! - `mean` where it is dominated: the only user is an operation on the value and constants, whose own
//!   mean is cheaper and no worse.
//! - `without` where an operation has no such operand, or there is only one operation.
//!
//! This work is based on: Marc Olano, Bob Kuehne, Maryann Simmons, "Automatic Shader Level of Detail",
//! 2003, section 3; Fabio Pellacini, "User-Configurable Automatic Shader Simplification", 2005,
//! section 3; Pitchaya Sitthi-amorn, Nicholas Modly, Westley Weimer, Jason Lawrence, "Genetic
//! Programming for Shader Simplification", 2011, section 4.

use crate::cost::{SAMPLE_WEIGHT, SPECIAL_WEIGHT};
use crate::edit::{Edit, New};
use crate::flow::{Flow, Holes, Value};
use crate::recipe::{Candidate, Class, Considered, Declined, Pass};
use crate::shader::{Shader, Stage};
use crate::{Facts, constants, operands};
use naga::{
    BinaryOperator as Op, Binding, Expression, MathFunction as Math, TypeInner, UnaryOperator,
};
use std::collections::BTreeSet;

/// The stages whose operations are removed. The other passes' errors are those of fragments too.
const STAGES: [Stage; 1] = [Stage::Fragment];

/// How far samples have to stay away from a guard's limit, as a part of the range that they covered.
const MARGIN: f32 = 0.125;

/// The work, in full-rate scalar operations, that has to die with a value for `without` to be offered.
const COSTLY: f64 = 8.0;

/// The pass.
pub struct OpRemoval;

/// What is done at a site: the only place where the words of this pass are read.
enum Choice<'a> {
    /// The users use an operand, named by its path.
    Keep(&'a str),
    /// The users use the baked mean.
    Mean,
    /// The users do without it.
    Without,
}

impl<'a> Choice<'a> {
    fn parse(choice: &'a str) -> Result<Self, Declined> {
        match choice.split_once(' ') {
            Some(("keep", path)) => Ok(Self::Keep(path)),
            None if choice == "mean" => Ok(Self::Mean),
            None if choice == "without" => Ok(Self::Without),
            _ => Err(Declined(format!("op-removal has no choice `{choice}`"))),
        }
    }
}

impl Pass for OpRemoval {
    fn name(&self) -> &'static str {
        "op-removal"
    }

    fn summary(&self) -> &'static str {
        "an operation goes; one of its operands, or its mean, takes its place"
    }

    fn class(&self, _: &Candidate) -> Class {
        Class::Lossy
    }

    fn consider(&self, shader: &Shader, facts: &Facts) -> Vec<Considered> {
        let mut found = Vec::new();
        for stage in STAGES {
            if let Some(flow) = Flow::new(shader, stage) {
                Survey::new(&flow, facts).list(&mut found);
            }
        }
        found
    }

    fn applies(&self, shader: &Shader, candidate: &Candidate) -> Result<(), Declined> {
        plan(shader, candidate).map(drop)
    }

    fn apply(&self, shader: &Shader, candidate: &Candidate) -> Shader {
        match plan(shader, candidate) {
            Ok((stage, changes)) => {
                let mut edit = Edit::new(shader, stage);
                for (value, new) in changes {
                    edit.replace(value, new);
                }
                edit.finish()
            }
            Err(declined) => panic!("{candidate} was applied, but {declined}"),
        }
    }
}

/// What a candidate replaces by what.
fn plan(shader: &Shader, candidate: &Candidate) -> Result<(Stage, Vec<(Value, New)>), Declined> {
    let choice = Choice::parse(&candidate.choice)?;
    let (stage, site) = shader
        .find(&candidate.site)
        .ok_or_else(|| Declined(format!("there is no value `{}`", candidate.site.path())))?;
    let flow = STAGES
        .contains(&stage)
        .then(|| Flow::new(shader, stage))
        .flatten()
        .ok_or_else(|| Declined("only operations of the fragment stage are removed".into()))?;
    let changes = match choice {
        Choice::Keep(path) => {
            may_change(&flow, site)?;
            let kept = own_operands(&flow, site)
                .into_iter()
                .find(|operand| flow.id(*operand).path() == path)
                .ok_or_else(|| {
                    let site = candidate.site.path();
                    Declined(format!(
                        "`{path}` is no operand of `{site}` that has its type"
                    ))
                })?;
            vec![(site, New::Value(kept))]
        }
        Choice::Mean => {
            may_change(&flow, site)?;
            let count = mean_components(&flow, site).ok_or_else(|| {
                Declined("it is no operation, merged variable or input of f32".into())
            })?;
            let numbers = candidate.baked(count)?;
            constants::follow(&flow, &[(site, &numbers)])?;
            vec![(site, New::Numbers(numbers))]
        }
        Choice::Without => without(&flow, site)?,
    };
    Ok((stage, changes))
}

/// Declines what must stay as it is.
fn may_change(flow: &Flow, value: Value) -> Result<(), Declined> {
    match flow.decides(value) {
        Some(why) => Err(Declined(why.to_string())),
        None => Ok(()),
    }
}

/// The operands of an operation that have its own type, each once: those that can take its place.
/// None for what is no operator or built-in function on floats.
fn own_operands(flow: &Flow, site: Value) -> Vec<Value> {
    let expression = &flow.function.expressions[site];
    let is_operation = match expression {
        Expression::Unary { op, .. } => *op == UnaryOperator::Negate,
        Expression::Binary { .. } | Expression::Select { .. } | Expression::Math { .. } => true,
        _ => false,
    };
    let mut own = Vec::new();
    if is_operation && flow.is_float(site) {
        let inner = flow.inner(site);
        operands::each(expression, |operand| {
            if flow.inner(operand) == inner && !own.contains(&operand) {
                own.push(operand);
            }
        });
    }
    own
}

/// How many components the mean of a value would have; `None` when it can have none.
fn mean_components(flow: &Flow, site: Value) -> Option<usize> {
    let count = flow.floats(site)?;
    let can = match flow.function.expressions[site] {
        Expression::Unary { .. }
        | Expression::Binary { .. }
        | Expression::Select { .. }
        | Expression::Math { .. }
        | Expression::Derivative { .. }
        | Expression::As { .. } => true,
        // Made of one part, it says the same as the part, less plainly.
        Expression::Compose { ref components, .. } => {
            let mut parts = components.iter().filter(|part| !flow.is_constant(**part));
            let first = parts.next();
            parts.any(|part| Some(part) != first)
        }
        Expression::Load { pointer } => flow.local(pointer).is_some(),
        _ => matches!(flow.input(site), Some(Binding::Location { .. })),
    };
    (can && !flow.is_constant(site)).then_some(count)
}

/// What each operation that uses `site` keeps when it does without it.
///
/// Parts of the site (a swizzle, a component, a splat) are followed to the operations that use them.
fn without(flow: &Flow, site: Value) -> Result<Vec<(Value, New)>, Declined> {
    let mut kept: Vec<(Value, Value)> = Vec::new();
    let mut parts = vec![site];
    while let Some(part) = parts.pop() {
        if flow.is_stated(part) {
            return Err(Declined("a statement uses it".into()));
        }
        for user in flow.users(part) {
            match flow.function.expressions[user] {
                Expression::Swizzle { .. }
                | Expression::AccessIndex { .. }
                | Expression::Splat { .. } => parts.push(user),
                _ => {
                    may_change(flow, user)?;
                    let other = other_operand(flow, user, part).ok_or_else(|| {
                        Declined("an operation on it has nothing else to keep".into())
                    })?;
                    kept.push((user, other));
                }
            }
        }
    }
    kept.sort();
    kept.dedup();
    if kept.len() < 2 {
        return Err(Declined("fewer than two operations use it".into()));
    }
    if kept.windows(2).any(|pair| pair[0].0 == pair[1].0) {
        return Err(Declined("an operation uses it twice".into()));
    }
    // An operation may keep another one that goes as well.
    let last = |mut value: Value| {
        while let Ok(i) = kept.binary_search_by_key(&value, |(user, _)| *user) {
            value = kept[i].1;
        }
        value
    };
    Ok(kept
        .iter()
        .map(|(user, other)| (*user, New::Value(last(*other))))
        .collect())
}

/// The operand that an operation comes down to when `gone` is its neutral element.
fn other_operand(flow: &Flow, user: Value, gone: Value) -> Option<Value> {
    let other = match flow.function.expressions[user] {
        Expression::Binary { op, left, right } => match op {
            Op::Add | Op::Multiply if left == gone => right,
            Op::Add | Op::Multiply | Op::Subtract | Op::Divide if right == gone => left,
            _ => return None,
        },
        Expression::Select {
            condition,
            accept,
            reject,
        } => match gone {
            _ if condition == gone => return None,
            _ if accept == gone => reject,
            _ => accept,
        },
        Expression::Math {
            fun,
            arg,
            arg1: Some(arg1),
            arg2,
            ..
        } => match (fun, arg2) {
            (Math::Min | Math::Max | Math::Mix, _) if arg == gone => arg1,
            (Math::Min | Math::Max | Math::Mix | Math::Pow, _) if arg1 == gone => arg,
            (Math::Mix, Some(weight)) if weight == gone => arg,
            (Math::Fma, Some(sum)) if sum != gone => sum,
            _ => return None,
        },
        _ => return None,
    };
    let fits = other != gone
        && flow.is_float(user)
        && flow.inner(other) == flow.inner(user)
        && !flow.is_constant(other);
    fits.then_some(other)
}

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
struct Survey<'a> {
    flow: &'a Flow<'a>,
    facts: &'a Facts,
    /// For each value, on which sides there are holes before it.
    holes: Vec<Holes>,
    /// For each value, whether it differs between fragments.
    varying: Vec<bool>,
}

impl<'a> Survey<'a> {
    fn new(flow: &'a Flow<'a>, facts: &'a Facts) -> Self {
        Self {
            flow,
            facts,
            holes: flow.holes(),
            varying: flow.varying(),
        }
    }

    fn list(&self, found: &mut Vec<Considered>) {
        for (site, _) in self.flow.function.expressions.iter() {
            if !self.flow.is_float(site) || self.flow.is_constant(site) {
                continue;
            }
            for kept in own_operands(self.flow, site) {
                if !self.flow.is_constant(kept) {
                    let choice = format!("keep {}", self.flow.id(kept).path());
                    let verdict = self.keep(site, kept).map(|()| Vec::new());
                    found.push(self.considered(site, choice, verdict));
                }
            }
            if let Some(count) = mean_components(self.flow, site)
                && !self.is_dominated(site)
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

    fn keep(&self, site: Value, kept: Value) -> Result<(), Declined> {
        may_change(self.flow, site)?;
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
        may_change(self.flow, site)?;
        if self.stills_a_read(site) {
            return Err(Declined("a texture would be read at one place only".into()));
        }
        let mean = self.facts.mean(self.flow.id(site), count)?;
        constants::follow(self.flow, &[(site, mean)])?;
        Ok(mean.iter().map(|number| number.to_bits()).collect())
    }

    fn without(&self, changes: &[(Value, New)]) -> Result<(), Declined> {
        for (user, new) in changes {
            if let New::Value(kept) = *new {
                self.keep(*user, kept)?;
            }
        }
        Ok(())
    }

    /// Whether a texture would be read at the same coordinate by every fragment if a value were the
    /// same for all.
    fn stills_a_read(&self, site: Value) -> bool {
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
        let mut work = 0.0;
        let mut dead = vec![site];
        let mut next = 0;
        while next < dead.len() && work < COSTLY {
            let value = dead[next];
            next += 1;
            work += self.work(value);
            operands::each(&self.flow.function.expressions[value], |operand| {
                let dies = !dead.contains(&operand)
                    && !self.flow.is_stated(operand)
                    && self.flow.users(operand).all(|user| dead.contains(&user));
                if dies {
                    dead.push(operand);
                }
            });
        }
        work >= COSTLY
    }

    /// The work of one operation, in full-rate scalar operations, by kind alone.
    fn work(&self, value: Value) -> f64 {
        let size = match *self.flow.inner(value) {
            TypeInner::Vector { size, .. } => f64::from(size as u8),
            TypeInner::Matrix { columns, rows, .. } => f64::from(columns as u8 * rows as u8),
            _ => 1.0,
        };
        match self.flow.function.expressions[value] {
            Expression::ImageSample { .. } | Expression::ImageLoad { .. } => SAMPLE_WEIGHT,
            Expression::Math { .. }
            | Expression::Binary {
                op: Op::Divide | Op::Modulo,
                ..
            } => size * SPECIAL_WEIGHT,
            Expression::Unary { .. } | Expression::Binary { .. } | Expression::Select { .. } => {
                size
            }
            _ => 0.0,
        }
    }
}
