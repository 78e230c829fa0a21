//! What a host binds to an emitted shader, and which level reads it, as Rust.

use crate::emit::rust::Buffers;
use crate::emit::{EmitLevel, targets};
use crate::front::Source;
use lodc_passes::{Shader, Stage};
use naga::proc::Layouter;
use naga::{
    AddressSpace, GlobalVariable, Handle, ImageClass, ImageDimension, Module, ResourceBinding,
    ScalarKind, StorageAccess, TypeInner,
};
use std::collections::BTreeSet;
use std::fmt::Write;

/// The types that the text uses.
pub(super) const TYPES: &str = r#"
/// Something that a host binds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Binding {
    /// The variable's name.
    pub name: &'static str,
    /// Its group.
    pub group: u32,
    /// Its binding in the group.
    pub binding: u32,
    /// What it is.
    pub kind: Kind,
    /// Whether the vertex stage reads it.
    pub vertex: bool,
    /// Whether the fragment stage does.
    pub fragment: bool,
    /// Whether the compute entry point does that fills the parameter block.
    pub compute: bool,
    /// Whether the levels brought it: the author's shader does not declare it.
    pub of_levels: bool,
}

/// What a binding is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// A uniform buffer.
    Uniform(Buffer),
    /// A storage buffer that is only read.
    Storage(Buffer),
    /// A storage buffer that is written.
    WritableStorage(Buffer),
    /// A texture that is sampled or loaded from.
    Texture { dimension: Dimension, texels: Texels, is_multisampled: bool },
    /// A texture that texels are stored to.
    StorageTexture { dimension: Dimension },
    /// A sampler.
    Sampler { is_comparison: bool },
    /// Something else, such as an acceleration structure or an array of bindings.
    Other,
}

/// What a buffer holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Buffer {
    /// Its size in bytes; of one that ends in an array whose length it tells itself, with one element.
    pub size: u32,
    /// Its type in `buffers`, those of its level where each has a file of its own, or `[T]` of an array whose length it tells itself; empty when Rust has none.
    pub ty: &'static str,
    /// Its members, when it is a structure.
    pub members: &'static [Member],
}

/// A member of a buffer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Member {
    /// Its name.
    pub name: &'static str,
    /// Where it begins, in bytes.
    pub offset: u32,
    /// Its size in bytes, 0 of an array whose length only the buffer tells.
    pub size: u32,
}

/// The shape of a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Dimension { D1, D2, D2Array, Cube, CubeArray, D3 }

/// What the texels of a texture are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Texels { Float, Sint, Uint, Depth }
"#;

/// A binding of the texts, and what tells it apart.
struct Bound {
    at: (u32, u32),
    name: String,
    text: String,
    is_texture: bool,
}

/// The bindings of emitted texts as Rust, and for each level the places of those that it reads.
pub(super) struct Bindings {
    bound: Vec<Bound>,
    /// The bindings of the parameter block, and of the buffer that it is stored to.
    parameters: BTreeSet<(u32, u32)>,
    /// The binding of an autoLOD that is in a buffer.
    autolod: Option<(u32, u32)>,
}

