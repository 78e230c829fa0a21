//! op-removal: an operation goes, and one of its operands or its mean takes its place.
//!
//! Precondition. The site is a value of the fragment stage, mostly a float, that nothing but the picture depends
//! on. To keep an operand, the site is an operator or built-in function, and the operand has the site's
//! own type; to take a side, it is the condition of an `if`; for a mean, the site is such an operation, a merged local variable, a vector made of
//! parts, or an input, and the samples saw it.
//!
//! Effect. `keep <operand's id>`: the site's users use that operand. `mean`: they use the value's mean over
//! the samples, a constant that the candidate carries. `best`: the same with the constant that leaves the least
//! error on the screen; a search makes it of a mean that is worth it. `fit <operand's id>`: the users use
//! `scale * operand + offset`, component by component, from least squares over the samples; where a hole comes
//! after it is `fit-within`, clamped to what the value was seen to be. `without`: every operation that uses the site
//! keeps its other operand, as if the site were the zero of a sum, the one of a product, or the side of
//! a mix that is not chosen; so a costly value that several operations share dies at once, where each
//! removal alone would save nothing. `accept` and `reject`, at the condition of an `if`: that side is
//! taken always, and the test and the other side go; what else asks for the test gets the same answer, since
//! normal form may have made a selection of a part of the `if`.
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
//!   away from its limit by an eighth of the range seen and of the limit, below by the limit itself.
//!   Samples that were not taken must not meet a hole that the guard covered. This needs facts, so it
//!   is decided when candidates are listed, not when they are replayed.
//! - A side of an `if` that has an operation with a hole, unless all samples took that side: the test
//!   may be there for the hole. A side that always discards.
//! - `mean`, `best` and `fit` of whole numbers, of angles, and of what is only compared or made an integer.
//! - What depends on a uniform or texture that may take any value, unless what takes its place does too; and
//!   `mean`, `best` and `fit` of it always. Like guards, this is decided when candidates are listed.
//! - `fit` where it costs as much as what it removes; where the line leaves more than half of the value's
//!   variance; and where the operand, or with it a number for the other operand of a sum or product, does as well.
//! - `mean` where it is dominated: the only user is an operation on the value and constants, whose own
//!   mean is cheaper and no worse.
//! - `without` where an operation has no such operand, or there is only one operation.
//!
//! This work is based on: Marc Olano, Bob Kuehne, Maryann Simmons, "Automatic Shader Level of Detail",
//! 2003, section 3; Fabio Pellacini, "User-Configurable Automatic Shader Simplification", 2005,
//! section 3; Pitchaya Sitthi-amorn, Nicholas Modly, Westley Weimer, Jason Lawrence, "Genetic
//! Programming for Shader Simplification", 2011, section 4.

mod fit;
mod survey;

use fit::Limited;

use crate::edit::{Edit, New};
use crate::flow::{Flow, Value};
use crate::operands;
use crate::recipe::{Candidate, Class, Considered, Declined, Pass};
use crate::shader::{Shader, Stage, ValueId};
use crate::{Facts, constants};
use naga::{
    BinaryOperator as Op, Binding, Block, Expression, Handle, Literal, MathFunction as Math,
    Statement, UnaryOperator,
};

/// The stages whose operations are removed. The other passes' errors are those of fragments too.
const STAGES: [Stage; 1] = [Stage::Fragment];

/// The pass.
pub struct OpRemoval;

/// What is done at a site: the only place where the words of this pass are read.
enum Choice {
    /// The users use an operand.
    Keep(ValueId),
    /// The users use a baked constant: the mean, or the best one.
    Constant,
    /// The users use an affine function of an operand, within limits or not.
    Fit(ValueId, Limited),
    /// The users do without it.
    Without,
    /// The site, a truth value, makes every `if` on it take this side.
    Take(bool),
}

