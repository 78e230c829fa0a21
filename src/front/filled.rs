//! Uniforms that a text fills itself: the blocks of parameters of what lodc emitted, which a compute entry point stores.
//!
//! What is drawn with such a text runs that entry point first, so that a scene need not say what is in the block.

use super::Source;
use naga::valid::GlobalUse;
use naga::{AddressSpace, GlobalVariable, Handle, ShaderStage, StorageAccess};

/// What the names of such entry points, and of the types of such blocks, begin with.
const NAMES: (&str, &str) = ("lod_parameters", "LodParameters");

/// A uniform that is filled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Filled {
    /// The place of the entry point that fills it.
    pub(crate) entry: usize,
    /// The buffer that the entry point stores to.
    pub(crate) stored: Handle<GlobalVariable>,
    /// The uniform that the other stages read.
    pub(crate) read: Handle<GlobalVariable>,
}

impl Source {
    /// The uniforms that the text fills, in the order of the entry points that do.
    pub(crate) fn filled(&self) -> Vec<Filled> {
        let module = &self.module;
        let points = module.entry_points.iter().enumerate();
        let points = points.filter(|(_, point)| {
            point.stage == ShaderStage::Compute
                && point.name.starts_with(NAMES.0)
                && point.workgroup_size == [1; 3]
                && point.function.arguments.is_empty()
        });
        let all = points.filter_map(|(entry, _)| {
            let uses = self.info.get_entry_point(entry);
            let mut variables = module.global_variables.iter();
            let (stored, buffer) = variables.find(|(variable, declared)| {
                let name = module.types[declared.ty].name.as_deref();
                name.is_some_and(|name| name.starts_with(NAMES.1))
                    && matches!(declared.space, AddressSpace::Storage { access }
                        if access.contains(StorageAccess::STORE))
                    && uses[*variable].contains(GlobalUse::WRITE)
            })?;
            let mut variables = module.global_variables.iter();
            let (read, _) = variables.find(|(_, declared)| {
                declared.ty == buffer.ty && declared.space == AddressSpace::Uniform
            })?;
            Some(Filled {
                entry,
                stored,
                read,
            })
        });
        all.collect()
    }
}
