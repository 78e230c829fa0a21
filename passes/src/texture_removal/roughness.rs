//! The roughness of a shader, which takes up the slopes of a map of normals that goes.
//!
//! A microfacet distribution is one of slopes: alpha, the parameter of Beckmann's and of Trowbridge and Reitz's
//! (GGX), has alpha^2 / 2 for the variance of Beckmann's slopes along an axis. The slopes of a map come on top of
//! those and do not depend on them, so that variances add: alpha^2 grows by twice the mean of the variances along the
//! two axes, which is their sum. Perceptual roughness is the root of alpha, so that it is alpha that is looked for.
//!
//! Which values hold alpha is told from a name and from squares:
//! - a value called `alpha`, or a roughness, that is the square of another, or of another roughness;
//! - the squares of what is called a roughness, where these are squared again, limits in between or not: alpha^2 is
//!   what distributions are made of;
//! - what is called a roughness, where its square is never squared again.

use crate::constants;
use crate::edit::{Edit, New};
use crate::flow::{Flow, Value};
use crate::operands::User;
use crate::recipe::Declined;
use crate::shader::{Shader, Stage, ValueId};
use naga::{BinaryOperator as Op, Expression, Literal, MathFunction as Math};
use std::collections::BTreeSet;

/// The largest alpha: shaders take roots of what it leaves of 1.
pub(super) const MOST: f32 = 1.0;

/// Words in the names of roughnesses that are not those of the surface under a map of normals.
const OTHERS: [&str; 6] = [
    "coat",
    "sheen",
    "fuzz",
    "diffuse",
    "transmission",
    "subsurface",
];

/// The values that hold alpha, in arena order, where it is the roughness of what is shaded with the normals that are
/// read.
///
/// # Errors
/// When there is none or it is not sure, when it decides more than the picture, or when it and the normals do not meet
/// as they should: neither made of the other, and something made of both.
pub(super) fn find(flow: &Flow, reads: &[Value]) -> Result<Vec<Value>, Declined> {
    let found = alphas(flow)?;
    for alpha in &found {
        may_widen(flow, *alpha)?;
    }
    let mut own = vec![0; flow.function.expressions.len()];
    for (values, bit) in [(reads, 1), (&found, 2)] {
        for value in values {
            own[value.index()] = bit;
        }
    }
    let depends = flow.spread(&own);
    if found.iter().any(|alpha| depends[alpha.index()] & 1 != 0) {
        return Err(Declined(
            "the roughness is made of the normals already".into(),
        ));
    }
    if reads.iter().any(|read| depends[read.index()] & 2 != 0) {
        return Err(Declined(
            "where the normals are read depends on the roughness".into(),
        ));
    }
    let is_made_of_both = |(value, expression): (Value, &Expression)| {
        let computes = matches!(
            expression,
            Expression::Binary { .. }
                | Expression::Math { .. }
                | Expression::Select { .. }
                | Expression::ImageSample { .. }
        );
        computes && depends[value.index()] == 3
    };
    if !flow.function.expressions.iter().any(is_made_of_both) {
        return Err(Declined(
            "nothing is made of both the normals and the roughness".into(),
        ));
    }
    Ok(found)
}

/// Declines what is no roughness, or decides more than the picture.
fn may_widen(flow: &Flow, alpha: Value) -> Result<(), Declined> {
    if flow.floats(alpha) != Some(1) || flow.is_constant(alpha) {
        return Err(Declined(format!(
            "`{}` is no roughness: it is constant, or no f32",
            flow.id(alpha).path()
        )));
    }
    match flow.decides(alpha) {
        Some(why) => Err(Declined(why.to_string())),
        None => Ok(()),
    }
}

/// The values that ids of a choice name.
///
/// # Errors
/// When one is not there, is there twice, or cannot be a roughness.
pub(super) fn named(flow: &Flow, ids: &str) -> Result<Vec<Value>, Declined> {
    let mut found = Vec::new();
    for id in ids.split_whitespace().map(ValueId::from) {
        let value = flow.shader.find(&id);
        let Some((_, value)) = value.filter(|(stage, _)| *stage == flow.stage) else {
            return Err(Declined(format!("there is no value `{}`", id.path())));
        };
        may_widen(flow, value)?;
        if found.contains(&value) {
            return Err(Declined(format!("it names `{}` twice", id.path())));
        }
        found.push(value);
    }
    match found.is_empty() {
        true => Err(Declined("it names no roughness".into())),
        false => Ok(found),
    }
}