impl Bindings {
    /// Those that `texts` declare, which were made from `source`; `buffers` are those of each text, where they are written.
    pub(super) fn of(
        source: &Source,
        texts: &[Source],
        buffers: &[Option<Buffers>],
        autolod: Option<(u32, u32)>,
    ) -> Self {
        let mut found = Self {
            bound: Vec::new(),
            parameters: BTreeSet::new(),
            autolod,
        };
        let authors: BTreeSet<(u32, u32)> = bound(&source.module).map(|(_, at)| at).collect();
        for (text, buffers) in texts.iter().zip(buffers) {
            let stage = targets::parameter_stage(source, text);
            for (handle, at) in bound(&text.module) {
                let variable = &text.module.global_variables[handle];
                let reads = |name: Option<&str>| {
                    let entries = text.module.entry_points.iter();
                    let mut at = entries.enumerate().filter(|(_, e)| Some(&*e.name) == name);
                    at.any(|(at, _)| !text.info.get_entry_point(at)[handle].is_empty())
                };
                let compute = stage.is_some() && reads(stage);
                let name = variable.name.clone().unwrap_or_default();
                let ty = buffers.as_ref().and_then(|of| of.types.get(&handle));
                let kind = kind(&text.module, handle, ty.map_or("", String::as_str));
                let line = format!(
                    "Binding {{ name: {name:?}, group: {}, binding: {}, kind: {kind}, vertex: {}, fragment: {}, compute: {compute}, of_levels: {} }}",
                    at.0,
                    at.1,
                    reads(text.vertex.as_deref()),
                    reads(Some(&text.fragment)),
                    !authors.contains(&at)
                );
                let is_texture = matches!(
                    text.module.types[variable.ty].inner,
                    TypeInner::Image { .. }
                );
                if compute && !authors.contains(&at) {
                    found.parameters.insert(at);
                    let same = |(other, _): &(Handle<GlobalVariable>, _)| {
                        let other = &text.module.global_variables[*other];
                        other.ty == variable.ty && other.space == AddressSpace::Uniform
                    };
                    let read = bound(&text.module).find(same);
                    found.parameters.extend(read.map(|(_, at)| at));
                }
                let known = found.bound.iter();
                if known
                    .filter(|have| have.at == at)
                    .all(|have| have.name != name)
                {
                    found.bound.push(Bound {
                        at,
                        name,
                        text: line,
                        is_texture,
                    });
                }
            }
        }
        found
            .bound
            .sort_by(|a, b| (a.at, &a.name).cmp(&(b.at, &b.name)));
        found
    }

    /// All of them, a line each.
    pub(super) fn written(&self) -> String {
        let lines = self.bound.iter();
        lines.fold(String::new(), |mut out, bound| {
            writeln!(out, "    {},", bound.text).ok();
            out
        })
    }

    /// The places of those that a level reads.
    pub(super) fn of_level(&self, shader: &Shader) -> Vec<usize> {
        let module = shader.module();
        let stages = [Stage::Vertex, Stage::Fragment].into_iter();
        let functions = stages.filter_map(|stage| shader.function(stage));
        let mut read: BTreeSet<(u32, u32)> = functions
            .flat_map(|function| function.expressions.iter())
            .filter_map(|(_, expression)| match expression {
                naga::Expression::GlobalVariable(variable) => {
                    module.global_variables[*variable].binding
                }
                _ => None,
            })
            .map(|binding| (binding.group, binding.binding))
            .collect();
        if let Some(block) = shader.parameter_block() {
            // Where the block of all levels is, the text says.
            let own = module.global_variables[block.read].binding;
            read.retain(|at| Some(*at) != own.map(|own| (own.group, own.binding)));
            read.extend(&self.parameters);
        }
        read.extend(self.autolod);
        let names: BTreeSet<&str> = (module.global_variables.iter())
            .filter_map(|(_, variable)| variable.name.as_deref())
            .collect();
        let several = |bound: &Bound| {
            let same = self.bound.iter().filter(|other| other.at == bound.at);
            same.count() > 1
        };
        let bound = self.bound.iter().enumerate();
        let read = bound.filter(|(_, bound)| {
            read.contains(&bound.at) && (!several(bound) || names.contains(&*bound.name))
        });
        read.map(|(at, _)| at).collect()
    }

    /// The names of the textures among some of them.
    pub(super) fn textures(&self, places: &[usize]) -> Vec<&str> {
        let bound = places.iter().map(|at| &self.bound[*at]);
        let textures = bound.filter(|bound| bound.is_texture);
        textures.map(|bound| &*bound.name).collect()
    }
}

