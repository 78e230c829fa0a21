//! How operations on scalars, vectors and matrices are made of scalar ones.
//!
//! Sums run from the first component to the last: `dot` is `((x + y) + z) + w`, and a matrix times a
//! vector adds its scaled columns in that order.

use super::Op;
use naga::{
    BinaryOperator, Expression, Handle, MathFunction, RelationalFunction, ScalarKind, TypeInner,
    UnaryOperator,
};

/// The shape of a value that an operation takes or gives. All scalars have 32 bits, but for bools.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// One component.
    Scalar(ScalarKind),
    /// Two to four components.
    Vector(usize, ScalarKind),
    /// Columns and rows of floats.
    Matrix {
        /// How many columns.
        columns: usize,
        /// How many rows.
        rows: usize,
    },
}

impl Shape {
    /// The shape of a type; nothing for types of other widths, structures, arrays and opaque ones.
    pub fn of(inner: &TypeInner) -> Option<Self> {
        let width = |scalar: &naga::Scalar| match scalar.kind {
            ScalarKind::Bool => true,
            ScalarKind::Float | ScalarKind::Sint | ScalarKind::Uint => scalar.width == 4,
            ScalarKind::AbstractInt | ScalarKind::AbstractFloat => false,
        };
        match inner {
            TypeInner::Scalar(scalar) if width(scalar) => Some(Self::Scalar(scalar.kind)),
            TypeInner::Vector { size, scalar } if width(scalar) => {
                Some(Self::Vector(*size as usize, scalar.kind))
            }
            TypeInner::Matrix {
                columns,
                rows,
                scalar,
            } if width(scalar) => Some(Self::Matrix {
                columns: *columns as usize,
                rows: *rows as usize,
            }),
            _ => None,
        }
    }

    /// How many components there are.
    pub fn components(self) -> usize {
        match self {
            Self::Scalar(_) => 1,
            Self::Vector(size, _) => size,
            Self::Matrix { columns, rows } => columns * rows,
        }
    }

    /// What the components are.
    pub fn kind(self) -> ScalarKind {
        match self {
            Self::Scalar(kind) | Self::Vector(_, kind) => kind,
            Self::Matrix { .. } => ScalarKind::Float,
        }
    }

    fn with_kind(self, kind: ScalarKind) -> Self {
        match self {
            Self::Scalar(_) => Self::Scalar(kind),
            Self::Vector(size, _) => Self::Vector(size, kind),
            Self::Matrix { .. } => self,
        }
    }
}

/// An operation on values, without its operands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Operation {
    /// An operator before its operand.
    Unary(UnaryOperator),
    /// An operator between its operands.
    Binary(BinaryOperator),
    /// Condition, accepted, rejected.
    Select,
    /// A test.
    Relational(RelationalFunction),
    /// A built-in function.
    Math(MathFunction),
    /// Conversion of the value.
    Convert(ScalarKind),
    /// The same bits as another type.
    Bitcast(ScalarKind),
}

impl Operation {
    /// The operation of an expression, and its operands in the order that [`expand`] takes them.
    /// Nothing for expressions that are not operations on values (loads, samples, composition, ...).
    pub fn of(expression: &Expression) -> Option<(Self, Vec<Handle<Expression>>)> {
        Some(match *expression {
            Expression::Unary { op, expr } => (Self::Unary(op), vec![expr]),
            Expression::Binary { op, left, right } => (Self::Binary(op), vec![left, right]),
            Expression::Select {
                condition,
                accept,
                reject,
            } => (Self::Select, vec![condition, accept, reject]),
            Expression::Relational { fun, argument } => (Self::Relational(fun), vec![argument]),
            Expression::Math {
                fun,
                arg,
                arg1,
                arg2,
                arg3,
            } => {
                let operands = [Some(arg), arg1, arg2, arg3];
                (
                    Self::Math(fun),
                    operands.into_iter().flatten().collect::<Vec<_>>(),
                )
            }
            Expression::As {
                expr,
                kind,
                convert: Some(_),
            } => (Self::Convert(kind), vec![expr]),
            Expression::As {
                expr,
                kind,
                convert: None,
            } => (Self::Bitcast(kind), vec![expr]),
            _ => return None,
        })
    }