/// How a value that is called a roughness is known to be alpha.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord)]
enum Evidence {
    /// It is a square, or its square is squared again.
    TwoSquares,
    /// Its square is not squared again.
    OneSquare,
}

fn alphas(flow: &Flow) -> Result<Vec<Value>, Declined> {
    let mut called = false;
    let mut groups: BTreeSet<(Evidence, Vec<Value>)> = BTreeSet::new();
    for (value, _) in flow.function.expressions.iter() {
        if flow.floats(value) != Some(1) || flow.is_constant(value) {
            continue;
        }
        let Some(name) = Name::of(flow, value) else {
            continue;
        };
        let of = root(flow, value);
        match name {
            Name::Alpha if of.is_some() => {
                groups.insert((Evidence::TwoSquares, vec![value]));
            }
            Name::Alpha => continue,
            Name::Roughness => match of.and_then(|of| Name::of(flow, of)) {
                Some(Name::Roughness) => {
                    groups.insert((Evidence::TwoSquares, vec![value]));
                }
                _ => groups.extend(of_roughness(flow, value)),
            },
        }
        called = true;
    }
    // What is sure goes before what is not.
    let sure = groups.iter().any(|(how, _)| *how == Evidence::TwoSquares);
    groups.retain(|(how, _)| (*how == Evidence::TwoSquares) == sure);
    // The alphas of two lights are those of one roughness.
    let all = groups.clone();
    let within = |part: &[Value], whole: &[Value]| {
        part.len() < whole.len() && part.iter().all(|value| whole.contains(value))
    };
    groups.retain(|(_, group)| !all.iter().any(|(_, whole)| within(group, whole)));
    match (groups.len(), groups.pop_first()) {
        (1, Some((_, group))) => Ok(group),
        (0, _) if called => Err(Declined(
            "nothing squares what is called a roughness, so that it is not known how it is meant"
                .into(),
        )),
        (0, _) => Err(Declined("no value is called a roughness".into())),
        _ => Err(Declined("there are several roughnesses".into())),
    }
}

/// What a roughness is in alphas, from the squares that are made of it.
fn of_roughness(flow: &Flow, value: Value) -> Option<(Evidence, Vec<Value>)> {
    let direct: Vec<Value> = squares(flow, value).collect();
    let mut limited: Vec<Value> = direct.iter().map(|square| limited(flow, *square)).collect();
    limited.sort_unstable();
    limited.dedup();
    let again = |square: &Value| squares(flow, *square).next().is_some();
    if limited.iter().any(again) {
        return Some((Evidence::TwoSquares, limited));
    }
    // In a variable or a vector a square is lost sight of.
    let is_lost = |square: &Value| {
        flow.is_stated(*square)
            || flow.users(*square).any(|user| {
                matches!(
                    flow.function.expressions[user],
                    Expression::Compose { .. } | Expression::Splat { .. }
                )
            })
    };
    let known = !limited.is_empty() && !limited.iter().any(is_lost);
    known.then(|| (Evidence::OneSquare, vec![value]))
}

/// The squares of a value.
fn squares<'a>(flow: &'a Flow<'a>, value: Value) -> impl Iterator<Item = Value> + 'a {
    flow.users(value)
        .filter(move |user| square_of(flow, *user) == Some(value))
}

/// What a value is the square of.
fn square_of(flow: &Flow, value: Value) -> Option<Value> {
    match flow.function.expressions[value] {
        Expression::Binary {
            op: Op::Multiply,
            left,
            right,
        } => (left == right).then_some(left),
        Expression::Math {
            fun: Math::Pow,
            arg,
            arg1: Some(power),
            ..
        } => (constants::numbers(flow, power)? == [2.0]).then_some(arg),
        _ => None,
    }
}

/// What a value is the square of, within limits or not.
fn root(flow: &Flow, mut value: Value) -> Option<Value> {
    while let Some(inner) = limits(flow, value) {
        value = inner;
    }
    square_of(flow, value)
}

/// A value within its limits, where nothing else is done with it.
fn limited(flow: &Flow, mut value: Value) -> Value {
    loop {
        let mut users = flow.users(value);
        match (users.next(), users.next()) {
            (Some(only), None) if limits(flow, only) == Some(value) && !flow.is_stated(value) => {
                value = only;
            }
            _ => return value,
        }
    }
}

