//! Constants in a function: what they are, and what follows when a value becomes one.
//!
//! A constant reaches further than its site: operations on nothing but constants are folded here, and
//! by every compiler of the result. Some are errors there (a division by a constant 0, an index beyond
//! the end), though the same operation on a variable is none. [`follow`] finds them beforehand.

use crate::flow::{Flow, Value};
use crate::recipe::Declined;
use crate::semantics::{Constant, Operation, Shape, fold};
use naga::{
    ArraySize, BinaryOperator as Op, Expression, MathFunction as Math, Module, ScalarKind,
    TypeInner,
};
use std::collections::{BTreeMap, BTreeSet};

/// The constant that a value is, when it is made of literals and constants alone.
pub(crate) fn of(flow: &Flow, value: Value) -> Option<Constant> {
    if !flow.is_constant(value) {
        return None;
    }
    let expression = &flow.function.expressions[value];
    computed(flow.module, expression, |operand| of(flow, operand)).ok()?
}

/// The numbers of a constant scalar or vector of f32.
pub(crate) fn numbers(flow: &Flow, value: Value) -> Option<Vec<f32>> {
    flow.floats(value)?;
    let constant = of(flow, value)?;
    Some(constant.words.into_iter().map(f32::from_bits).collect())
}

/// Checks what follows when values become constants of these numbers.
///
/// # Errors
/// When an operation that is constant then would be infinite, undefined or forbidden.
pub(crate) fn follow(flow: &Flow, become_constant: &[(Value, &[f32])]) -> Result<(), Declined> {
    let bits = |numbers: &[f32]| numbers.iter().map(|number| number.to_bits()).collect();
    let become_constant = become_constant.iter();
    follow_words(flow, become_constant.map(|(value, n)| (*value, bits(n))))
}

/// Checks what follows when values become constants of these bits, one word a component.
///
/// # Errors
/// As [`follow`].
pub(crate) fn follow_words(
    flow: &Flow,
    become_constant: impl IntoIterator<Item = (Value, Vec<u32>)>,
) -> Result<(), Declined> {
    let mut known: BTreeMap<Value, Constant> = BTreeMap::new();
    let mut next = BTreeSet::new();
    for (value, words) in become_constant {
        if let Some(shape) = Shape::of(flow.inner(value)) {
            known.insert(value, Constant { shape, words });
            next.extend(flow.users(value));
        }
    }
    // Operands come before users, so that each value is settled when it is met.
    while let Some(value) = next.pop_first() {
        if known.contains_key(&value) {
            continue;
        }
        let expression = &flow.function.expressions[value];
        let get = |operand| known.get(&operand).cloned().or_else(|| of(flow, operand));
        if is_forbidden(flow, expression, get) {
            return Err(Declined("an operation on it would be an error".into()));
        }
        if let Some(constant) = computed(flow.module, expression, get)? {
            known.insert(value, constant);
            next.extend(flow.users(value));
        }
    }
    Ok(())
}