/// The shader of each level, the first of which is what runs nearest.
pub(super) fn shaders<'a>(base: &'a Shader, levels: &'a [EmitLevel]) -> Vec<&'a Shader> {
    let replaced = levels.first().is_some_and(|level| level.autolod == 0.0);
    let base = (!replaced).then_some(base);
    base.into_iter()
        .chain(levels.iter().map(|level| &level.shader))
        .collect()
}

/// The variables of a module that are bound.
fn bound(module: &Module) -> impl Iterator<Item = (Handle<GlobalVariable>, (u32, u32))> + '_ {
    let variables = module.global_variables.iter();
    variables.filter_map(|(handle, variable)| {
        let ResourceBinding { group, binding } = variable.binding?;
        Some((handle, (group, binding)))
    })
}

/// What a variable is, as Rust. `ty` is the type of a buffer.
fn kind(module: &Module, handle: Handle<GlobalVariable>, ty: &str) -> String {
    let variable = &module.global_variables[handle];
    let buffer = || buffer(module, variable.ty, ty);
    match (&variable.space, &module.types[variable.ty].inner) {
        (AddressSpace::Uniform, _) => format!("Kind::Uniform({})", buffer()),
        (AddressSpace::Storage { access }, _) => {
            let writable = match access.contains(StorageAccess::STORE) {
                true => "Writable",
                false => "",
            };
            format!("Kind::{writable}Storage({})", buffer())
        }
        (_, TypeInner::Sampler { comparison }) => {
            format!("Kind::Sampler {{ is_comparison: {comparison} }}")
        }
        (
            _,
            TypeInner::Image {
                dim,
                arrayed,
                class,
            },
        ) => {
            let dimension = match (dim, arrayed) {
                (ImageDimension::D1, _) => "D1",
                (ImageDimension::D2, false) => "D2",
                (ImageDimension::D2, true) => "D2Array",
                (ImageDimension::Cube, false) => "Cube",
                (ImageDimension::Cube, true) => "CubeArray",
                (ImageDimension::D3, _) => "D3",
            };
            let (texels, multi) = match class {
                ImageClass::Depth { multi } => ("Depth", *multi),
                ImageClass::Sampled { kind, multi } => match kind {
                    ScalarKind::Sint => ("Sint", *multi),
                    ScalarKind::Uint => ("Uint", *multi),
                    _ => ("Float", *multi),
                },
                ImageClass::Storage { .. } => {
                    return format!("Kind::StorageTexture {{ dimension: Dimension::{dimension} }}");
                }
                ImageClass::External => return "Kind::Other".to_owned(),
            };
            format!(
                "Kind::Texture {{ dimension: Dimension::{dimension}, texels: Texels::{texels}, is_multisampled: {multi} }}"
            )
        }
        _ => "Kind::Other".to_owned(),
    }
}

/// What a buffer holds, as Rust.
fn buffer(module: &Module, of: Handle<naga::Type>, ty: &str) -> String {
    let mut layouts = Layouter::default();
    // A valid module has layouts.
    let known = layouts.update(module.to_ctx()).is_ok();
    let size = |of: Handle<naga::Type>| if known { layouts[of].size } else { 0 };
    let is_open = |of: Handle<naga::Type>| {
        let inner = &module.types[of].inner;
        matches!(
            inner,
            TypeInner::Array {
                size: naga::ArraySize::Dynamic,
                ..
            }
        )
    };
    let members = match &module.types[of].inner {
        TypeInner::Struct { members, .. } => &members[..],
        _ => &[],
    };
    let members = members.iter().map(|member| {
        let name = member.name.as_deref().unwrap_or_default();
        let size = if is_open(member.ty) {
            0
        } else {
            size(member.ty)
        };
        format!(
            "Member {{ name: {name:?}, offset: {}, size: {size} }}",
            member.offset
        )
    });
    let members: Vec<String> = members.collect();
    format!(
        "Buffer {{ size: {}, ty: {ty:?}, members: &[{}] }}",
        size(of),
        members.join(", ")
    )
}
