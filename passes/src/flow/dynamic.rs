//! Which values depend on what may take any value: uniforms and textures that the scene calls dynamic.

use super::{Flow, Value};
use crate::Facts;
use crate::operands;
use naga::{AddressSpace, Block, Expression, Statement, TypeInner};

/// For each value, what it depends on: a bit for each source, the last one shared by all for which none is left.
pub(crate) struct Dynamic(Vec<u64>);

impl Dynamic {
    /// Reads it off a function.
    pub(crate) fn of(flow: &Flow, facts: &Facts) -> Self {
        let mut sources: Vec<String> = Vec::new();
        let mut own = vec![0; flow.function.expressions.len()];
        for (value, expression) in flow.function.expressions.iter() {
            let source = match *expression {
                Expression::Load { pointer } => flow.dynamic_uniform(pointer, facts),
                Expression::ImageSample { image, .. }
                | Expression::ImageLoad { image, .. }
                | Expression::ImageQuery { image, .. } => flow.dynamic_texture(image, facts),
                _ => None,
            };
            if let Some(source) = source {
                let known = sources.iter().position(|have| *have == source);
                let at = known.unwrap_or_else(|| {
                    sources.push(source);
                    sources.len() - 1
                });
                own[value.index()] = 1 << at.min(63);
            }
        }
        Self(match sources.is_empty() {
            true => own,
            false => flow.spread(&own),
        })
    }

    /// Whether a value depends on something that may take any value.
    pub(crate) fn is(&self, value: Value) -> bool {
        self.0[value.index()] != 0
    }

    /// Whether a value depends on something that another does not depend on.
    pub(crate) fn loses(&self, value: Value, kept: Value) -> bool {
        self.0[value.index()] & !self.0[kept.index()] != 0
    }
}

/// Adds to each local variable what is stored in it, and what decides whether it is.
fn stores(flow: &Flow, block: &Block, around: u64, of: &[u64], locals: &mut [u64]) {
    for statement in block {
        let inside = match *statement {
            Statement::If { condition, .. } => around | of[condition.index()],
            Statement::Switch { selector, .. } => around | of[selector.index()],
            Statement::Store { pointer, value } => {
                if let Some(local) = flow.local(pointer) {
                    locals[local.index()] |= around | of[value.index()] | of[pointer.index()];
                }
                continue;
            }
            _ => around,
        };
        for inner in operands::blocks(statement) {
            stores(flow, inner, inside, of, locals);
        }
    }
}

impl Flow<'_> {
    /// For each value, the bits of all values that it depends on, through local variables and the conditions around
    /// their stores.
    pub(crate) fn spread(&self, own: &[u64]) -> Vec<u64> {
        let mut of = vec![0; own.len()];
        let mut locals = vec![0; self.function.local_variables.len()];
        // What a loop stores reaches the loads above it in another round; bits are only ever added.
        loop {
            for (value, expression) in self.function.expressions.iter() {
                let mut bits = own[value.index()];
                operands::each(expression, |operand| bits |= of[operand.index()]);
                if let Expression::LocalVariable(local) = *expression {
                    bits |= locals[local.index()];
                }
                of[value.index()] = bits;
            }
            let before = locals.clone();
            stores(self, &self.function.body, 0, &of, &mut locals);
            if locals == before {
                return of;
            }
        }
    }

    /// The dynamic uniform that a pointer leads to, or to a part of, or that is a part of what it leads to.
    fn dynamic_uniform(&self, pointer: Value, facts: &Facts) -> Option<String> {
        if facts.dynamic.is_empty() {
            return None;
        }
        let path = self.uniform_path(pointer)?;
        let within = |inner: &str, outer: &str| {
            inner
                .strip_prefix(outer)
                .is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
        };
        let mut dynamic = facts.dynamic.iter();
        dynamic
            .find(|dynamic| within(dynamic, &path) || within(&path, dynamic))
            .cloned()
    }

    /// `lights.items[2].colour`; as far as indices are constant.
    fn uniform_path(&self, pointer: Value) -> Option<String> {
        match self.function.expressions[pointer] {
            Expression::GlobalVariable(global) => {
                let variable = &self.module.global_variables[global];
                let is_buffer = matches!(
                    variable.space,
                    AddressSpace::Uniform | AddressSpace::Storage { .. } | AddressSpace::Immediate
                );
                variable.name.clone().filter(|_| is_buffer)
            }
            Expression::Access { base, .. } => self.uniform_path(base),
            Expression::AccessIndex { base, index } => {
                let path = self.uniform_path(base)?;
                let TypeInner::Pointer { base: ty, .. } = *self.inner(base) else {
                    return Some(path);
                };
                Some(match &self.module.types[ty].inner {
                    TypeInner::Struct { members, .. } => {
                        match members.get(index as usize).and_then(|m| m.name.as_ref()) {
                            // Behind an index that varies, the rest of the way says nothing.
                            Some(name) if !self.is_indexed(base) => format!("{path}.{name}"),
                            _ => path,
                        }
                    }
                    TypeInner::Array { .. } if !self.is_indexed(base) => format!("{path}[{index}]"),
                    _ => path,
                })
            }
            _ => None,
        }
    }

    fn is_indexed(&self, pointer: Value) -> bool {
        match self.function.expressions[pointer] {
            Expression::Access { .. } => true,
            Expression::AccessIndex { base, .. } => self.is_indexed(base),
            _ => false,
        }
    }

    /// The name of a texture that has no image.
    fn dynamic_texture(&self, image: Value, facts: &Facts) -> Option<String> {
        let name = self.module.global_variables[self.global(image)?]
            .name
            .clone()?;
        (!facts.textures.contains_key(&name)).then_some(name)
    }
}