/// The constant that an expression is, when its operands are constants.
///
/// # Errors
/// When the result is infinite or not a number.
fn computed(
    module: &Module,
    expression: &Expression,
    mut get: impl FnMut(Value) -> Option<Constant>,
) -> Result<Option<Constant>, Declined> {
    let shape_of = |ty: naga::Handle<naga::Type>| Shape::of(&module.types[ty].inner);
    let simple = match *expression {
        Expression::Literal(literal) => Constant::from_literal(literal),
        Expression::Constant(constant) => global(module, module.constants[constant].init),
        Expression::ZeroValue(ty) => shape_of(ty).map(|shape| Constant {
            shape,
            words: vec![0; shape.components()],
        }),
        Expression::Compose { ty, ref components } => shape_of(ty).and_then(|shape| {
            let parts: Option<Vec<Constant>> = components.iter().map(|part| get(*part)).collect();
            let words = parts?.into_iter().flat_map(|part| part.words).collect();
            Some(Constant { shape, words })
        }),
        Expression::Splat { size, value } => get(value).map(|part| Constant {
            shape: Shape::Vector(size as usize, part.shape.kind()),
            words: vec![part.words[0]; size as usize],
        }),
        Expression::Swizzle {
            size,
            vector,
            pattern,
        } => get(vector).map(|vector| Constant {
            shape: Shape::Vector(size as usize, vector.shape.kind()),
            words: pattern[..size as usize]
                .iter()
                .map(|c| vector.words[*c as usize])
                .collect(),
        }),
        Expression::AccessIndex { base, index } => get(base).and_then(|base| {
            let (shape, width) = match base.shape {
                Shape::Scalar(_) => return None,
                Shape::Vector(_, kind) => (Shape::Scalar(kind), 1),
                Shape::Matrix { rows, .. } => (Shape::Vector(rows, ScalarKind::Float), rows),
            };
            let start = index as usize * width;
            let words = base.words.get(start..start + width)?.to_vec();
            Some(Constant { shape, words })
        }),
        _ => {
            let Some((operation, operands)) = Operation::of(expression) else {
                return Ok(None);
            };
            let Some(operands) = operands.into_iter().map(get).collect::<Option<Vec<_>>>() else {
                return Ok(None);
            };
            let shapes: Vec<Shape> = operands.iter().map(|operand| operand.shape).collect();
            if operation.result(&shapes).is_none() {
                return Ok(None);
            }
            let folded = fold(operation, &operands);
            return folded.map(Some).ok_or_else(|| {
                Declined("an operation on it would be infinite or undefined".into())
            });
        }
    };
    Ok(simple)
}

/// The constant that a constant expression of the module is.
fn global(module: &Module, value: Value) -> Option<Constant> {
    let expression = &module.global_expressions[value];
    computed(module, expression, |operand| global(module, operand)).ok()?
}

/// Whether an expression is an error for the constants that its operands are, whatever the others are.
fn is_forbidden(
    flow: &Flow,
    expression: &Expression,
    mut get: impl FnMut(Value) -> Option<Constant>,
) -> bool {
    let is_integer = |c: &Constant| matches!(c.shape.kind(), ScalarKind::Sint | ScalarKind::Uint);
    match *expression {
        Expression::Binary {
            op: Op::Divide | Op::Modulo,
            right,
            ..
        } => get(right).is_some_and(|right| is_integer(&right) && right.words.contains(&0)),
        Expression::Binary {
            op: Op::ShiftLeft | Op::ShiftRight,
            right,
            ..
        } => get(right).is_some_and(|right| right.words.iter().any(|bits| *bits >= 32)),
        Expression::Access { base, index } => get(index).is_some_and(|index| {
            let inner = match *flow.inner(base) {
                TypeInner::Pointer { base, .. } => &flow.module.types[base].inner,
                ref inner => inner,
            };
            let size = match *inner {
                TypeInner::Vector { size, .. } => size as u32,
                TypeInner::ValuePointer {
                    size: Some(size), ..
                } => size as u32,
                TypeInner::Matrix { columns, .. } => columns as u32,
                TypeInner::Array {
                    size: ArraySize::Constant(size),
                    ..
                }
                | TypeInner::BindingArray {
                    size: ArraySize::Constant(size),
                    ..
                } => size.get(),
                _ => u32::MAX >> 1,
            };
            // A negative index is a large one.
            index.words[0] >= size
        }),
        Expression::Math {
            fun: Math::Clamp,
            arg1: Some(low),
            arg2: Some(high),
            ..
        } => below(get(high), get(low), false),
        Expression::Math {
            fun: Math::SmoothStep,
            arg,
            arg1: Some(high),
            ..
        } => below(get(high), get(arg), true),
        Expression::Math {
            fun: Math::ExtractBits | Math::InsertBits | Math::Ldexp,
            arg,
            arg1,
            arg2,
            arg3,
        } => {
            // Their ranges depend on each other: no constant but a float may newly reach them.
            [Some(arg), arg1, arg2, arg3]
                .into_iter()
                .flatten()
                .any(|operand| {
                    !flow.is_constant(operand) && get(operand).is_some_and(|c| is_integer(&c))
                })
        }
        _ => false,
    }
}

