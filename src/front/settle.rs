//! Names of a module that did not come from one WGSL text, made names of WGSL.
//!
//! Other languages have other keywords, and names that WGSL has no place for: overloaded functions, blocks
//! without an instance. A module that was composed of several has names of several. Once they are settled, the
//! names that a person, a lock or a scene uses are those of the WGSL that is written in the end.

use super::identifiers::Names;
use naga::{Handle, Module, ShaderStage, Type, TypeInner};
use std::collections::{BTreeMap, BTreeSet};

/// Gives everything at module scope that WGSL writes a name of its own, the one that it has where that can be:
/// first what the host knows, then the rest. Members of structs, too.
pub(super) fn settle(module: &mut Module) {
    let mut names = Names::default();
    for (_, setting) in module.overrides.iter_mut() {
        let wish = setting.name.as_deref().unwrap_or("setting");
        setting.name = Some(names.take(wish));
    }
    for entry in &mut module.entry_points {
        entry.name = names.take(&entry.name);
    }
    let blocks: BTreeMap<Handle<Type>, Option<String>> = structs(module);
    for (_, variable) in module.global_variables.iter_mut() {
        // The host knows a block without an instance by the block's name.
        let block = blocks.get(&variable.ty).cloned().flatten();
        if variable.binding.is_some() {
            let wish = variable.name.take().or(block);
            variable.name = Some(names.take(wish.as_deref().unwrap_or("binding")));
        }
    }
    let results: BTreeMap<Handle<Type>, ShaderStage> = module
        .entry_points
        .iter()
        .filter_map(|entry| Some((entry.function.result.as_ref()?.ty, entry.stage)))
        .collect();
    // Types are a set: none may be, on the way, what another one is.
    for (number, handle) in blocks.keys().enumerate() {
        let name = Some(format!("{number}"));
        let inner = module.types[*handle].inner.clone();
        module.types.replace(*handle, Type { name, inner });
    }
    for (handle, name) in blocks {
        let wish = match (name, results.get(&handle)) {
            (Some(name), _) if names.is_free(&name) => name,
            (Some(name), _) => format!("{name}_block"),
            (None, Some(ShaderStage::Vertex)) => "VertexOutput".to_owned(),
            (None, Some(ShaderStage::Fragment)) => "FragmentOutput".to_owned(),
            (None, _) => "Block".to_owned(),
        };
        let mut ty = module.types[handle].clone();
        ty.name = Some(names.take(&wish));
        if let TypeInner::Struct { members, .. } = &mut ty.inner {
            let mut used = Names::default();
            for member in members {
                let wish = member.name.as_deref().unwrap_or("member");
                member.name = Some(used.take_member(wish));
            }
        }
        module.types.replace(handle, ty);
    }
    for (_, constant) in module.constants.iter_mut() {
        if let Some(name) = &mut constant.name {
            *name = names.take(name);
        }
    }
    for (_, variable) in module.global_variables.iter_mut() {
        if variable.binding.is_none() {
            let wish = variable.name.as_deref().unwrap_or("state");
            variable.name = Some(names.take(wish));
        }
    }
    for (_, function) in module.functions.iter_mut() {
        if let Some(name) = &mut function.name {
            *name = names.take(name);
        }
    }
}

/// The structs that WGSL declares by itself, which nobody may write or rename.
pub(crate) fn predeclared(module: &Module) -> BTreeSet<Handle<Type>> {
    let special = &module.special_types;
    let types = special.predeclared_types.values().copied();
    types
        .chain(special.external_texture_params)
        .chain(special.external_texture_transfer_function)
        .collect()
}

/// The structs of a module that WGSL writes, with their names.
fn structs(module: &Module) -> BTreeMap<Handle<Type>, Option<String>> {
    let predeclared = predeclared(module);
    module
        .types
        .iter()
        .filter(|(_, ty)| matches!(ty.inner, TypeInner::Struct { .. }))
        .filter(|(handle, _)| !predeclared.contains(handle))
        .map(|(handle, ty)| (handle, ty.name.clone()))
        .collect()
}