    /// The shape of the result, for operands of these shapes; nothing when it is a structure or the
    /// operands do not fit.
    pub fn result(self, operands: &[Shape]) -> Option<Shape> {
        use MathFunction as M;
        let first = *operands.first()?;
        Some(match self {
            Self::Unary(_) => first,
            Self::Binary(op) => match op {
                BinaryOperator::Multiply => product(first, *operands.get(1)?)?,
                BinaryOperator::Equal
                | BinaryOperator::NotEqual
                | BinaryOperator::Less
                | BinaryOperator::LessEqual
                | BinaryOperator::Greater
                | BinaryOperator::GreaterEqual => first.with_kind(ScalarKind::Bool),
                _ => first,
            },
            Self::Select => *operands.get(1)?,
            Self::Relational(RelationalFunction::All | RelationalFunction::Any) => {
                Shape::Scalar(ScalarKind::Bool)
            }
            Self::Relational(_) => first.with_kind(ScalarKind::Bool),
            Self::Convert(kind) | Self::Bitcast(kind) => first.with_kind(kind),
            Self::Math(fun) => match fun {
                M::Dot | M::Distance | M::Length | M::Determinant => Shape::Scalar(first.kind()),
                M::Dot4I8Packed => Shape::Scalar(ScalarKind::Sint),
                M::Dot4U8Packed
                | M::Pack4x8snorm
                | M::Pack4x8unorm
                | M::Pack2x16snorm
                | M::Pack2x16unorm
                | M::Pack2x16float
                | M::Pack4xI8
                | M::Pack4xU8
                | M::Pack4xI8Clamp
                | M::Pack4xU8Clamp => Shape::Scalar(ScalarKind::Uint),
                M::Unpack4x8snorm | M::Unpack4x8unorm => Shape::Vector(4, ScalarKind::Float),
                M::Unpack2x16snorm | M::Unpack2x16unorm | M::Unpack2x16float => {
                    Shape::Vector(2, ScalarKind::Float)
                }
                M::Unpack4xI8 => Shape::Vector(4, ScalarKind::Sint),
                M::Unpack4xU8 => Shape::Vector(4, ScalarKind::Uint),
                M::Modf | M::Frexp => return None,
                M::Transpose => match first {
                    Shape::Matrix { columns, rows } => Shape::Matrix {
                        columns: rows,
                        rows: columns,
                    },
                    _ => return None,
                },
                M::Outer => Shape::Matrix {
                    columns: operands.get(1)?.components(),
                    rows: first.components(),
                },
                _ => first,
            },
        })
    }
}

/// The shape of a product.
fn product(left: Shape, right: Shape) -> Option<Shape> {
    Some(match (left, right) {
        (Shape::Scalar(_), _) => right,
        (_, Shape::Scalar(_)) | (Shape::Vector(..), Shape::Vector(..)) => left,
        (Shape::Matrix { columns, rows }, Shape::Vector(size, kind)) if columns == size => {
            Shape::Vector(rows, kind)
        }
        (Shape::Vector(size, kind), Shape::Matrix { columns, rows }) if rows == size => {
            Shape::Vector(columns, kind)
        }
        (
            Shape::Matrix {
                columns: inner,
                rows,
            },
            Shape::Matrix {
                columns,
                rows: other,
            },
        ) if inner == other => Shape::Matrix { columns, rows },
        _ => return None,
    })
}

/// Something that scalar operations can be done with: constants, or a program that is being written.
pub trait Scalars {
    /// A scalar value.
    type Value: Copy;
    /// A constant word.
    fn word(&mut self, bits: u32) -> Self::Value;
    /// A constant float.
    fn float(&mut self, x: f32) -> Self::Value;
    /// The value of an operation.
    fn apply(&mut self, op: Op, operands: &[Self::Value]) -> Self::Value;
}