/// The value that an operation keeps within constant limits.
fn limits(flow: &Flow, value: Value) -> Option<Value> {
    let Expression::Math {
        fun,
        arg,
        arg1,
        arg2,
        ..
    } = flow.function.expressions[value]
    else {
        return None;
    };
    let constant = |value: Option<Value>| value.is_none_or(|value| flow.is_constant(value));
    match (fun, arg1) {
        (Math::Saturate, _) => Some(arg),
        (Math::Clamp, _) => (constant(arg1) && constant(arg2)).then_some(arg),
        (Math::Max | Math::Min, Some(other)) if flow.is_constant(arg) => Some(other),
        (Math::Max | Math::Min, _) => constant(arg1).then_some(arg),
        _ => None,
    }
}

/// What a name says.
#[derive(Clone, Copy, PartialEq)]
enum Name {
    Roughness,
    /// Either that, or how much of what is behind is covered.
    Alpha,
}

impl Name {
    /// What a person called a value, when it is one of these.
    fn of(flow: &Flow, value: Value) -> Option<Self> {
        let path = flow.id(value).path();
        let name = path.rsplit('.').next().unwrap_or(path).to_lowercase();
        if name.contains("rough") {
            let other = OTHERS.iter().any(|word| name.contains(word));
            return (!other).then_some(Self::Roughness);
        }
        let mut words = name.split(|c: char| !c.is_ascii_alphabetic());
        words.any(|word| word == "alpha").then_some(Self::Alpha)
    }
}

/// Has every user of an alpha use one that is wider by a variance: `sqrt(min(alpha * alpha + variance, 1.0))`. One that was
/// widened already is made wider still, so that the order does not matter.
pub(super) fn widen(edit: &mut Edit, shader: &Shader, alpha: Value, variance: f32) {
    let Some(flow) = Flow::new(shader, Stage::Fragment) else {
        return;
    };
    if let Some((sum, number, before)) = widened(&flow, alpha) {
        let more = New::Numbers(vec![before + variance]);
        return edit.replace_operand(User::Value(sum), number, more);
    }
    let path = format!("{}.widened", flow.id(alpha).path());
    let binary = |op, left, right| Expression::Binary { op, left, right };
    let math = |fun, arg, arg1| Expression::Math {
        fun,
        arg,
        arg1,
        arg2: None,
        arg3: None,
    };
    let number = |edit: &mut Edit, number| {
        let literal = Expression::Literal(Literal::F32(number));
        edit.add(format!("{path}.constant"), literal)
    };
    let square = edit.add(format!("{path}.mul"), binary(Op::Multiply, alpha, alpha));
    let variance = number(edit, variance);
    let sum = edit.add(format!("{path}.add"), binary(Op::Add, square, variance));
    let most = number(edit, MOST);
    let least = edit.add(format!("{path}.min"), math(Math::Min, sum, Some(most)));
    let wider = edit.add(path.clone(), math(Math::Sqrt, least, None));
    for user in shader.users(Stage::Fragment, alpha) {
        edit.replace_operand(*user, alpha, New::Value(wider));
    }
}

/// Of an alpha that is widened already: the sum, its constant, and the number that this is.
fn widened(flow: &Flow, alpha: Value) -> Option<(Value, Value, f32)> {
    let only = |value: Value| {
        let mut users = flow.users(value);
        let user = users.next()?;
        (users.next().is_none() && !flow.is_stated(value)).then_some(user)
    };
    let square = only(alpha)?;
    let sum = only(square)?;
    let least = only(sum)?;
    let root = only(least)?;
    let (
        Expression::Binary {
            op: Op::Add,
            left,
            right: number,
        },
        Expression::Math {
            fun: Math::Min,
            arg1: Some(most),
            ..
        },
        Expression::Math {
            fun: Math::Sqrt, ..
        },
    ) = (
        &flow.function.expressions[sum],
        &flow.function.expressions[least],
        &flow.function.expressions[root],
    )
    else {
        return None;
    };
    let is_alike = square_of(flow, square) == Some(alpha)
        && *left == square
        && constants::numbers(flow, *most)? == [MOST];
    let before = constants::numbers(flow, *number)?.first().copied()?;
    is_alike.then_some((sum, *number, before))
}
