//! What flows where in one entry point: types, users, and the values that no lossy pass may touch.
//!
//! A [`Flow`] is read off a function once and answers questions about it: who uses a value, whether
//! anything in it varies, what it keeps alive, whether it decides something other than a colour.
//! It changes nothing. Local variables are followed as a whole: whatever is stored in one may come out
//! of any of its loads, so every answer errs on the careful side.

mod decides;
mod dynamic;
mod holes;
mod meaning;

pub(crate) use decides::Decides;
pub(crate) use dynamic::Dynamic;
pub(crate) use holes::Holes;

use crate::operands::{self, User};
use crate::shader::{Shader, Stage, ValueId};
use decides::{LocalStore, Reader};
use naga::{
    Binding, Expression, Function, GlobalVariable, Handle, LocalVariable, Module, Scalar,
    ScalarKind, TypeInner,
};

/// A value of the function that is looked at.
pub(crate) type Value = Handle<Expression>;

/// A stage's entry point, and what flows where in it.
pub(crate) struct Flow<'a> {
    pub(crate) shader: &'a Shader,
    pub(crate) stage: Stage,
    pub(crate) module: &'a Module,
    pub(crate) function: &'a Function,
    findings: &'a Findings,
}

/// What is found out about a function once, and kept with its shader.
#[derive(Debug, Default)]
pub(crate) struct Findings {
    constant: Vec<bool>,
    decides: Vec<Option<Decides>>,
    stores: Vec<LocalStore>,
}

impl Findings {
    /// Reads a stage's entry point.
    pub(crate) fn of(shader: &Shader, stage: Stage) -> Self {
        let Some(function) = shader.function(stage) else {
            return Self::default();
        };
        let (decides, stores) = Reader::read(shader, stage, function);
        Self {
            constant: constant(function),
            decides,
            stores,
        }
    }
}

/// For each value, whether it is made of literals, constants and overrides alone.
fn constant(function: &Function) -> Vec<bool> {
    let mut constant = vec![false; function.expressions.len()];
    for (value, expression) in function.expressions.iter() {
        constant[value.index()] = match expression {
            Expression::Literal(_)
            | Expression::Constant(_)
            | Expression::Override(_)
            | Expression::ZeroValue(_) => true,
            Expression::Load { .. }
            | Expression::ImageSample { .. }
            | Expression::ImageLoad { .. }
            | Expression::ImageQuery { .. } => false,
            _ => {
                let mut any = false;
                let mut all = true;
                operands::each(expression, |operand| {
                    any = true;
                    all &= constant[operand.index()];
                });
                any && all
            }
        };
    }
    constant
}

impl<'a> Flow<'a> {
    /// A stage of a shader; `None` when it lacks the stage.
    pub(crate) fn new(shader: &'a Shader, stage: Stage) -> Option<Self> {
        Some(Self {
            shader,
            stage,
            module: shader.module(),
            function: shader.function(stage)?,
            findings: shader.findings(stage),
        })
    }