/// Whether a constant is below another in a component, or equal to it when `or_equal` says so.
fn below(a: Option<Constant>, b: Option<Constant>, or_equal: bool) -> bool {
    let (Some(a), Some(b)) = (a, b) else {
        return false;
    };
    let kind = a.shape.kind();
    a.words.iter().zip(&b.words).any(|(&a, &b)| {
        let less = match kind {
            ScalarKind::Float => f32::from_bits(a) < f32::from_bits(b),
            ScalarKind::Sint => (a as i32) < b as i32,
            _ => a < b,
        };
        less || (or_equal && a == b)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::tests::shader;
    use crate::shader::Stage;

    fn check(body: &str, numbers: &[f32]) -> Result<(), Declined> {
        let shader = shader(&format!(
            "@group(0) @binding(0) var<uniform> table: array<vec4f, 4>;
             @fragment fn main(@location(0) x: f32, @location(1) y: f32) -> @location(0) vec4f {{
                 let site = x * 2.0; {body}
             }}"
        ));
        let (stage, site) = shader.find(&"site".into()).expect("the test names a value");
        let flow = Flow::new(&shader, stage).expect("it has a fragment stage");
        follow(&flow, &[(site, numbers)])
    }

    #[test]
    fn a_hole_that_a_constant_falls_into_is_found_through_what_it_computes() {
        let body = "let d = site - 0.5; return vec4f(y, 1.0 / d, sqrt(site), y / d);";
        assert_eq!(check(body, &[0.75]), Ok(()));
        assert!(check(body, &[0.5]).is_err(), "one over zero");
        assert!(
            check(body, &[-1.0]).is_err(),
            "the root of a negative number"
        );
        let through_a_vector = "let v = vec2f(site, 1.0).xx; return vec4f(normalize(v), y, y);";
        assert_eq!(check(through_a_vector, &[0.5]), Ok(()));
        assert!(check(through_a_vector, &[0.0]).is_err());
        let behind_a_variable = "return vec4f(sqrt(site + y));";
        assert_eq!(check(behind_a_variable, &[-1.0]), Ok(()));
    }

    #[test]
    fn what_compilers_refuse_of_constants_is_found() {
        let index = "return table[u32(site)] * y;";
        assert_eq!(check(index, &[3.0]), Ok(()));
        assert!(check(index, &[4.0]).is_err());
        let integers = "return vec4f(f32(i32(y) % i32(site)));";
        assert_eq!(check(integers, &[2.0]), Ok(()));
        assert!(check(integers, &[0.5]).is_err());
        let shift = "return vec4f(f32(u32(y) << u32(site)));";
        assert_eq!(check(shift, &[31.0]), Ok(()));
        assert!(check(shift, &[32.0]).is_err());
        let limits = "return vec4f(clamp(y, site, 1.0), smoothstep(0.0, site, y), y, y);";
        assert_eq!(check(limits, &[0.5]), Ok(()));
        assert!(check(limits, &[1.5]).is_err());
        assert!(check(limits, &[0.0]).is_err());
    }

    #[test]
    fn the_numbers_of_constants_are_read() {
        let source = "const LIMITS = vec3f(1.0, 2.0, 3.0);
            @fragment fn main(@location(0) x: vec3f) -> @location(0) vec4f {
                let low = max(x, vec3f(0.25)); let high = min(x, LIMITS); let none = min(x, low);
                return vec4f(low + high + none, 1.0);
            }";
        let shader = shader(source);
        let flow = Flow::new(&shader, Stage::Fragment).expect("there is a fragment stage");
        let limit = |name: &str| {
            let (_, value) = shader.find(&name.into()).expect("the test names a value");
            match flow.function.expressions[value] {
                Expression::Math {
                    arg1: Some(limit), ..
                } => numbers(&flow, limit),
                _ => None,
            }
        };
        assert_eq!(limit("low"), Some(vec![0.25; 3]));
        assert_eq!(limit("high"), Some(vec![1.0, 2.0, 3.0]));
        assert_eq!(limit("none"), None);
    }
}
