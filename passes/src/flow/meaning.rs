//! Values that have no mean: numbers of things, and angles.

use super::{Flow, Value};
use crate::operands;
use crate::recipe::Declined;
use naga::{BinaryOperator as Op, Expression, MathFunction as Math, ScalarKind};

/// What a value means, when a mean of it means nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Meaning {
    /// It is a whole number: of a cell, a layer, a round.
    Number,
    /// All that it does is decide: it is compared, counted with, or looks up.
    Decision,
    /// It is an angle: the mean of 1 and 359 degrees is not 180.
    Angle,
}

impl From<Meaning> for Declined {
    fn from(meaning: Meaning) -> Self {
        Self(
            match meaning {
                Meaning::Number => "it is a whole number of something, which has no mean",
                Meaning::Decision => {
                    "it is only compared, or made an integer: the mean of what decides decides nothing"
                }
                Meaning::Angle => "it is an angle, which has no mean",
            }
            .into(),
        )
    }
}

impl Flow<'_> {
    /// Why a value has no mean, when it has none. A truth value made a float, such as that of `step`, has one: the
    /// share of what it covers.
    pub(crate) fn meaning(&self, value: Value) -> Option<Meaning> {
        if let Some(meaning) = self.made_as(value) {
            return Some(meaning);
        }
        if self.is_turned(value) {
            return Some(Meaning::Angle);
        }
        self.only_decides(value).then_some(Meaning::Decision)
    }

    /// What a value is by the operation that makes it, through what only moves it.
    fn made_as(&self, value: Value) -> Option<Meaning> {
        let expression = &self.function.expressions[value];
        match *expression {
            Expression::Math { fun, .. } => match fun {
                Math::Floor | Math::Ceil | Math::Round | Math::Trunc => Some(Meaning::Number),
                Math::Acos | Math::Asin | Math::Atan | Math::Atan2 => Some(Meaning::Angle),
                Math::Radians | Math::Degrees => Some(Meaning::Angle),
                _ => None,
            },
            Expression::As { expr, .. } => matches!(
                self.inner(expr).scalar_kind(),
                Some(ScalarKind::Sint | ScalarKind::Uint)
            )
            .then_some(Meaning::Number),
            Expression::Unary { expr, .. } if self.is_float(expr) => self.made_as(expr),
            _ if moves(expression) => {
                let mut meanings = Vec::new();
                operands::each(expression, |operand| {
                    if !self.is_constant(operand) {
                        meanings.push(self.made_as(operand));
                    }
                });
                let first = meanings.first().copied().flatten()?;
                meanings
                    .iter()
                    .all(|meaning| *meaning == Some(first))
                    .then_some(first)
            }
            _ => None,
        }
    }

    /// Whether a sine, cosine or tangent is taken of a value.
    fn is_turned(&self, value: Value) -> bool {
        self.users(value).any(|user| {
            let expression = &self.function.expressions[user];
            match *expression {
                Expression::Math { fun, .. } => match fun {
                    Math::Sin | Math::Cos | Math::Tan => true,
                    Math::Radians | Math::Degrees => self.is_turned(user),
                    _ => false,
                },
                Expression::Unary { .. } => self.is_float(user) && self.is_turned(user),
                // A vector may hold an angle beside other things.
                Expression::Compose { .. } => false,
                _ => moves(expression) && self.is_turned(user),
            }
        })
    }

    /// Whether all users of a value, of which there is one, compare it, make an integer of it, or pass it on to such.
    fn only_decides(&self, value: Value) -> bool {
        if self.is_stated(value) {
            return false;
        }
        let mut any = false;
        let all = self.users(value).all(|user| {
            any = true;
            let expression = &self.function.expressions[user];
            match *expression {
                Expression::Binary { op, .. } => matches!(
                    op,
                    Op::Equal
                        | Op::NotEqual
                        | Op::Less
                        | Op::LessEqual
                        | Op::Greater
                        | Op::GreaterEqual
                ),
                Expression::As { kind, .. } => {
                    matches!(kind, ScalarKind::Sint | ScalarKind::Uint | ScalarKind::Bool)
                }
                _ => moves(expression) && self.only_decides(user),
            }
        });
        any && all
    }
}

/// Whether an expression takes a value apart, or puts it together, and computes nothing.
fn moves(expression: &Expression) -> bool {
    matches!(
        expression,
        Expression::Swizzle { .. }
            | Expression::AccessIndex { .. }
            | Expression::Splat { .. }
            | Expression::Compose { .. }
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::tests::shader;
    use crate::shader::Stage;

    #[test]
    fn numbers_decisions_and_angles_have_no_mean_and_shares_have() {
        let shader = shader(
            "@fragment fn main(@location(0) x: f32, @location(1) y: vec2f) -> @location(0) vec4f {
                 let cell = floor(y * 4.0); let cells = cell.x; let hash = cell * 0.25;
                 let layer = f32(i32(x * 3.0)); let share = step(0.5, x); let flag = f32(x > 0.5);
                 let bound = x * 2.0; let both = x * 3.0; let picked = y * 5.0; let place = x * 9.0;
                 let turn = x * 6.0; let heading = atan2(y.x, y.y); let bent = heading * 0.5;
                 var sum = share + flag + sin(-turn) + layer + cells + hash.x + bent + both + x;
                 if bound > 1.0 && both > 2.0 && picked.x > 0.5 { sum += 1.0; }
                 if u32(place) == 3u { sum += 2.0; }
                 return vec4f(sum);
             }",
        );
        let flow = Flow::new(&shader, Stage::Fragment).expect("there is a fragment stage");
        for (name, meaning) in [
            ("cell", Some(Meaning::Number)),
            ("cells", Some(Meaning::Number)),
            ("layer", Some(Meaning::Number)),
            ("bound", Some(Meaning::Decision)),
            ("picked", Some(Meaning::Decision)),
            ("place", Some(Meaning::Decision)),
            ("turn", Some(Meaning::Angle)),
            ("heading", Some(Meaning::Angle)),
            ("hash", None),
            ("share", None),
            ("flag", None),
            ("both", None),
            ("bent", None),
        ] {
            let (_, value) = shader.find(&name.into()).expect("the test names a value");
            assert_eq!(flow.meaning(value), meaning, "{name}");
        }
    }
}
