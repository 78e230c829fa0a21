//! Constants: the parts, paths and operations of them, over [`crate::semantics`].

use crate::operands;
use crate::semantics::{self, Constant, Operation, Shape};
use naga::{Arena, Expression, Handle, Module, ScalarKind, SwizzleComponent};

/// The value of an operation on constants; nothing when it has none that a literal can state.
pub(crate) fn operation(expression: &Expression, operands: &[Constant]) -> Option<Constant> {
    if let Expression::As {
        kind,
        convert: Some(width),
        ..
    } = expression
        && *width != if *kind == ScalarKind::Bool { 1 } else { 4 }
    {
        // Half and double precision are not in the table.
        return None;
    }
    semantics::fold(Operation::of(expression)?.0, operands)
}

/// A component of a vector, or a column of a matrix.
pub(crate) fn component(constant: &Constant, index: u32) -> Constant {
    let index = index as usize;
    match constant.shape {
        Shape::Matrix { rows, .. } => Constant {
            shape: Shape::Vector(rows, ScalarKind::Float),
            words: constant.words[index * rows..][..rows].to_vec(),
        },
        shape => Constant {
            shape: Shape::Scalar(shape.kind()),
            words: vec![constant.words[index]],
        },
    }
}

/// A constant expression of the module, if it is a scalar, vector or matrix.
pub(crate) fn module_constant(module: &Module, value: Handle<Expression>) -> Option<Constant> {
    tree(module, &module.global_expressions, value)
}

/// A tree of constants in an arena of the module or of a function, if its value is a scalar, vector or
/// matrix.
pub(crate) fn tree(
    module: &Module,
    arena: &Arena<Expression>,
    value: Handle<Expression>,
) -> Option<Constant> {
    match &arena[value] {
        Expression::Literal(literal) => Constant::from_literal(*literal),
        Expression::Constant(constant) => module_constant(module, module.constants[*constant].init),
        Expression::ZeroValue(ty) => {
            let shape = Shape::of(&module.types[*ty].inner)?;
            Some(Constant {
                shape,
                words: vec![0; shape.components()],
            })
        }
        Expression::Compose { ty, components } => {
            let shape = Shape::of(&module.types[*ty].inner)?;
            let mut words = Vec::with_capacity(shape.components());
            for part in components {
                words.extend(tree(module, arena, *part)?.words);
            }
            Some(Constant { shape, words })
        }
        Expression::Splat { size, value } => {
            let scalar = tree(module, arena, *value)?;
            Some(Constant {
                shape: Shape::Vector(*size as usize, scalar.shape.kind()),
                words: vec![scalar.words[0]; *size as usize],
            })
        }
        Expression::Swizzle {
            size,
            vector,
            pattern,
        } => {
            let vector = tree(module, arena, *vector)?;
            let picked = pattern[..*size as usize].iter();
            Some(Constant {
                shape: Shape::Vector(*size as usize, vector.shape.kind()),
                words: picked
                    .map(|c: &SwizzleComponent| vector.words[*c as usize])
                    .collect(),
            })
        }
        Expression::AccessIndex { base, index } => match tree(module, arena, *base) {
            Some(whole) => Some(component(&whole, *index)),
            None => path(module, arena, *base, *index),
        },
        other => {
            let mut values = Vec::new();
            let mut all = Operation::of(other).is_some();
            operands::each(other, |operand| {
                if all {
                    match tree(module, arena, operand) {
                        Some(value) => values.push(value),
                        None => all = false,
                    }
                }
            });
            all.then(|| operation(other, &values)).flatten()
        }
    }
}

/// The part `index` of `base`, where that leads by constant indices into a constant structure or array.
pub(crate) fn path(
    module: &Module,
    arena: &Arena<Expression>,
    base: Handle<Expression>,
    index: u32,
) -> Option<Constant> {
    let mut indices = vec![index];
    let mut at = base;
    let constant = loop {
        match arena[at] {
            Expression::AccessIndex { base, index } => {
                indices.push(index);
                at = base;
            }
            Expression::Constant(constant) => break constant,
            _ => return None,
        }
    };
    let arena = &module.global_expressions;
    let mut at = module.constants[constant].init;
    while let Some(index) = indices.pop() {
        match &arena[at] {
            Expression::Compose { components, ty }
                if Shape::of(&module.types[*ty].inner).is_none() =>
            {
                at = *components.get(index as usize)?;
            }
            Expression::Constant(inner) => {
                indices.push(index);
                at = module.constants[*inner].init;
            }
            Expression::ZeroValue(ty) => {
                let mut ty = *ty;
                indices.push(index);
                while let Some(index) = indices.pop() {
                    ty = match &module.types[ty].inner {
                        naga::TypeInner::Struct { members, .. } => members.get(index as usize)?.ty,
                        naga::TypeInner::Array { base, .. } => *base,
                        _ => {
                            indices.push(index);
                            break;
                        }
                    };
                }
                let shape = Shape::of(&module.types[ty].inner)?;
                let zero = Constant {
                    shape,
                    words: vec![0; shape.components()],
                };
                let parts = indices.into_iter().rev();
                return Some(parts.fold(zero, |whole, index| component(&whole, index)));
            }
            _ => {
                let whole = tree(module, arena, at)?;
                let part = component(&whole, index);
                let parts = indices.into_iter().rev();
                return Some(parts.fold(part, |whole, index| component(&whole, index)));
            }
        }
    }
    tree(module, arena, at)
}
