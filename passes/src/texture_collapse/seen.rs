//! What values are, seen from coordinates: affine functions of them, or made of what textures hold there.

use crate::flow::{Flow, Value};
use crate::operands;
use naga::{
    AddressSpace, BinaryOperator, Block, Expression, ImageClass, ImageDimension, Literal,
    MathFunction, SampleLevel, ScalarKind, Statement, TypeInner, UnaryOperator,
};

/// How far from a whole number a count of repeats may be.
const WHOLE: f32 = 1e-6;

/// How often a source may repeat in a generated texture, along an axis.
const MOST_REPEATS: f32 = 64.0;

/// A texture sample that can go into another texture.
#[derive(Clone, Copy)]
pub(super) struct Sample {
    pub(super) image: Value,
    pub(super) sampler: Value,
    pub(super) coordinate: Value,
    /// The layer of an array.
    pub(super) layer: Option<Value>,
    pub(super) level: SampleLevel,
}

/// A value as such a sample.
pub(super) fn sample(flow: &Flow, value: Value) -> Option<Sample> {
    let Expression::ImageSample {
        image,
        sampler,
        gather: None,
        coordinate,
        array_index: layer,
        offset: None,
        level,
        depth_ref: None,
        clamp_to_edge: false,
    } = flow.function.expressions[value]
    else {
        return None;
    };
    let Expression::GlobalVariable(variable) = flow.function.expressions[image] else {
        return None;
    };
    let ty = flow.module.global_variables[variable].ty;
    let is_plain = matches!(
        flow.module.types[ty].inner,
        TypeInner::Image {
            dim: ImageDimension::D2 | ImageDimension::Cube,
            class: ImageClass::Sampled {
                kind: ScalarKind::Float,
                multi: false,
            },
            ..
        }
    );
    let of_variable = matches!(
        flow.function.expressions[sampler],
        Expression::GlobalVariable(_)
    );
    (is_plain && of_variable).then_some(Sample {
        image,
        sampler,
        coordinate,
        layer,
        level,
    })
}

/// An affine function of the root for each component: what its two coordinates are multiplied by, and what is added.
pub(super) type Rows = Vec<Row>;

/// A number as an affine function of the root: the factors of its two coordinates, and what is added.
type Row = [f32; 3];

/// What a value is, seen from a root.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Of {
    /// Made of constants.
    Constant,
    /// An affine function of the root, or constant numbers.
    Affine(Rows),
    /// Computed of texels and constants.
    Texels {
        /// Whether it is a linear function of the texels.
        linear: bool,
        /// Whether all are read at the root.
        at_root: bool,
    },
    /// Computed of the root and of constants, in any other way.
    Function,
    /// Anything else.
    Unknown,
}

impl Of {
    pub(super) fn is_constant(&self) -> bool {
        match self {
            Self::Constant => true,
            Self::Affine(rows) => rows.iter().all(|[u, v, _]| *u == 0.0 && *v == 0.0),
            _ => false,
        }
    }

    /// That of a function of both; `linear` where it is a linear one.
    fn with(&self, other: &Self, linear: bool) -> Self {
        match (self, other) {
            (a, b) if a.is_constant() && b.is_constant() => Self::Constant,
            (
                Self::Texels {
                    linear: a,
                    at_root: here,
                },
                Self::Texels {
                    linear: b,
                    at_root: there,
                },
            ) => Self::Texels {
                linear: linear && *a && *b,
                at_root: *here && *there,
            },
            (Self::Texels { linear: a, at_root }, one)
            | (one, Self::Texels { linear: a, at_root })
                if one.is_constant() =>
            {
                Self::Texels {
                    linear: linear && *a,
                    at_root: *at_root,
                }
            }
            _ if self.is_of_root() && other.is_of_root() => Self::Function,
            _ => Self::Unknown,
        }
    }

    /// Whether no texture and nothing unknown is in it.
    fn is_of_root(&self) -> bool {
        matches!(self, Self::Constant | Self::Affine(_) | Self::Function)
    }
}