/// The components of an operation's result. The structures of `modf` and `frexp` come member by member.
/// Nothing when the operation does not take such operands, or is on types of other widths.
pub fn expand<S: Scalars>(
    s: &mut S,
    operation: Operation,
    operands: &[(Shape, &[S::Value])],
) -> Option<Vec<S::Value>> {
    let &(shape, first) = operands.first()?;
    let kind = shape.kind();
    Some(match operation {
        Operation::Unary(op) => {
            let op = match (op, kind) {
                (UnaryOperator::Negate, ScalarKind::Float) => Op::Neg,
                (UnaryOperator::Negate, _) => Op::NegWord,
                (UnaryOperator::BitwiseNot, _) => Op::Not,
                (UnaryOperator::LogicalNot, _) => {
                    let one = s.word(1);
                    return Some(first.iter().map(|&a| s.apply(Op::Xor, &[a, one])).collect());
                }
            };
            each(s, op, &[first])
        }
        Operation::Binary(op) => binary(s, op, (shape, first), *operands.get(1)?)?,
        Operation::Select => {
            let &(_, accept) = operands.get(1)?;
            let &(_, reject) = operands.get(2)?;
            let op = match operands[1].0.kind() {
                ScalarKind::Float => Op::SelectFloat,
                _ => Op::SelectWord,
            };
            each(s, op, &[first, accept, reject])
        }
        Operation::Relational(fun) => match fun {
            RelationalFunction::All => vec![reduce(s, Op::And, first)],
            RelationalFunction::Any => vec![reduce(s, Op::Or, first)],
            RelationalFunction::IsNan => each(s, Op::IsNan, &[first]),
            RelationalFunction::IsInf => each(s, Op::IsInf, &[first]),
        },
        Operation::Convert(to) => convert(s, kind, to, first)?,
        Operation::Bitcast(to) => match (kind, to) {
            (ScalarKind::Float, ScalarKind::Sint | ScalarKind::Uint) => {
                each(s, Op::FloatToBits, &[first])
            }
            (ScalarKind::Sint | ScalarKind::Uint, ScalarKind::Float) => {
                each(s, Op::BitsToFloat, &[first])
            }
            _ => first.to_vec(),
        },
        Operation::Math(fun) => math(s, fun, operands)?,
    })
}

/// Applies an operation to each component; a single component stands for all.
fn each<S: Scalars>(s: &mut S, op: Op, operands: &[&[S::Value]]) -> Vec<S::Value> {
    let size = operands.iter().map(|o| o.len()).max().unwrap_or(0);
    let mut row = Vec::with_capacity(operands.len());
    (0..size)
        .map(|i| {
            row.clear();
            row.extend(
                operands
                    .iter()
                    .map(|o| if o.len() == 1 { o[0] } else { o[i] }),
            );
            s.apply(op, &row)
        })
        .collect()
}

/// Combines components from the first to the last.
fn reduce<S: Scalars>(s: &mut S, op: Op, values: &[S::Value]) -> S::Value {
    let mut sum = values[0];
    for &value in &values[1..] {
        sum = s.apply(op, &[sum, value]);
    }
    sum
}

fn convert<S: Scalars>(
    s: &mut S,
    from: ScalarKind,
    to: ScalarKind,
    values: &[S::Value],
) -> Option<Vec<S::Value>> {
    use ScalarKind::{Bool, Float, Sint, Uint};
    let op = match (from, to) {
        (Float, Sint) => Op::FloatToInt,
        (Float, Uint) => Op::FloatToUint,
        (Sint, Float) => Op::IntToFloat,
        (Uint | Bool, Float) => Op::UintToFloat,
        (Float, Bool) => {
            let zero = s.float(0.0);
            return Some(each(s, Op::NotEqual, &[values, &[zero]]));
        }
        (Sint | Uint, Bool) => {
            let zero = s.word(0);
            return Some(each(s, Op::NotEqualWord, &[values, &[zero]]));
        }
        (Float, Float) | (Sint | Uint | Bool, Sint | Uint) | (Bool, Bool) => {
            return Some(values.to_vec());
        }
        _ => return None,
    };
    Some(each(s, op, &[values]))
}

