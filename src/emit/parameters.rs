//! The parameter block of a text with several levels: what any of them has computed once a draw.
//!
//! Members that two levels compute alike are one member. The entry point that fills the block does what the levels need
//! one after the other, so that one dispatch serves a draw of any level.

use super::body::Hidden;
use super::control::free_binding;
use super::level::parameter_function;
use super::splice::Behind;
use super::{EmitLevel, number};
use crate::Result;
use crate::front::identifiers::{Names, in_words};
use lodc_passes::Fingerprint;
use naga::proc::Layouter;
use naga::{
    Expression, Function, GlobalVariable, Handle, Module, ResourceBinding, Span, StructMember,
    Type, TypeInner,
};
use std::collections::BTreeSet;
use std::fmt::Write;

/// The block.
pub(crate) struct Block {
    /// The name of its type.
    pub(crate) ty: String,
    /// The uniform that the stages read.
    pub(crate) read: String,
    /// The buffer that the entry point stores to.
    pub(crate) stored: String,
    /// The entry point.
    entry: String,
    /// Where the uniform is bound; the buffer is behind it.
    binding: (u32, u32),
    members: Vec<Member>,
    /// For each level the place in `members` of each of its own.
    of_levels: Vec<Vec<usize>>,
}

/// A member of the block.
struct Member {
    name: String,
    ty: TypeInner,
    /// What computes it.
    computed: Fingerprint,
    /// The first level that has it, and its place there.
    first: (usize, usize),
}

impl Block {
    /// That of the levels of a module, if one of them has one. `taken` is how many bindings are behind the module's last
    /// one already.
    pub(crate) fn of(
        levels: &[EmitLevel],
        (module, taken): (&Module, u32),
        names: &mut Names,
    ) -> Option<Self> {
        let mut members: Vec<Member> = Vec::new();
        let mut of_levels = Vec::new();
        let mut called = Names::default();
        for (at, level) in levels.iter().enumerate() {
            let shader = &level.shader;
            let own = shader
                .parameters()
                .iter()
                .zip(shader.parameter_fingerprints());
            let mut places = Vec::new();
            for (place, (member, computed)) in own.enumerate() {
                let found = members.iter().position(|have| have.computed == computed);
                places.push(found.unwrap_or_else(|| {
                    let wish = member.name.as_deref().unwrap_or("parameter");
                    members.push(Member {
                        name: called.take_local(wish, &BTreeSet::new()),
                        ty: shader.module().types[member.ty].inner.clone(),
                        computed,
                        first: (at, place),
                    });
                    members.len() - 1
                }));
            }
            of_levels.push(places);
        }
        if members.is_empty() {
            return None;
        }
        let (group, binding) = free_binding(module);
        Some(Self {
            ty: names.take("LodParameters"),
            read: names.take("parameters"),
            stored: names.take("parameters_stored"),
            entry: names.take("lod_parameters"),
            binding: (group, binding + taken),
            members,
            of_levels,
        })
    }

    /// The names that it has at module scope, its entry point's apart.
    pub(crate) fn names(&self) -> [&str; 3] {
        [&self.ty, &self.read, &self.stored]
    }