/// What every value of a stage is, seen from a root: in each layer of arrays, where there is a value that chooses one.
pub(super) fn seen_from(flow: &Flow, root: Value, layer: Option<Value>) -> Vec<Of> {
    let function = flow.function;
    let mut locals: Vec<Option<Of>> = vec![None; function.local_variables.len()];
    loop {
        let mut of: Vec<Of> = Vec::with_capacity(function.expressions.len());
        for (value, _) in function.expressions.iter() {
            let seen = match value == root {
                true => at_root(flow, root),
                false => seen(flow, value, (root, layer), &of, &locals),
            };
            of.push(seen);
        }
        let before = locals.clone();
        stores(flow, &function.body, &Of::Constant, &of, &mut locals);
        if locals == before {
            return of;
        }
    }
}

/// What the root is itself.
fn at_root(flow: &Flow, root: Value) -> Of {
    match flow.floats(root) {
        Some(2) => Of::Affine(vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
        _ => Of::Unknown,
    }
}

fn stores(flow: &Flow, block: &Block, around: &Of, of: &[Of], locals: &mut [Option<Of>]) {
    for statement in block {
        let inside = match *statement {
            Statement::Store { pointer, value } => {
                if let Some(local) = flow.local(pointer) {
                    let stored = of[value.index()].with(around, false);
                    let stored = stored.with(&of[pointer.index()], false);
                    let stored = match &locals[local.index()] {
                        Some(before) if *before != stored => before.with(&stored, false),
                        _ => stored,
                    };
                    locals[local.index()] = Some(stored);
                }
                continue;
            }
            Statement::If { condition, .. } => around.with(&of[condition.index()], false),
            Statement::Switch { selector, .. } => around.with(&of[selector.index()], false),
            _ => around.clone(),
        };
        for inner in operands::blocks(statement) {
            stores(flow, inner, &inside, of, locals);
        }
    }
}

/// What a value is, as its operands are.
fn seen(
    flow: &Flow,
    value: Value,
    (root, layer): (Value, Option<Value>),
    of: &[Of],
    locals: &[Option<Of>],
) -> Of {
    let at = |operand: Value| &of[operand.index()];
    let expression = &flow.function.expressions[value];
    if let Some(rows) = rows(flow, value, of) {
        return Of::Affine(rows);
    }
    let all = |linear: bool| {
        let mut sum = Of::Constant;
        operands::each(expression, |operand| sum = sum.with(at(operand), linear));
        sum
    };
    match *expression {
        Expression::Literal(_) | Expression::Constant(_) | Expression::ZeroValue(_) => Of::Constant,
        Expression::GlobalVariable(variable) => {
            match flow.module.global_variables[variable].space {
                AddressSpace::Handle => Of::Constant,
                _ => Of::Unknown,
            }
        }
        Expression::LocalVariable(_) => Of::Constant,
        Expression::Load { pointer } => match flow.local(pointer) {
            Some(local) => locals[local.index()].clone().unwrap_or(Of::Constant),
            None => Of::Unknown,
        },
        Expression::ImageSample { .. } => match sample(flow, value) {
            Some(Sample {
                layer: Some(of), ..
            }) if Some(of) != layer && !at(of).is_constant() => Of::Unknown,
            Some(read) if read.coordinate == root => Of::Texels {
                linear: true,
                at_root: true,
            },
            Some(read) => match at(read.coordinate) {
                Of::Affine(rows) if repeats(rows).is_some() => Of::Texels {
                    linear: true,
                    at_root: false,
                },
                _ => Of::Unknown,
            },
            None => Of::Unknown,
        },
        Expression::Compose { .. }
        | Expression::Splat { .. }
        | Expression::Swizzle { .. }
        | Expression::AccessIndex { .. }
        | Expression::Unary {
            op: UnaryOperator::Negate,
            ..
        } => all(true),
        Expression::Binary { op, left, right } if flow.is_float(value) => match op {
            BinaryOperator::Add | BinaryOperator::Subtract => all(true),
            BinaryOperator::Multiply => all(at(left).is_constant() || at(right).is_constant()),
            BinaryOperator::Divide => all(at(right).is_constant()),
            _ => all(false),
        },
        Expression::Math {
            fun: MathFunction::Mix,
            arg2: Some(share),
            ..
        } => all(at(share).is_constant()),
        Expression::Access { .. }
        | Expression::Unary { .. }
        | Expression::Binary { .. }
        | Expression::Select { .. }
        | Expression::Relational { .. }
        | Expression::Math { .. }
        | Expression::As { .. } => all(false),
        _ => Of::Unknown,
    }
}

/// A float or vector as an affine function of the root, or as constant numbers; `None` where it is no such thing.
fn rows(flow: &Flow, value: Value, of: &[Of]) -> Option<Rows> {
    let count = flow.floats(value)?;
    let at = |operand: Value| match &of[operand.index()] {
        Of::Affine(rows) => Some(rows.clone()),
        _ => None,
    };
    let number = |x: f32| [0.0, 0.0, x];
    let each = |f: &dyn Fn(&Row, &Row) -> Option<Row>, left: Value, right: Value| {
        let (left, right) = (at(left)?, at(right)?);
        let part = |rows: &Rows, i: usize| rows[if rows.len() == 1 { 0 } else { i }];
        (0..count)
            .map(|i| f(&part(&left, i), &part(&right, i)))
            .collect::<Option<Rows>>()
    };
    let rows: Rows = match flow.function.expressions[value] {
        Expression::Literal(Literal::F32(x)) => vec![number(x)],
        Expression::ZeroValue(_) => vec![number(0.0); count],
        Expression::Compose { ref components, .. } => {
            let parts: Option<Vec<Rows>> = components.iter().map(|part| at(*part)).collect();
            parts?.concat()
        }
        Expression::Splat { value, .. } => vec![at(value)?.first().copied()?; count],
        Expression::AccessIndex { base, index } => vec![*at(base)?.get(index as usize)?],
        Expression::Swizzle {
            size,
            vector,
            pattern,
        } => {
            let vector = at(vector)?;
            let pattern = pattern[..size as usize].iter();
            let parts = pattern.map(|component| vector.get(*component as usize).copied());
            parts.collect::<Option<Rows>>()?
        }
        Expression::Unary {
            op: UnaryOperator::Negate,
            expr,
        } => at(expr)?.iter().map(|row| row.map(|x| -x)).collect(),
        Expression::Binary { op, left, right } => match op {
            BinaryOperator::Add => each(&|a, b| Some([0, 1, 2].map(|i| a[i] + b[i])), left, right)?,
            BinaryOperator::Subtract => {
                each(&|a, b| Some([0, 1, 2].map(|i| a[i] - b[i])), left, right)?
            }
            BinaryOperator::Multiply => each(
                &|a, b| match (a, b) {
                    ([0.0, 0.0, scale], row) | (row, [0.0, 0.0, scale]) => {
                        Some(row.map(|x| x * scale))
                    }
                    _ => None,
                },
                left,
                right,
            )?,
            BinaryOperator::Divide => each(
                &|a, b| match b {
                    [0.0, 0.0, scale] if *scale != 0.0 => Some(a.map(|x| x / scale)),
                    _ => None,
                },
                left,
                right,
            )?,
            _ => return None,
        },
        _ => return None,
    };
    let finite = rows.iter().flatten().all(|x| x.is_finite());
    (rows.len() == count && finite).then_some(rows)
}

/// How often a texture that is read at these coordinates repeats along each axis of the root, while that goes from 0 to 1;
/// `None` where that is no whole number of times, or the texture is read along one line alone.
pub(super) fn repeats(rows: &Rows) -> Option<[f32; 2]> {
    let [[a, b, _], [c, d, _]] = rows[..] else {
        return None;
    };
    let whole = |x: f32| (x - x.round()).abs() < WHOLE && x.abs() <= MOST_REPEATS;
    let regular = (a * d - b * c).abs() > 0.5;
    ([a, b, c, d].into_iter().all(whole) && regular).then(|| [a.hypot(c), b.hypot(d)])
}
