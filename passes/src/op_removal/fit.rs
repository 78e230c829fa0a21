//! Affine functions of an operand in the place of an operation: `scale * operand + offset`.

use crate::edit::Edit;
use crate::facts::Moments;
use crate::flow::{Flow, Value};
use crate::operands;
use crate::recipe::{Candidate, Declined};
use crate::shader::{Shader, Stage};
use naga::{BinaryOperator, Expression, Handle, Literal, MathFunction, TypeInner, UnaryOperator};

/// The part of a value's variance that a line may leave: above it the mean does nearly as well, for less.
const MOST_LEFT: f64 = 0.5;
/// How much better than something simpler a line must be, as a part of the squared error.
const AS_WELL: f64 = 0.9;

/// What is simpler than a line, and is offered elsewhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Simpler {
    /// The operand itself.
    Kept,
    /// A sum or difference whose other side becomes a number: the operand, times this, and a number.
    Shifted(f64),
    /// A product whose other side becomes a number.
    Scaled,
}

impl Simpler {
    /// What the other operand of a sum, a difference or a product leaves when it becomes a number.
    pub(super) fn of(expression: &Expression, operand: Value) -> Option<(Self, Value)> {
        let Expression::Binary { op, left, right } = *expression else {
            return None;
        };
        let other = if left == operand { right } else { left };
        let simpler = match op {
            BinaryOperator::Add => Self::Shifted(1.0),
            BinaryOperator::Subtract if left == operand => Self::Shifted(1.0),
            BinaryOperator::Subtract => Self::Shifted(-1.0),
            BinaryOperator::Multiply => Self::Scaled,
            _ => return None,
        };
        (other != operand).then_some((simpler, other))
    }

    /// The mean squared error that it leaves of a component.
    fn error(self, seen: &Moments) -> f64 {
        let [value, operand] = seen.mean;
        seen.error_of(match self {
            Self::Kept => [1.0, 0.0],
            Self::Shifted(scale) => [scale, value - scale * operand],
            Self::Scaled => {
                let square = seen.squares[1] / seen.weight + operand * operand;
                let product = seen.product / seen.weight + value * operand;
                [if square > 0.0 { product / square } else { 0.0 }, 0.0]
            }
        })
    }
}

/// The operands of an operation on floats that it can be fitted to: those that vary, with as many components, or one.
pub(super) fn operands(flow: &Flow, site: Value) -> Vec<Value> {
    let expression = &flow.function.expressions[site];
    let is_operation = match expression {
        Expression::Unary { op, .. } => *op == UnaryOperator::Negate,
        Expression::Binary { .. } | Expression::Select { .. } | Expression::Math { .. } => true,
        _ => false,
    };
    let mut found = Vec::new();
    if let (true, Some(count)) = (is_operation, flow.floats(site)) {
        operands::each(expression, |operand| {
            let fits =
                matches!(flow.floats(operand), Some(1)) || flow.floats(operand) == Some(count);
            if fits && !flow.is_constant(operand) && !found.contains(&operand) {
                found.push(operand);
            }
        });
    }
    found
}

/// Whether the result of a line is kept within the range that the value was seen in.
#[derive(Clone, Copy)]
pub(super) struct Limited(pub(super) bool);

/// A line as a candidate bakes it.
#[derive(Debug)]
pub(super) struct Line {
    operand: Value,
    scale: Vec<f32>,
    offset: Vec<f32>,
    /// The smallest and the largest result.
    limits: Option<(Vec<f32>, Vec<f32>)>,
}

impl Line {
    /// Reads the numbers of a candidate: scales, offsets, and lower and upper limits where it is limited.
    pub(super) fn new(
        flow: &Flow,
        site: Value,
        operand: Value,
        limited: Limited,
        candidate: &Candidate,
    ) -> Result<Self, Declined> {
        let count = flow.floats(site).unwrap_or(0);
        let numbers = candidate.baked(count * if limited.0 { 4 } else { 2 })?;
        let part = |i: usize| numbers[i * count..(i + 1) * count].to_vec();
        let limits = limited.0.then(|| (part(2), part(3)));
        if let Some((low, high)) = &limits
            && low.iter().zip(high).any(|(low, high)| low > high)
        {
            return Err(Declined("its lower limit is above the upper one".into()));
        }
        Ok(Self {
            operand,
            scale: part(0),
            offset: part(1),
            limits,
        })
    }