fn binary<S: Scalars>(
    s: &mut S,
    op: BinaryOperator,
    (left_shape, left): (Shape, &[S::Value]),
    (right_shape, right): (Shape, &[S::Value]),
) -> Option<Vec<S::Value>> {
    use BinaryOperator as B;
    let float = left_shape.kind() == ScalarKind::Float;
    let signed = left_shape.kind() == ScalarKind::Sint;
    let pick = |on_float: Op, on_int: Op, on_uint: Op| match (float, signed) {
        (true, _) => on_float,
        (_, true) => on_int,
        _ => on_uint,
    };
    Some(match op {
        B::Add => each(s, pick(Op::Add, Op::AddWord, Op::AddWord), &[left, right]),
        B::Subtract => each(s, pick(Op::Sub, Op::SubWord, Op::SubWord), &[left, right]),
        B::Multiply => multiply(s, (left_shape, left), (right_shape, right))?,
        B::Divide => each(s, pick(Op::Div, Op::DivInt, Op::DivUint), &[left, right]),
        B::Modulo => each(s, pick(Op::Rem, Op::RemInt, Op::RemUint), &[left, right]),
        B::Equal => each(
            s,
            pick(Op::Equal, Op::EqualWord, Op::EqualWord),
            &[left, right],
        ),
        B::NotEqual => each(
            s,
            pick(Op::NotEqual, Op::NotEqualWord, Op::NotEqualWord),
            &[left, right],
        ),
        B::Less => each(s, pick(Op::Less, Op::LessInt, Op::LessUint), &[left, right]),
        B::LessEqual => each(
            s,
            pick(Op::LessEqual, Op::LessEqualInt, Op::LessEqualUint),
            &[left, right],
        ),
        B::Greater => each(s, pick(Op::Less, Op::LessInt, Op::LessUint), &[right, left]),
        B::GreaterEqual => each(
            s,
            pick(Op::LessEqual, Op::LessEqualInt, Op::LessEqualUint),
            &[right, left],
        ),
        B::And | B::LogicalAnd => each(s, Op::And, &[left, right]),
        B::InclusiveOr | B::LogicalOr => each(s, Op::Or, &[left, right]),
        B::ExclusiveOr => each(s, Op::Xor, &[left, right]),
        B::ShiftLeft => each(s, Op::ShiftLeft, &[left, right]),
        B::ShiftRight if signed => each(s, Op::ShiftRightInt, &[left, right]),
        B::ShiftRight => each(s, Op::ShiftRightUint, &[left, right]),
    })
}

fn multiply<S: Scalars>(
    s: &mut S,
    (left_shape, left): (Shape, &[S::Value]),
    (right_shape, right): (Shape, &[S::Value]),
) -> Option<Vec<S::Value>> {
    Some(match (left_shape, right_shape) {
        (Shape::Matrix { columns, rows }, Shape::Vector(size, _)) if columns == size => {
            transform(s, left, rows, right)
        }
        (Shape::Vector(size, _), Shape::Matrix { columns, rows }) if rows == size => (0..columns)
            .map(|c| dot(s, Op::Mul, Op::Add, left, &right[c * rows..][..rows]))
            .collect(),
        (
            Shape::Matrix {
                columns: inner,
                rows,
            },
            Shape::Matrix {
                columns,
                rows: other,
            },
        ) if inner == other => (0..columns)
            .flat_map(|c| transform(s, left, rows, &right[c * inner..][..inner]))
            .collect(),
        (Shape::Matrix { .. }, Shape::Matrix { .. } | Shape::Vector(..))
        | (Shape::Vector(..), Shape::Matrix { .. }) => return None,
        _ if left_shape.kind() == ScalarKind::Float => each(s, Op::Mul, &[left, right]),
        _ => each(s, Op::MulWord, &[left, right]),
    })
}

/// A matrix times a vector: its columns, scaled and added in order.
fn transform<S: Scalars>(
    s: &mut S,
    matrix: &[S::Value],
    rows: usize,
    vector: &[S::Value],
) -> Vec<S::Value> {
    (0..rows)
        .map(|row| {
            let mut sum = s.apply(Op::Mul, &[matrix[row], vector[0]]);
            for (c, &v) in vector.iter().enumerate().skip(1) {
                let term = s.apply(Op::Mul, &[matrix[c * rows + row], v]);
                sum = s.apply(Op::Add, &[sum, term]);
            }
            sum
        })
        .collect()
}

