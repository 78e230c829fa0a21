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
/// How much better than keeping the operand a line must be, as a part of the squared error.
const KEEPS_AS_WELL: f64 = 0.9;

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
/// simpler does as well. `can_keep` says that the operand itself could take the value's place.
pub(super) fn numbers(seen: &[Moments], can_keep: bool) -> Result<Vec<f32>, Declined> {
    let mut lines = Vec::with_capacity(seen.len());
    let (mut left, mut variance, mut kept) = (0.0, 0.0, 0.0);
    for moments in seen {
        // A component of which nothing follows the operand has its mean.
        let line = moments.line().unwrap_or([0.0, moments.mean[0]]);
        left += moments.error_of(line);
        variance += moments.error_of([0.0, moments.mean[0]]);
        kept += moments.error_of([1.0, 0.0]);
        lines.push(line);
    }
    // A comparison with NaN fails, and so declines.
    let good = left < MOST_LEFT * variance;
    if !good {
        return Err(Declined("its mean does nearly as well".into()));
    }
    if can_keep && left > KEEPS_AS_WELL * kept {
        return Err(Declined("keeping the operand does as well".into()));
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
