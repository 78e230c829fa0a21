//! Other languages than WGSL, through naga's writers.

use super::{Target, file_name};
use crate::front::{self, Source};
use crate::{Diagnostic, Result};
use naga::back::{glsl, hlsl, msl, pipeline_constants, spv};
use naga::proc::BoundsCheckPolicies;
use naga::valid::ModuleInfo;
use naga::{AddressSpace, Module, ShaderStage, TypeInner};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;

/// Writes an emitted module in another language: `stem.spv`, `stem.hlsl`, `stem.metal`, or `stem.vert.glsl` and
/// `stem.frag.glsl`, and `stem.comp.glsl` where there is a parameter block. Coordinates and binding numbers are those of the source.
///
/// # Errors
/// When the language, or naga's writer of it, has no form for something in the module.
pub(crate) fn write(
    source: &Source,
    emitted: &Source,
    target: Target,
    stem: &str,
) -> Result<Vec<(PathBuf, Vec<u8>)>> {
    let refused = |reason: String| {
        Diagnostic::error(format!(
            "{} cannot be written as {}: {reason}",
            file_name(source),
            target.name()
        ))
        .with_note("`--target wgsl` writes it as it is")
    };
    let (module, _) = pipeline_constants::process_overrides(&emitted.module, &emitted.info, None, &Default::default())
        .map_err(|e| {
            refused(e.to_string()).with_note(format!(
                "{} has no pipeline constants, so each `override` of the source stands for its default there",
                target.name()
            ))
        })?;
    let stages: Vec<(ShaderStage, &str)> = (emitted
        .vertex
        .as_deref()
        .map(|name| (ShaderStage::Vertex, name)))
    .into_iter()
    .chain([(ShaderStage::Fragment, emitted.fragment.as_str())])
    .chain(parameter_stage(source, emitted).map(|name| (ShaderStage::Compute, name)))
    .collect();
    // The writers panic on what they have no form for, such as an immediate without a place in HLSL.
    let written = catch_unwind(AssertUnwindSafe(|| {
        let module = &only_stages(&module, &stages);
        let info = &front::validate(module).map_err(|e| e.as_inner().to_string())?;
        match target {
            Target::Wgsl => Ok(Vec::new()),
            Target::Spirv => spirv(module, info).map(|bytes| vec![("spv", bytes)]),
            Target::Glsl => stages
                .iter()
                .map(|&(stage, name)| {
                    let extension = match stage {
                        ShaderStage::Vertex => "vert.glsl",
                        ShaderStage::Compute => "comp.glsl",
                        _ => "frag.glsl",
                    };
                    Ok((extension, glsl(module, info, stage, name)?.into_bytes()))
                })
                .collect(),
            Target::Hlsl => hlsl(module, info).map(|text| vec![("hlsl", text.into_bytes())]),
            Target::Msl => metal(module, info).map(|text| vec![("metal", text.into_bytes())]),
        }
    }));
    let files = written
        .unwrap_or_else(|_| Err("naga's writer gave up on it".to_owned()))
        .map_err(refused)?;
    Ok(files
        .into_iter()
        .map(|(extension, bytes)| (format!("{stem}.{extension}").into(), bytes))
        .collect())
}

/// The entry point that fills the parameter block: of those for compute, the one that the source has not.
pub(crate) fn parameter_stage<'a>(source: &Source, emitted: &'a Source) -> Option<&'a str> {
    let names = |of: &'a Module| {
        let entries = of.entry_points.iter();
        let compute = entries.filter(|entry| entry.stage == ShaderStage::Compute);
        compute.map(|entry| entry.name.as_str())
    };
    let authors = &source.module.entry_points;
    names(&emitted.module).find(|name| authors.iter().all(|entry| entry.name != *name))
}

/// The module with the chosen entry points alone.
fn only_stages(module: &Module, stages: &[(ShaderStage, &str)]) -> Module {
    let mut module = module.clone();
    module
        .entry_points
        .retain(|entry| stages.contains(&(entry.stage, entry.name.as_str())));
    naga::compact::compact(&mut module, naga::compact::KeepUnused::No);
    module
}

fn spirv(module: &Module, info: &ModuleInfo) -> std::result::Result<Vec<u8>, String> {
    let options = spv::Options {
        flags: spv::WriterFlags::DEBUG | spv::WriterFlags::LABEL_VARYINGS,
        force_loop_bounding: false,
        ..Default::default()
    };
    let words = spv::write_vec(module, info, &options, None).map_err(|e| e.to_string())?;
    Ok(words.into_iter().flat_map(u32::to_le_bytes).collect())
}

fn glsl(
    module: &Module,
    info: &ModuleInfo,
    stage: ShaderStage,
    name: &str,
) -> std::result::Result<String, String> {
    let options = glsl::Options {
        version: glsl::Version::Desktop(450),
        writer_flags: glsl::WriterFlags::empty(),
        ..Default::default()
    };
    let pipeline = glsl::PipelineOptions {
        shader_stage: stage,
        entry_point: name.to_owned(),
        multiview: None,
    };
    let mut out = String::new();
    glsl::Writer::new(
        &mut out,
        module,
        info,
        &options,
        &pipeline,
        BoundsCheckPolicies::default(),
    )
    .and_then(|mut writer| writer.write())
    .map_err(|e| e.to_string())?;
    Ok(out)
}

fn hlsl(module: &Module, info: &ModuleInfo) -> std::result::Result<String, String> {
    let options = hlsl::Options {
        shader_model: hlsl::ShaderModel::V6_0,
        force_loop_bounding: false,
        ..Default::default()
    };
    let mut out = String::new();
    hlsl::Writer::new(&mut out, &options, &Default::default())
        .write(module, info, None)
        .map_err(|e| e.to_string())?;
    Ok(out)
}

/// Buffers, textures and samplers are numbered from 0 each, in the order of their groups and bindings.
fn metal(module: &Module, info: &ModuleInfo) -> std::result::Result<String, String> {
    let mut bound: Vec<_> = module
        .global_variables
        .iter()
        .filter_map(|(_, variable)| Some((variable.binding?, variable)))
        .collect();
    bound.sort_by_key(|(binding, _)| (binding.group, binding.binding));
    let mut resources = msl::EntryPointResources::default();
    let (mut buffers, mut textures, mut samplers) = (0, 0, 0);
    let next = |count: &mut u8| {
        let slot = *count;
        *count = count.saturating_add(1);
        Some(slot)
    };
    for (binding, variable) in bound {
        let mut target = msl::BindTarget::default();
        match module.types[variable.ty].inner {
            TypeInner::Image { .. } => target.texture = next(&mut textures),
            TypeInner::Sampler { .. } => {
                target.sampler = next(&mut samplers).map(msl::BindSamplerTarget::Resource);
            }
            _ => {
                target.buffer = next(&mut buffers);
                target.mutable = matches!(variable.space, AddressSpace::Storage { access }
                    if access.contains(naga::StorageAccess::STORE));
            }
        }
        resources.resources.insert(binding, target);
    }
    resources.immediates_buffer = next(&mut buffers);
    resources.sizes_buffer = next(&mut buffers);
    let options = msl::Options {
        lang_version: (2, 1),
        per_entry_point_map: module
            .entry_points
            .iter()
            .map(|entry| (entry.name.clone(), resources.clone()))
            .collect(),
        force_loop_bounding: false,
        ..Default::default()
    };
    let (text, info) = msl::write_string(module, info, &options, &Default::default())
        .map_err(|e| e.to_string())?;
    for name in info.entry_point_names {
        name.map_err(|e| e.to_string())?;
    }
    Ok(text)
}