    /// Makes a function of a level, the one at this place in the list, read or store this block instead of its own.
    pub(crate) fn put_into(
        &self,
        (at, level): (usize, &EmitLevel),
        module: &mut Module,
        function: &mut Function,
    ) {
        let (Some(block), Some(ty)) = (level.shader.parameter_block(), self.type_in(module)) else {
            return;
        };
        // The level's own is of no use any more, and those that it had on the way are not either; all have the same name.
        let called = module.types[block.ty].name.clone();
        let others: Vec<Handle<Type>> = module
            .types
            .iter()
            .filter(|(other, have)| *other != ty && (have.name == called || *other == block.ty))
            .map(|(other, _)| other)
            .collect();
        for (number, other) in others.into_iter().enumerate() {
            let inner = module.types[other].inner.clone();
            let name = Some(format!("{}_of_level_{number}", self.ty));
            module.types.replace(other, Type { name, inner });
        }
        let (group, binding) = self.binding;
        let variables = [
            (block.read, &self.read, binding),
            (block.stored, &self.stored, binding + 1),
        ];
        for (variable, name, binding) in variables {
            let GlobalVariable {
                name: called,
                ty: of,
                binding: bound,
                ..
            } = &mut module.global_variables[variable];
            *called = Some(name.clone());
            *of = ty;
            *bound = Some(ResourceBinding { group, binding });
        }
        let is_block: Vec<bool> = function
            .expressions
            .iter()
            .map(|(_, expression)| match expression {
                Expression::GlobalVariable(v) => *v == block.read || *v == block.stored,
                _ => false,
            })
            .collect();
        for (_, expression) in function.expressions.iter_mut() {
            if let Expression::AccessIndex { base, index } = expression
                && is_block[base.index()]
                && let Some(place) = self.of_levels[at].get(*index as usize)
            {
                *index = *place as u32;
            }
        }
    }

    fn type_in(&self, module: &mut Module) -> Option<Handle<Type>> {
        let mut members = Vec::new();
        for member in &self.members {
            let ty = Type {
                name: None,
                inner: member.ty.clone(),
            };
            members.push(StructMember {
                name: Some(member.name.clone()),
                ty: module.types.insert(ty, Span::UNDEFINED),
                binding: None,
                offset: 0,
            });
        }
        let mut layouter = Layouter::default();
        layouter.update(module.to_ctx()).ok()?;
        let (mut end, mut widest) = (0, naga::proc::Alignment::ONE);
        for member in &mut members {
            let layout = layouter[member.ty];
            member.offset = layout.alignment.round_up(end);
            end = member.offset + layout.size;
            widest = widest.max(layout.alignment);
        }
        let span = widest.round_up(end);
        let ty = Type {
            name: Some(self.ty.clone()),
            inner: TypeInner::Struct { members, span },
        };
        Some(module.types.insert(ty, Span::UNDEFINED))
    }

    /// Its declarations and its entry point, with a function for each level that adds to it.
    pub(crate) fn written(
        &self,
        levels: &[EmitLevel],
        behind: &mut Behind<'_, '_>,
    ) -> Result<std::result::Result<String, Hidden>> {
        let mut functions = Vec::new();
        let mut declared = String::new();
        let mut calls = String::new();
        for (at, level) in levels.iter().enumerate() {
            let own: Vec<usize> = self
                .members
                .iter()
                .filter(|member| member.first.0 == at)
                .map(|member| member.first.1)
                .collect();
            if own.is_empty() {
                continue;
            }
            let name = format!("lod_{}_parameters", in_words(number(levels, at + 1)));
            let name = behind.names.take(&name);
            let level = (at, level);
            let printed = parameter_function(behind.body, level, &own, &name, self, &behind.names)?;
            match behind.take(&printed, &name) {
                Ok(function) => functions.push(function),
                Err(hidden) => return Ok(Err(hidden)),
            }
            writeln!(calls, "    {name}();").ok();
            if let Some(item) = printed.items.iter().find(|item| item.name == self.ty) {
                declared.clone_from(&item.text);
            }
        }
        let (group, binding) = self.binding;
        let [ty, read, stored] = self.names();
        let mut out = format!(
            "\n// What is computed once a draw: by this entry point, or by the host.\n{declared}\
             @group({group}) @binding({binding}) var<uniform> {read}: {ty};\n\
             @group({group}) @binding({}) var<storage, read_write> {stored}: {ty};\n\n\
             @compute @workgroup_size(1)\nfn {}() {{\n{calls}}}\n",
            binding + 1,
            self.entry,
        );
        for function in functions {
            write!(out, "\n{function}").ok();
        }
        Ok(Ok(out))
    }
}