fn dot<S: Scalars>(s: &mut S, mul: Op, add: Op, a: &[S::Value], b: &[S::Value]) -> S::Value {
    let terms = each(s, mul, &[a, b]);
    reduce(s, add, &terms)
}

fn float_dot<S: Scalars>(s: &mut S, a: &[S::Value], b: &[S::Value]) -> S::Value {
    dot(s, Op::Mul, Op::Add, a, b)
}

/// The square root of the sum of squares; for a scalar its magnitude.
fn length<S: Scalars>(s: &mut S, a: &[S::Value]) -> S::Value {
    match a {
        [x] => s.apply(Op::Abs, &[*x]),
        _ => {
            let square = float_dot(s, a, a);
            s.apply(Op::Sqrt, &[square])
        }
    }
}

/// `a * b - c * d`.
fn cross_term<S: Scalars>(
    s: &mut S,
    a: S::Value,
    b: S::Value,
    c: S::Value,
    d: S::Value,
) -> S::Value {
    let ab = s.apply(Op::Mul, &[a, b]);
    let cd = s.apply(Op::Mul, &[c, d]);
    s.apply(Op::Sub, &[ab, cd])
}

/// The determinant of the rows and columns that are left, by the first of those columns.
fn minor<S: Scalars>(
    s: &mut S,
    m: &[S::Value],
    size: usize,
    columns: &[usize],
    rows: &[usize],
) -> S::Value {
    let at = |c: usize, r: usize| m[c * size + r];
    match (columns, rows) {
        ([c], [r]) => at(*c, *r),
        ([a, b], [x, y]) => cross_term(s, at(*a, *x), at(*b, *y), at(*b, *x), at(*a, *y)),
        _ => {
            let mut sum = None;
            for (i, &row) in rows.iter().enumerate() {
                let rest: Vec<usize> = rows.iter().copied().filter(|&r| r != row).collect();
                let rest = minor(s, m, size, &columns[1..], &rest);
                let term = s.apply(Op::Mul, &[at(columns[0], row), rest]);
                sum = Some(match sum {
                    None => term,
                    Some(sum) if i % 2 == 1 => s.apply(Op::Sub, &[sum, term]),
                    Some(sum) => s.apply(Op::Add, &[sum, term]),
                });
            }
            sum.unwrap_or_else(|| s.float(1.0))
        }
    }
}

/// The transposed cofactors, divided by the determinant.
fn inverse<S: Scalars>(s: &mut S, m: &[S::Value], size: usize) -> Vec<S::Value> {
    let all: Vec<usize> = (0..size).collect();
    let determinant = minor(s, m, size, &all, &all);
    let one = s.float(1.0);
    let scale = s.apply(Op::Div, &[one, determinant]);
    let mut result = Vec::with_capacity(size * size);
    for c in 0..size {
        for r in 0..size {
            let columns: Vec<usize> = (0..size).filter(|&k| k != r).collect();
            let rows: Vec<usize> = (0..size).filter(|&k| k != c).collect();
            let cofactor = minor(s, m, size, &columns, &rows);
            let cofactor = if (c + r) % 2 == 1 {
                s.apply(Op::Neg, &[cofactor])
            } else {
                cofactor
            };
            result.push(s.apply(Op::Mul, &[cofactor, scale]));
        }
    }
    result
}

/// The bytes of a word as integers.
fn bytes<S: Scalars>(s: &mut S, word: S::Value, signed: bool) -> Vec<S::Value> {
    let op = if signed { Op::ExtractInt } else { Op::Extract };
    fields(s, op, word, 4)
}

/// A word cut into `count` equal fields.
fn fields<S: Scalars>(s: &mut S, op: Op, word: S::Value, count: u32) -> Vec<S::Value> {
    let size = s.word(32 / count);
    (0..count)
        .map(|i| {
            let offset = s.word(i * (32 / count));
            s.apply(op, &[word, offset, size])
        })
        .collect()
}