impl Choice {
    fn parse(choice: &str) -> Result<Self, Declined> {
        match choice.split_once(' ') {
            Some(("keep", id)) => Ok(Self::Keep(id.into())),
            Some(("fit", id)) => Ok(Self::Fit(id.into(), Limited(false))),
            Some(("fit-within", id)) => Ok(Self::Fit(id.into(), Limited(true))),
            None if choice == "mean" || choice == "best" => Ok(Self::Constant),
            None if choice == "without" => Ok(Self::Without),
            None if choice == "accept" => Ok(Self::Take(true)),
            None if choice == "reject" => Ok(Self::Take(false)),
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
                survey::Survey::new(&flow, facts).list(&mut found);
            }
        }
        found
    }

    fn with_numbers(&self, candidate: &Candidate, numbers: &[f32]) -> Option<Candidate> {
        match Choice::parse(&candidate.choice).ok()? {
            Choice::Constant => Some(candidate.with("best", numbers)),
            Choice::Fit(_, Limited(false)) => Some(candidate.with(&candidate.choice, numbers)),
            Choice::Fit(_, Limited(true)) => {
                // Limits are what was seen, whatever suits the picture.
                let mut numbers = numbers.to_vec();
                let seen: Vec<f32> = candidate.numbers().collect();
                let half = seen.len() / 2;
                numbers.get_mut(half..)?.copy_from_slice(seen.get(half..)?);
                Some(candidate.with(&candidate.choice, &numbers))
            }
            _ => None,
        }
    }

    fn applies(&self, shader: &Shader, candidate: &Candidate) -> Result<(), Declined> {
        plan(shader, candidate).map(drop)
    }

    fn apply(&self, shader: &Shader, candidate: &Candidate) -> Shader {
        match plan(shader, candidate) {
            Ok((stage, changes)) => {
                let mut edit = Edit::new(shader, stage);
                for (value, new) in changes {
                    let new = match new {
                        Becomes::Value(kept) => New::Value(kept),
                        Becomes::Numbers(numbers) => New::Numbers(numbers),
                        Becomes::Line(line) => New::Value(line.write(shader, &mut edit, value)),
                        Becomes::Side(side) => {
                            let path = format!("{}.{}", candidate.site.path(), candidate.choice);
                            let side = Expression::Literal(Literal::Bool(side));
                            New::Value(edit.add(path, side))
                        }
                    };
                    edit.replace(value, new);
                }
                edit.finish()
            }
            Err(declined) => panic!("{candidate} was applied, but {declined}"),
        }
    }
}

/// The values of the fragment stage and operands of theirs whose [`Moments`](crate::facts::Moments) are worth gathering:
/// those for which a fit would save work.
pub fn pairs(shader: &Shader) -> Vec<(Handle<Expression>, Handle<Expression>)> {
    let facts = Facts::default();
    let mut found = Vec::new();
    for flow in STAGES.iter().filter_map(|stage| Flow::new(shader, *stage)) {
        let survey = survey::Survey::new(&flow, &facts);
        for (site, _) in flow.function.expressions.iter() {
            if !flow.is_constant(site)
                && may_change(&flow, site).is_ok()
                && has_mean(&flow, site).is_ok()
            {
                found.extend(survey.fits(site).into_iter().map(|operand| (site, operand)));
            }
        }
    }
    found
}

/// What takes the place of a value.
#[derive(Debug)]
enum Becomes {
    Value(Value),
    Numbers(Vec<f32>),
    /// An affine function of an operand.
    Line(fit::Line),
    /// The truth value that has an `if` take a side.
    Side(bool),
}

/// What a candidate replaces by what.
fn plan(
    shader: &Shader,
    candidate: &Candidate,
) -> Result<(Stage, Vec<(Value, Becomes)>), Declined> {
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
        Choice::Keep(id) => {
            may_change(&flow, site)?;
            let own = own_operands(&flow, site);
            let kept = named(&flow, &own, &id).ok_or_else(|| {
                let (id, site) = (id.path(), candidate.site.path());
                Declined(format!(
                    "`{id}` is no operand of `{site}` that has its type"
                ))
            })?;
            if flow.is_constant(kept) {
                return Err(Declined(
                    "a constant is not kept: the mean is a better one".into(),
                ));
            }
            vec![(site, Becomes::Value(kept))]
        }
        Choice::Constant => {
            let count = mean_components(&flow, site).ok_or_else(|| {
                Declined("it is no operation, merged variable or input of f32".into())
            })?;
            let numbers = candidate.baked(count)?;
            let sites = all_of(&flow, site);
            sites.iter().try_for_each(|site| {
                may_change(&flow, *site)?;
                has_mean(&flow, *site)
            })?;
            follow(&flow, &sites, &numbers)?;
            sites
                .into_iter()
                .map(|site| (site, Becomes::Numbers(numbers.clone())))
                .collect()
        }
        Choice::Fit(id, limited) => {
            may_change(&flow, site)?;
            has_mean(&flow, site)?;
            let operands = fit::operands(&flow, site);
            let operand = named(&flow, &operands, &id).ok_or_else(|| {
                let (id, site) = (id.path(), candidate.site.path());
                Declined(format!(
                    "`{id}` is no operand that `{site}` can be fitted to"
                ))
            })?;
            let line = fit::Line::new(&flow, site, operand, limited, candidate)?;
            vec![(site, Becomes::Line(line))]
        }
        Choice::Without => without(&flow, site)?
            .into_iter()
            .map(|(user, kept)| (user, Becomes::Value(kept)))
            .collect(),
        Choice::Take(side) => {
            take(&flow, site, &ifs(&flow), side)?;
            vec![(site, Becomes::Side(side))]
        }
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

/// Declines a value that has no mean.
fn has_mean(flow: &Flow, value: Value) -> Result<(), Declined> {
    flow.meaning(value)
        .map_or(Ok(()), |meaning| Err(meaning.into()))
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

/// The value among a few that has this path.
fn named(flow: &Flow, values: &[Value], id: &ValueId) -> Option<Value> {
    let mut values = values.iter().copied();
    values.find(|value| flow.id(*value).path() == id.path())
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
        Expression::Compose { ref components, .. } => flow.joins(components),
        Expression::Load { pointer } => flow.local(pointer).is_some(),
        _ => matches!(flow.input(site), Some(Binding::Location { .. })),
    };
    (can && !flow.is_constant(site)).then_some(count)
}

/// A value, or for an input every value that is the same input: a shader may take it apart in several
/// branches, and it is spared only when none does.
fn all_of(flow: &Flow, site: Value) -> Vec<Value> {
    if flow.input(site).is_none() {
        return vec![site];
    }
    let wanted = &flow.function.expressions[site];
    let values = flow.function.expressions.iter();
    values
        .filter(|(_, expression)| *expression == wanted)
        .map(|(value, _)| value)
        .collect()
}

/// Declines a constant that an operation on the sites cannot take.
fn follow(flow: &Flow, sites: &[Value], numbers: &[f32]) -> Result<(), Declined> {
    let become_constant: Vec<_> = sites.iter().map(|site| (*site, numbers)).collect();
    constants::follow(flow, &become_constant)
}

/// What each operation that uses `site` keeps when it does without it.
///
/// Parts of the site (a swizzle, a component, a splat) are followed to the operations that use them.
fn without(flow: &Flow, site: Value) -> Result<Vec<(Value, Value)>, Declined> {
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
        .map(|(user, other)| (*user, last(*other)))
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

/// An `if` statement.
#[derive(Clone, Copy)]
struct If<'a> {
    condition: Value,
    accept: &'a Block,
    reject: &'a Block,
}

impl<'a> If<'a> {
    fn side(&self, side: bool) -> &'a Block {
        if side { self.accept } else { self.reject }
    }
}