    /// The id of a value.
    pub(crate) fn id(&self, value: Value) -> &'a ValueId {
        self.shader.id(self.stage, value)
    }

    /// The type of a value.
    pub(crate) fn inner(&self, value: Value) -> &'a TypeInner {
        self.shader.type_of(self.stage, value)
    }

    /// How many components a scalar or vector of f32 has; `None` for any other type.
    pub(crate) fn floats(&self, value: Value) -> Option<usize> {
        match *self.inner(value) {
            TypeInner::Scalar(Scalar::F32) => Some(1),
            TypeInner::Vector {
                size,
                scalar: Scalar::F32,
            } => Some(size as usize),
            _ => None,
        }
    }

    /// Whether a value is a float, or a vector or matrix of floats.
    pub(crate) fn is_float(&self, value: Value) -> bool {
        is_float(self.inner(value))
    }

    /// The expressions that use a value, each once, in arena order.
    pub(crate) fn users(&self, value: Value) -> impl Iterator<Item = Value> + use<'a> {
        let mut last = None;
        let users = self.shader.users(self.stage, value);
        users.iter().filter_map(move |user| match *user {
            User::Value(user) => (last.replace(user) != Some(user)).then_some(user),
            User::Statement(_) => None,
        })
    }

    /// Whether a statement uses a value: a condition, a store, a return.
    pub(crate) fn is_stated(&self, value: Value) -> bool {
        let users = self.shader.users(self.stage, value);
        matches!(users.last(), Some(User::Statement(_)))
    }

    /// Whether a value is made of literals, constants and overrides alone.
    pub(crate) fn is_constant(&self, value: Value) -> bool {
        self.findings.constant[value.index()]
    }

    /// Whether what is made of these parts joins two that differ and are no constants: made of one part, it says the same as
    /// the part, less plainly.
    pub(crate) fn joins(&self, parts: &[Value]) -> bool {
        let mut parts = parts.iter().filter(|part| !self.is_constant(**part));
        let first = parts.next();
        parts.any(|part| Some(part) != first)
    }

    /// Why a value must stay as it is, when it must.
    pub(crate) fn decides(&self, value: Value) -> Option<Decides> {
        self.findings.decides[value.index()]
    }

    /// The variable that a pointer, image or sampler comes from.
    pub(crate) fn global(&self, mut value: Value) -> Option<Handle<GlobalVariable>> {
        loop {
            match self.function.expressions[value] {
                Expression::GlobalVariable(global) => return Some(global),
                Expression::Access { base, .. } | Expression::AccessIndex { base, .. } => {
                    value = base
                }
                _ => return None,
            }
        }
    }

    /// The local variable that a pointer points into.
    pub(crate) fn local(&self, pointer: Value) -> Option<Handle<LocalVariable>> {
        local(self.function, pointer)
    }

    /// The binding of the entry point's input that a value is, when it is one.
    pub(crate) fn input(&self, value: Value) -> Option<&'a Binding> {
        match self.function.expressions[value] {
            Expression::FunctionArgument(i) => {
                self.function.arguments.get(i as usize)?.binding.as_ref()
            }
            Expression::AccessIndex { base, index } => {
                let Expression::FunctionArgument(i) = self.function.expressions[base] else {
                    return None;
                };
                let argument = self.function.arguments.get(i as usize)?;
                match self.module.types[argument.ty].inner {
                    TypeInner::Struct { ref members, .. } => {
                        members.get(index as usize)?.binding.as_ref()
                    }
                    _ => None,
                }
            }
            _ => None,
        }
    }

    /// For each value, whether anything that differs between fragments is in it: an input, a
    /// derivative or a texture sample, or a local variable, which may hold one.
    pub(crate) fn varying(&self) -> Vec<bool> {
        let mut varying = vec![false; self.function.expressions.len()];
        for (value, expression) in self.function.expressions.iter() {
            varying[value.index()] = match expression {
                Expression::FunctionArgument(_) | Expression::LocalVariable(_) => true,
                _ => {
                    let mut any = false;
                    operands::each(expression, |operand| any |= varying[operand.index()]);
                    any
                }
            };
        }
        varying
    }
}

/// Whether a type is a float, or a vector or matrix of floats.
fn is_float(inner: &TypeInner) -> bool {
    matches!(
        inner.scalar(),
        Some(Scalar {
            kind: ScalarKind::Float,
            ..
        })
    ) && !matches!(inner, TypeInner::Atomic(_) | TypeInner::ValuePointer { .. })
}

/// The local variable that a pointer points into.
fn local(function: &Function, mut pointer: Value) -> Option<Handle<LocalVariable>> {
    loop {
        match function.expressions[pointer] {
            Expression::LocalVariable(local) => return Some(local),
            Expression::Access { base, .. } | Expression::AccessIndex { base, .. } => {
                pointer = base;
            }
            _ => return None,
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A shader as it was parsed, its values named as in the source.
    pub(crate) fn shader(source: &str) -> Shader {
        let module = naga::front::wgsl::parse_str(source).expect("the test's shader parses");
        let function = &module.entry_points[0].function;
        let ids = function.expressions.iter().map(|(value, _)| {
            match function.named_expressions.get(&value) {
                Some(name) => ValueId::new(name.as_str(), 0),
                None => ValueId::new(format!("{}", value.index()), 0),
            }
        });
        let ids = vec![ids.collect()];
        Shader::new(module, ids)
    }
}