/// A word put together from the low bits of equal fields.
fn join<S: Scalars>(s: &mut S, values: &[S::Value]) -> S::Value {
    let size = 32 / values.len() as u32;
    let mask = s.word(u32::MAX >> (32 - size));
    let mut word = None;
    for (i, &value) in values.iter().enumerate() {
        let low = s.apply(Op::And, &[value, mask]);
        let shift = s.word(i as u32 * size);
        let placed = s.apply(Op::ShiftLeft, &[low, shift]);
        word = Some(match word {
            None => placed,
            Some(word) => s.apply(Op::Or, &[word, placed]),
        });
    }
    word.unwrap_or_else(|| s.word(0))
}

fn math<S: Scalars>(
    s: &mut S,
    fun: MathFunction,
    operands: &[(Shape, &[S::Value])],
) -> Option<Vec<S::Value>> {
    use MathFunction as M;
    let &(shape, a) = operands.first()?;
    let float = shape.kind() == ScalarKind::Float;
    let signed = shape.kind() == ScalarKind::Sint;
    let pick = |on_float: Op, on_int: Op, on_uint: Op| match (float, signed) {
        (true, _) => on_float,
        (_, true) => on_int,
        _ => on_uint,
    };
    let b = || operands.get(1).map(|o| o.1);
    let c = || operands.get(2).map(|o| o.1);
    let unary = |op: Op| Some((op, vec![a]));
    let componentwise = match fun {
        M::Abs if !float && !signed => return Some(a.to_vec()),
        M::Abs => unary(pick(Op::Abs, Op::AbsInt, Op::AbsInt)),
        M::Min => Some((pick(Op::Min, Op::MinInt, Op::MinUint), vec![a, b()?])),
        M::Max => Some((pick(Op::Max, Op::MaxInt, Op::MaxUint), vec![a, b()?])),
        M::Clamp if float => Some((Op::Clamp, vec![a, b()?, c()?])),
        M::Clamp => {
            let (max, min) = if signed {
                (Op::MaxInt, Op::MinInt)
            } else {
                (Op::MaxUint, Op::MinUint)
            };
            let raised = each(s, max, &[a, b()?]);
            return Some(each(s, min, &[&raised, c()?]));
        }
        M::Saturate => unary(Op::Saturate),
        M::Cos => unary(Op::Cos),
        M::Cosh => unary(Op::Cosh),
        M::Sin => unary(Op::Sin),
        M::Sinh => unary(Op::Sinh),
        M::Tan => unary(Op::Tan),
        M::Tanh => unary(Op::Tanh),
        M::Acos => unary(Op::Acos),
        M::Asin => unary(Op::Asin),
        M::Atan => unary(Op::Atan),
        M::Atan2 => Some((Op::Atan2, vec![a, b()?])),
        M::Asinh => unary(Op::Asinh),
        M::Acosh => unary(Op::Acosh),
        M::Atanh => unary(Op::Atanh),
        M::Ceil => unary(Op::Ceil),
        M::Floor => unary(Op::Floor),
        M::Round => unary(Op::Round),
        M::Fract => unary(Op::Fract),
        M::Trunc => unary(Op::Trunc),
        M::Ldexp => Some((Op::Ldexp, vec![a, b()?])),
        M::Exp => unary(Op::Exp),
        M::Exp2 => unary(Op::Exp2),
        M::Log => unary(Op::Log),
        M::Log2 => unary(Op::Log2),
        M::Pow => Some((Op::Pow, vec![a, b()?])),
        M::Sign if !float && !signed => return None,
        M::Sign => unary(pick(Op::Sign, Op::SignInt, Op::SignInt)),
        M::Fma => Some((Op::Fma, vec![a, b()?, c()?])),
        M::Mix => Some((Op::Mix, vec![a, b()?, c()?])),
        M::Step => Some((Op::Step, vec![a, b()?])),
        M::SmoothStep => Some((Op::SmoothStep, vec![a, b()?, c()?])),
        M::Sqrt => unary(Op::Sqrt),
        M::InverseSqrt => unary(Op::InverseSqrt),
        M::QuantizeToF16 => unary(Op::Quantize),
        M::CountTrailingZeros => unary(Op::CountTrailingZeros),
        M::CountLeadingZeros => unary(Op::CountLeadingZeros),
        M::CountOneBits => unary(Op::CountOnes),
        M::ReverseBits => unary(Op::ReverseBits),
        M::FirstTrailingBit => unary(Op::FirstTrailingBit),
        M::FirstLeadingBit if signed => unary(Op::FirstLeadingBitInt),
        M::FirstLeadingBit => unary(Op::FirstLeadingBit),
        M::ExtractBits if signed => Some((Op::ExtractInt, vec![a, b()?, c()?])),
        M::ExtractBits => Some((Op::Extract, vec![a, b()?, c()?])),
        _ => None,
    };
    if let Some((op, operands)) = componentwise {
        return Some(each(s, op, &operands));
    }
    Some(match fun {
        M::Radians | M::Degrees => {
            let scale = if fun == M::Radians {
                std::f32::consts::PI / 180.0
            } else {
                180.0 / std::f32::consts::PI
            };
            let scale = s.float(scale);
            each(s, Op::Mul, &[a, &[scale]])
        }
        M::Modf => {
            let whole = each(s, Op::Trunc, &[a]);
            let mut parts = each(s, Op::Sub, &[a, &whole]);
            parts.extend(whole);
            parts
        }
        M::Frexp => {
            let mut parts = each(s, Op::FrexpFraction, &[a]);
            parts.extend(each(s, Op::FrexpExponent, &[a]));
            parts
        }
        M::Dot if float => vec![float_dot(s, a, b()?)],
        M::Dot => vec![dot(s, Op::MulWord, Op::AddWord, a, b()?)],
        M::Dot4I8Packed | M::Dot4U8Packed => {
            let signed = fun == M::Dot4I8Packed;
            let left = bytes(s, *a.first()?, signed);
            let right = bytes(s, *b()?.first()?, signed);
            vec![dot(s, Op::MulWord, Op::AddWord, &left, &right)]
        }
        M::Outer => {
            let columns = b()?;
            columns
                .iter()
                .flat_map(|&column| each(s, Op::Mul, &[a, &[column]]))
                .collect()
        }
        M::Cross => {
            let (&[ax, ay, az], &[bx, by, bz]) = (a, b()?) else {
                return None;
            };
            vec![
                cross_term(s, ay, bz, az, by),
                cross_term(s, az, bx, ax, bz),
                cross_term(s, ax, by, ay, bx),
            ]
        }
        M::Distance => {
            let difference = each(s, Op::Sub, &[a, b()?]);
            vec![length(s, &difference)]
        }
        M::Length => vec![length(s, a)],
        M::Normalize => {
            let square = float_dot(s, a, a);
            let scale = s.apply(Op::InverseSqrt, &[square]);
            each(s, Op::Mul, &[a, &[scale]])
        }
        M::FaceForward => {
            let cosine = float_dot(s, b()?, c()?);
            let zero = s.float(0.0);
            let keep = s.apply(Op::Less, &[cosine, zero]);
            let turned = each(s, Op::Neg, &[a]);
            each(s, Op::SelectFloat, &[&[keep], a, &turned])
        }
        M::Reflect => {
            let normal = b()?;
            let cosine = float_dot(s, normal, a);
            let two = s.float(2.0);
            let twice = s.apply(Op::Mul, &[two, cosine]);
            let along = each(s, Op::Mul, &[&[twice], normal]);
            each(s, Op::Sub, &[a, &along])
        }
        M::Refract => {
            let normal = b()?;
            let &eta = c()?.first()?;
            let one = s.float(1.0);
            let zero = s.float(0.0);
            let cosine = float_dot(s, normal, a);
            let squared = s.apply(Op::Mul, &[cosine, cosine]);
            let rest = s.apply(Op::Sub, &[one, squared]);
            let eta_squared = s.apply(Op::Mul, &[eta, eta]);
            let sine = s.apply(Op::Mul, &[eta_squared, rest]);
            let k = s.apply(Op::Sub, &[one, sine]);
            let root = s.apply(Op::Sqrt, &[k]);
            let along = s.apply(Op::Mul, &[eta, cosine]);
            let along = s.apply(Op::Add, &[along, root]);
            let bent = each(s, Op::Mul, &[&[eta], a]);
            let normal = each(s, Op::Mul, &[&[along], normal]);
            let bent = each(s, Op::Sub, &[&bent, &normal]);
            let total = s.apply(Op::Less, &[k, zero]);
            each(s, Op::SelectFloat, &[&[total], &[zero], &bent])
        }
        M::Inverse => match shape {
            Shape::Matrix { columns, rows } if columns == rows => inverse(s, a, rows),
            _ => return None,
        },
        M::Determinant => match shape {
            Shape::Matrix { columns, rows } if columns == rows => {
                let all: Vec<usize> = (0..rows).collect();
                vec![minor(s, a, rows, &all, &all)]
            }
            _ => return None,
        },
        M::Transpose => match shape {
            Shape::Matrix { columns, rows } => (0..rows)
                .flat_map(|r| (0..columns).map(move |c| a[c * rows + r]))
                .collect(),
            _ => return None,
        },
        M::InsertBits => {
            let (&[offset], &[count]) = (c()?, operands.get(3)?.1) else {
                return None;
            };
            let field = s.apply(Op::Field, &[offset, count]);
            let rest = s.apply(Op::Not, &[field]);
            let kept = each(s, Op::And, &[a, &[rest]]);
            let moved = each(s, Op::ShiftLeft, &[b()?, &[offset]]);
            let moved = each(s, Op::And, &[&moved, &[field]]);
            each(s, Op::Or, &[&kept, &moved])
        }
        M::Pack4x8snorm | M::Pack2x16snorm | M::Pack4x8unorm | M::Pack2x16unorm => {
            let (op, scale) = match fun {
                M::Pack4x8snorm => (Op::SignedNorm, 127.0),
                M::Pack2x16snorm => (Op::SignedNorm, 32767.0),
                M::Pack4x8unorm => (Op::UnsignedNorm, 255.0),
                _ => (Op::UnsignedNorm, 65535.0),
            };
            let scale = s.float(scale);
            let parts = each(s, op, &[a, &[scale]]);
            vec![join(s, &parts)]
        }
        M::Pack2x16float => {
            let parts = each(s, Op::FloatToHalf, &[a]);
            vec![join(s, &parts)]
        }
        M::Pack4xI8 | M::Pack4xU8 => vec![join(s, a)],
        M::Pack4xI8Clamp => {
            let (low, high) = (s.word(-128i32 as u32), s.word(127));
            let raised = each(s, Op::MaxInt, &[a, &[low]]);
            let clamped = each(s, Op::MinInt, &[&raised, &[high]]);
            vec![join(s, &clamped)]
        }
        M::Pack4xU8Clamp => {
            let high = s.word(255);
            let clamped = each(s, Op::MinUint, &[a, &[high]]);
            vec![join(s, &clamped)]
        }
        M::Unpack4xI8 => bytes(s, *a.first()?, true),
        M::Unpack4xU8 => bytes(s, *a.first()?, false),
        M::Unpack4x8snorm | M::Unpack2x16snorm => {
            let (count, scale) = if fun == M::Unpack4x8snorm {
                (4, 127.0)
            } else {
                (2, 32767.0)
            };
            let parts = fields(s, Op::ExtractInt, *a.first()?, count);
            let parts = each(s, Op::IntToFloat, &[&parts]);
            let (scale, low) = (s.float(scale), s.float(-1.0));
            let parts = each(s, Op::Div, &[&parts, &[scale]]);
            each(s, Op::Max, &[&parts, &[low]])
        }
        M::Unpack4x8unorm | M::Unpack2x16unorm => {
            let (count, scale) = if fun == M::Unpack4x8unorm {
                (4, 255.0)
            } else {
                (2, 65535.0)
            };
            let parts = fields(s, Op::Extract, *a.first()?, count);
            let parts = each(s, Op::UintToFloat, &[&parts]);
            let scale = s.float(scale);
            each(s, Op::Div, &[&parts, &[scale]])
        }
        M::Unpack2x16float => {
            let parts = fields(s, Op::Extract, *a.first()?, 2);
            each(s, Op::HalfToFloat, &[&parts])
        }
        _ => return None,
    })
}