/// The `if` statements of a function, in order.
fn ifs<'a>(flow: &Flow<'a>) -> Vec<If<'a>> {
    let mut found = Vec::new();
    operands::walk(&flow.function.body, &mut |statement| {
        if let Statement::If {
            condition,
            accept,
            reject,
        } = statement
        {
            found.push(If {
                condition: *condition,
                accept,
                reject,
            });
        }
    });
    found
}

/// The `if` statements on a condition, when all of them may take one side always.
fn take<'a>(
    flow: &Flow,
    condition: Value,
    ifs: &[If<'a>],
    side: bool,
) -> Result<Vec<If<'a>>, Declined> {
    may_change(flow, condition)?;
    if flow.is_constant(condition) {
        return Err(Declined("the condition is constant".into()));
    }
    let on_it = ifs.iter().filter(|branch| branch.condition == condition);
    let on_it: Vec<If> = on_it.copied().collect();
    if on_it.is_empty() {
        return Err(Declined("no `if` asks for it".into()));
    }
    let discards = |branch: &If| {
        let mut statements = branch.side(side).iter();
        statements.any(|statement| matches!(statement, Statement::Kill))
    };
    if on_it.iter().any(discards) {
        return Err(Declined("every fragment would be discarded".into()));
    }
    Ok(on_it)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::tests::shader;

    #[test]
    fn a_candidate_that_cannot_be_made_is_declined_with_the_reason() {
        let shader = shader(
            "@fragment fn main(@location(0) x: vec2f, @location(1) y: f32) -> @location(0) vec4f {
                 let site = x * 2.0; let sum = x + vec2f(1.0);
                 if y > 0.5 { discard; }
                 return vec4f(site, sum);
             }",
        );
        let candidate = |site: &str, choice: &str, value: &[f32]| Candidate {
            pass: OpRemoval.name().into(),
            site: site.into(),
            choice: choice.into(),
            value: value.iter().map(|number| number.to_bits()).collect(),
        };
        let reason = |site: &str, choice: &str, value: &[f32]| {
            let declined = OpRemoval.applies(&shader, &candidate(site, choice, value));
            declined.err().map_or(String::new(), |declined| declined.0)
        };
        assert_eq!(reason("site", "mean", &[0.5, 0.5]), "");
        assert_eq!(reason("site", "keep x", &[]), "");
        assert!(reason("site", "mean", &[0.5]).contains("bakes 1 numbers"));
        assert!(reason("site", "mean", &[0.5, f32::NAN]).contains("not finite"));
        assert!(reason("site", "keep y", &[]).contains("no operand"));
        assert!(reason("nowhere", "mean", &[0.5]).contains("no value"));
        assert!(reason("site", "halve", &[]).contains("no choice"));
        assert!(reason("site", "without", &[]).contains("nothing else to keep"));
        assert!(reason("site", "accept", &[]).contains("no `if`"));
        let constant = format!("keep {}", {
            let (stage, sum) = shader.find(&"sum".into()).expect("the test names a value");
            let flow = Flow::new(&shader, stage).expect("it has the stage");
            let mut constant = None;
            operands::each(&flow.function.expressions[sum], |operand| {
                if flow.is_constant(operand) {
                    constant = Some(flow.id(operand).to_string());
                }
            });
            constant.expect("one operand is constant")
        });
        assert!(reason("sum", &constant, &[]).contains("constant is not kept"));
    }
}
