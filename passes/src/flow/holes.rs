//! Which values lead to an operation with a hole in its domain: a division, a root, a logarithm.

use super::{Flow, Value};
use naga::{Expression, MathFunction as Math};

impl Flow<'_> {
    /// For each value, on which sides it has holes before it: whether a number that is too low or too
    /// high leads to an operation whose domain ends there (a division, a logarithm, a root), through
    /// operations that hand it on.
    pub(crate) fn holes(&self) -> Vec<Holes> {
        let mut found = vec![Holes::default(); self.function.expressions.len()];
        // A second round takes what a loop stores back to the loads above it.
        for _ in 0..2 {
            let mut before_local = vec![Holes::default(); self.function.local_variables.len()];
            for (user, expression) in self.function.expressions.iter().rev() {
                let after = found[user.index()];
                if let Expression::Load { pointer } = *expression
                    && let Some(local) = self.local(pointer)
                {
                    before_local[local.index()] |= after;
                }
                holes(
                    expression,
                    |value| self.is_constant(value),
                    after,
                    |operand, holes| {
                        if self.is_float(operand) {
                            found[operand.index()] |= holes;
                        }
                    },
                );
            }
            for store in &self.findings.stores {
                found[store.value.index()] |= before_local[store.local.index()];
            }
        }
        found
    }

    /// Whether an operation itself has a hole in the domain of an operand.
    pub(crate) fn has_hole(&self, operation: Value, operand: Value) -> bool {
        let mut found = Holes::default();
        let expression = &self.function.expressions[operation];
        holes(
            expression,
            |_| false,
            Holes::default(),
            |value, holes| {
                if value == operand {
                    found |= holes;
                }
            },
        );
        found != Holes::default()
    }
}

/// The sides on which the domain of an operation further on ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Holes {
    /// A number that is too low falls in.
    pub(crate) low: bool,
    /// A number that is too high falls in.
    pub(crate) high: bool,
}

impl Holes {
    const LOW: Self = Self {
        low: true,
        high: false,
    };
    const BOTH: Self = Self {
        low: true,
        high: true,
    };

    fn flipped(self) -> Self {
        Self {
            low: self.high,
            high: self.low,
        }
    }

    /// For an operand whose sign, or whose partner's sign, decides the side.
    fn either(self) -> Self {
        let any = self.low || self.high;
        Self {
            low: any,
            high: any,
        }
    }
}

impl std::ops::BitOrAssign for Holes {
    fn bitor_assign(&mut self, other: Self) {
        self.low |= other.low;
        self.high |= other.high;
    }
}

/// Tells the holes before each operand of an operation: its own, and those after it (`after`) that a
/// bad number in the operand would reach.
///
/// Operations whose result lies in a safe range whatever goes in (`clamp`, `exp`, a `max` with a
/// constant on its side) end the search: a bad number ends there.
fn holes(
    expression: &Expression,
    is_constant: impl Fn(Value) -> bool,
    after: Holes,
    mut visit: impl FnMut(Value, Holes),
) {
    use naga::BinaryOperator as Op;
    match *expression {
        Expression::Binary { op, left, right } => match op {
            Op::Divide | Op::Modulo => {
                visit(left, after.either());
                // A divisor is kept off 0 from above as a rule.
                visit(right, Holes::LOW);
                visit(right, after.either());
            }
            Op::Add => [left, right]
                .into_iter()
                .for_each(|value| visit(value, after)),
            Op::Subtract => {
                visit(left, after);
                visit(right, after.flipped());
            }
            Op::Multiply => {
                [left, right]
                    .into_iter()
                    .for_each(|value| visit(value, after.either()));
            }
            _ => {}
        },
        Expression::Unary { expr, .. } => visit(expr, after.flipped()),
        Expression::Swizzle { vector: value, .. }
        | Expression::Splat { value, .. }
        | Expression::AccessIndex { base: value, .. }
        | Expression::Access { base: value, .. } => visit(value, after),
        Expression::Compose { ref components, .. } => {
            components
                .iter()
                .for_each(|&component| visit(component, after));
        }
        Expression::Select { accept, reject, .. } => {
            visit(accept, after);
            visit(reject, after);
        }
        Expression::Math {
            fun,
            arg,
            arg1,
            arg2,
            ..
        } => {
            let others = || arg1.into_iter().chain(arg2);
            match fun {
                Math::Log
                | Math::Log2
                | Math::Sqrt
                | Math::InverseSqrt
                | Math::Pow
                | Math::Normalize
                | Math::Acosh => {
                    let mut holes = after;
                    holes |= Holes::LOW;
                    visit(arg, holes);
                }
                Math::Acos | Math::Asin | Math::Atanh => visit(arg, Holes::BOTH),
                Math::Min | Math::Max => {
                    let limited = is_constant(arg) || others().any(&is_constant);
                    let rest = match fun {
                        Math::Max => Holes {
                            low: after.low && !limited,
                            ..after
                        },
                        _ => Holes {
                            high: after.high && !limited,
                            ..after
                        },
                    };
                    visit(arg, rest);
                    others().for_each(|value| visit(value, rest));
                }
                Math::Abs => visit(
                    arg,
                    Holes {
                        low: false,
                        ..after
                    }
                    .either(),
                ),
                Math::Floor | Math::Ceil | Math::Round | Math::Trunc => visit(arg, after),
                Math::Mix
                | Math::Fma
                | Math::Dot
                | Math::Cross
                | Math::Reflect
                | Math::Distance
                | Math::Length => {
                    visit(arg, after.either());
                    others().for_each(|value| visit(value, after.either()));
                }
                _ => {}
            }
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use crate::flow::Flow;
    use crate::flow::tests::shader;
    use crate::shader::Stage;

    #[test]
    fn holes_are_reached_through_sums_and_variables_but_not_through_guards() {
        let source = "@fragment fn main(@location(0) x: f32) -> @location(0) vec4f {
                let far = x + 2.0; let guarded = x + 3.0; let stored = x + 4.0; let over = x + 5.0;
                let under = x + 6.0;
                var kept = 0.0;
                if x > 0.5 { kept = stored; }
                let root = sqrt(far + 1.0) + log(max(guarded, 0.1)) + over / (kept + 1.0)
                    + sqrt(1.0 - max(under, 0.0));
                return vec4f(root);
            }";
        let shader = shader(source);
        let flow = Flow::new(&shader, Stage::Fragment).expect("there is a fragment stage");
        let holes = flow.holes();
        for (name, expected) in [
            ("far", true),
            ("guarded", false),
            ("stored", true),
            ("over", false),
        ] {
            let (_, value) = shader.find(&name.into()).expect("the test names a value");
            assert_eq!(holes[value.index()].low, expected, "{name}");
        }
        let (_, under) = shader
            .find(&"under".into())
            .expect("the test names a value");
        assert!(
            holes[under.index()].high,
            "what is taken off may be too high"
        );
    }
}
