//! Operations of which a known 0 or 1 makes a part pointless.

use crate::edit::New;
use crate::facts::Facts;
use crate::flow::{Flow, Value};
use crate::recipe::Declined;
use crate::{constants, semantics::Shape};
use naga::{BinaryOperator as Op, Expression, MathFunction as Math};

/// What an operation becomes, and what it then does without.
pub(super) struct Absent {
    /// The operand that takes its place; `None` for a 0.
    kept: Option<Value>,
    /// What is multiplied by 0 there.
    lost: Option<Value>,
}

impl Absent {
    /// What becomes of an operation; `None` where it has no such part.
    pub(super) fn of(flow: &Flow, site: Value) -> Option<Self> {
        flow.floats(site)?;
        let is = |operand: Value, number: f32| {
            constants::numbers(flow, operand)
                .is_some_and(|numbers| numbers.iter().all(|have| *have == number))
        };
        let (zero, one) = (|operand| is(operand, 0.0), |operand| is(operand, 1.0));
        let kept = |operand| {
            (flow.inner(operand) == flow.inner(site)).then_some(Self {
                kept: Some(operand),
                lost: None,
            })
        };
        let nothing = |lost| {
            let (kept, lost) = (None, Some(lost));
            Some(Self { kept, lost })
        };
        if flow.is_constant(site) {
            return None;
        }
        match flow.function.expressions[site] {
            Expression::Binary { op, left, right } => match op {
                Op::Multiply if zero(left) => nothing(right),
                Op::Multiply if zero(right) => nothing(left),
                Op::Multiply if one(left) => kept(right),
                Op::Multiply | Op::Divide if one(right) => kept(left),
                Op::Add if zero(left) => kept(right),
                Op::Add | Op::Subtract if zero(right) => kept(left),
                _ => None,
            },
            Expression::Math {
                fun,
                arg,
                arg1: Some(arg1),
                arg2,
                ..
            } => match (fun, arg2) {
                (Math::Mix, Some(t)) if zero(t) => Some(Self {
                    lost: Some(arg1),
                    ..kept(arg)?
                }),
                (Math::Mix, Some(t)) if one(t) => Some(Self {
                    lost: Some(arg),
                    ..kept(arg1)?
                }),
                (Math::Fma, Some(sum)) if zero(arg) => Some(Self {
                    lost: Some(arg1),
                    ..kept(sum)?
                }),
                (Math::Fma, Some(sum)) if zero(arg1) => Some(Self {
                    lost: Some(arg),
                    ..kept(sum)?
                }),
                (Math::Dot, None) if zero(arg) => nothing(arg1),
                (Math::Dot, None) if zero(arg1) => nothing(arg),
                _ => None,
            },
            _ => None,
        }
    }

    /// Declines where what is multiplied by 0 may be infinite or undefined.
    pub(super) fn is_harmless(&self, flow: &Flow, facts: &Facts) -> Result<(), Declined> {
        let Some(lost) = self.lost.filter(|lost| !flow.is_constant(*lost)) else {
            return Ok(());
        };
        let id = flow.id(lost);
        let seen = facts.values.get(id).filter(|seen| seen.count > 0);
        let seen = seen.ok_or_else(|| {
            let path = id.path();
            Declined(format!(
                "0 times `{path}` is 0 unless that is infinite or undefined, and no sample of the scene computes it"
            ))
        })?;
        let mut limits = seen.min.iter().chain(&seen.max);
        match limits.all(|limit| limit.is_finite()) {
            true => Ok(()),
            false => Err(Declined(format!(
                "0 times `{}` is not always 0: it was seen infinite or undefined",
                id.path()
            ))),
        }
    }

    /// What takes the place of the operation.
    pub(super) fn becomes(&self, flow: &Flow, site: Value) -> New {
        match self.kept {
            Some(kept) => New::Value(kept),
            None => {
                let components = Shape::of(flow.inner(site)).map_or(1, Shape::components);
                New::Words(vec![0; components])
            }
        }
    }
}