    /// Adds the values that compute it.
    pub(super) fn write(self, shader: &Shader, edit: &mut Edit, site: Value) -> Value {
        let path = format!("{}.fit", shader.id(Stage::Fragment, site).path());
        let inner = shader.type_of(Stage::Fragment, site).clone();
        let constant = |edit: &mut Edit, numbers: &[f32]| -> Handle<Expression> {
            let parts: Vec<_> = numbers
                .iter()
                .map(|number| {
                    let literal = Expression::Literal(Literal::F32(*number));
                    edit.add(format!("{path}.constant"), literal)
                })
                .collect();
            match (&inner, &parts[..]) {
                (TypeInner::Scalar(_), [only]) => *only,
                _ => {
                    let ty = edit.ty(inner.clone());
                    let components = parts;
                    let compose = Expression::Compose { ty, components };
                    edit.add(format!("{path}.constant"), compose)
                }
            }
        };
        let binary = |op, left, right| Expression::Binary { op, left, right };
        let scale = constant(edit, &self.scale);
        let scaled = binary(BinaryOperator::Multiply, self.operand, scale);
        let scaled = edit.add(format!("{path}.mul"), scaled);
        let offset = constant(edit, &self.offset);
        let line = edit.add(path.clone(), binary(BinaryOperator::Add, scaled, offset));
        let Some((low, high)) = self.limits else {
            return line;
        };
        let (low, high) = (constant(edit, &low), constant(edit, &high));
        let clamp = Expression::Math {
            fun: MathFunction::Clamp,
            arg: line,
            arg1: Some(low),
            arg2: Some(high),
            arg3: None,
        };
        edit.add(format!("{path}.clamp"), clamp)
    }
}

/// What a line costs, in full-rate scalar operations.
pub(super) fn work(count: usize, limited: bool) -> f64 {
    (count * if limited { 4 } else { 2 }) as f64
}

/// The numbers of the line, scales and then offsets, from what was seen of each component; declined where something
/// simpler does as well.
pub(super) fn numbers(seen: &[Moments], simpler: &[Simpler]) -> Result<Vec<f32>, Declined> {
    let mut lines = Vec::with_capacity(seen.len());
    let (mut left, mut variance) = (0.0, 0.0);
    for moments in seen {
        // A component of which nothing follows the operand has its mean.
        let line = moments.line().unwrap_or([0.0, moments.mean[0]]);
        left += moments.error_of(line);
        variance += moments.error_of([0.0, moments.mean[0]]);
        lines.push(line);
    }
    // A comparison with NaN fails, and so declines.
    let good = left < MOST_LEFT * variance;
    if !good {
        return Err(Declined("its mean does nearly as well".into()));
    }
    for other in simpler {
        let leaves: f64 = seen.iter().map(|moments| other.error(moments)).sum();
        if left > AS_WELL * leaves {
            let what = match other {
                Simpler::Kept => "keeping the operand",
                Simpler::Shifted(_) | Simpler::Scaled => "a number for the other operand",
            };
            return Err(Declined(format!("{what} does as well")));
        }
    }
    let numbers: Vec<f32> = [0, 1]
        .into_iter()
        .flat_map(|i| lines.iter().map(move |line| line[i] as f32))
        .collect();
    match numbers.iter().all(|number| number.is_finite()) {
        true => Ok(numbers),
        false => Err(Declined("the line has no finite numbers".into())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is seen of a value that follows an operand, and is a little off to either side in turn.
    fn seen(value: impl Fn(f64) -> f64) -> [Moments; 1] {
        let mut seen = Moments::default();
        for i in 0..64 {
            let operand = 1.0 + f64::from(i / 2) / 16.0;
            let off = if i % 2 == 0 { 0.1 } else { -0.1 };
            seen.add([value(operand) + off, operand], 1.0);
        }
        [seen]
    }

    #[test]
    fn a_line_is_no_better_than_a_number_for_what_does_not_follow_the_operand() {
        let declined = |seen: [Moments; 1], simpler| numbers(&seen, &[simpler]).is_err();
        assert!(declined(seen(|x| x + 0.5), Simpler::Shifted(1.0)));
        assert!(declined(seen(|x| 0.5 - x), Simpler::Shifted(-1.0)));
        assert!(declined(seen(|x| 3.0 * x), Simpler::Scaled));
        assert!(declined(seen(|x| x), Simpler::Kept));
        // Nothing simpler does these.
        assert!(!declined(seen(|x| 0.6 * x), Simpler::Shifted(1.0)));
        assert!(!declined(seen(|x| 3.0 * x - 2.0), Simpler::Scaled));
        assert!(!declined(seen(|x| x + 0.5), Simpler::Kept));
        // Noise alone has a mean.
        assert!(numbers(&seen(|_| 1.0), &[]).is_err());
    }

    #[test]
    fn sums_and_products_have_another_operand() {
        let mut arena = naga::Arena::new();
        let span = naga::Span::default();
        let [a, b] = [0, 1].map(|i| arena.append(Expression::FunctionArgument(i), span));
        let of = |op, left, right, operand| {
            Simpler::of(&Expression::Binary { op, left, right }, operand)
        };
        use BinaryOperator as Op;
        assert_eq!(of(Op::Add, a, b, b), Some((Simpler::Shifted(1.0), a)));
        assert_eq!(of(Op::Subtract, a, b, a), Some((Simpler::Shifted(1.0), b)));
        assert_eq!(of(Op::Subtract, a, b, b), Some((Simpler::Shifted(-1.0), a)));
        assert_eq!(of(Op::Multiply, a, b, a), Some((Simpler::Scaled, b)));
        assert_eq!(of(Op::Multiply, a, a, a), None);
        assert_eq!(of(Op::Divide, a, b, a), None);
    }
}
