//! What a level is chosen by: an autoLOD of the author's, or one that is declared behind the text.

use super::Form;
use super::body::Body;
use crate::front::identifiers::Names;
use crate::{Diagnostic, Result};
use naga::{AddressSpace, Handle, Module, Override, Scalar, StorageAccess, TypeInner};

/// Where a level is chosen by.
pub(crate) struct Control {
    /// The expression that reads it.
    pub(crate) value: String,
    /// The name at module scope that the expression starts with.
    pub(crate) root: String,
    /// What has to be declared for it.
    pub(crate) declaration: Option<String>,
    /// How many bindings it takes behind the module's last one.
    pub(crate) bindings: u32,
    /// Whether it is a pipeline constant.
    pub(crate) by_override: bool,
}

/// The name that the host knows.
pub(crate) const NAME: &str = "autoLOD";

/// A module's pipeline constant of that name, and the key that it is set by: one with a number is known by its number
/// alone.
pub(crate) fn pipeline_constant(module: &Module) -> Option<(Handle<Override>, String)> {
    let mut constants = module.overrides.iter();
    let (handle, constant) = constants.find(|(_, c)| c.name.as_deref() == Some(NAME))?;
    let key = constant.id.map_or(NAME.to_owned(), |id| id.to_string());
    Some((handle, key))
}

/// The buffer of a module that holds a number of that name, by group and binding, and the number's place there, in bytes:
/// the author's, or what `--form uniform` declares.
pub(crate) fn in_buffer(module: &Module) -> Option<((u32, u32), u32)> {
    let is_number = |ty| module.types[ty].inner == TypeInner::Scalar(Scalar::F32);
    module.global_variables.iter().find_map(|(_, variable)| {
        let at = variable.binding.as_ref()?;
        let at = (at.group, at.binding);
        let named = |name: &Option<String>| name.as_deref() == Some(NAME);
        match (&variable.space, &module.types[variable.ty].inner) {
            (
                AddressSpace::Uniform | AddressSpace::Storage { .. },
                TypeInner::Struct { members, .. },
            ) => {
                let own = members.iter().find(|m| named(&m.name) && is_number(m.ty))?;
                Some((at, own.offset))
            }
            (AddressSpace::Uniform | AddressSpace::Storage { .. }, _) => {
                (named(&variable.name) && is_number(variable.ty)).then_some((at, 0))
            }
            _ => None,
        }
    })
}

impl Control {
    /// Finds the author's, or makes one in this form, for the fragment stage alone or for both.
    ///
    /// # Errors
    /// When the author's is nothing that a host sets.
    pub(crate) fn new(
        body: &Body<'_>,
        form: Form,
        both_stages: bool,
        names: &mut Names,
    ) -> Result<Self> {
        let (source, text, module) = (body.source, &body.text, body.module);
        if let Some(own) = Self::own(module) {
            return Ok(own);
        }
        if let Some(declaration) = text.declaration(NAME) {
            let shift = source.text.len() - text.text.len();
            let span = declaration.name_span.clone();
            return Err(Diagnostic::error(format!(
                "`{NAME}` is declared, but not as something that a host sets"
            ))
            .with_source(&source.name, &source.text)
            .with_label(
                span.start + shift..span.end + shift,
                "this is no `override` and no uniform of type f32",
            )
            .with_note(format!(
                "declare `override {NAME}: f32 = 0.0;`, or give this another name"
            )));
        }
        Ok(match form {
            Form::Override | Form::Files => Self {
                value: NAME.to_owned(),
                root: NAME.to_owned(),
                bindings: 0,
                declaration: Some(format!(
                    "// Halvings of scale on screen since the nearest view; 0, the default, is the original.\n\
                     override {NAME}: f32 = 0.0;\n"
                )),
                by_override: true,
            },
            Form::Uniform => {
                let (group, binding) = free_binding(module);
                let ty = names.take("LevelOfDetail");
                let variable = names.take("level_of_detail");
                let read = match both_stages {
                    true => "; both stages read it",
                    false => "",
                };
                Self {
                    value: format!("{variable}.{NAME}"),
                    declaration: Some(format!(
                        "// Halvings of scale on screen since the nearest view; 0 is the original{read}.\n\
                         struct {ty} {{\n    @size(16) {NAME}: f32,\n}}\n\
                         @group({group}) @binding({binding}) var<uniform> {variable}: {ty};\n"
                    )),
                    root: variable,
                    bindings: 1,
                    by_override: false,
                }
            }
        })
    }

    /// One that each pixel has for itself, which the host has no part in.
    pub(crate) fn of_pixel() -> Self {
        Self {
            value: String::new(),
            root: String::new(),
            declaration: None,
            bindings: 0,
            by_override: false,
        }
    }

    /// The author's own autoLOD: a pipeline constant, or a member of something that the host fills.
    fn own(module: &Module) -> Option<Self> {
        let is_number =
            |ty: naga::Handle<naga::Type>| module.types[ty].inner == TypeInner::Scalar(Scalar::F32);
        let found = |value: String, root: &str, by_override| {
            Some(Self {
                value,
                root: root.to_owned(),
                bindings: 0,
                declaration: None,
                by_override,
            })
        };
        for (_, constant) in module.overrides.iter() {
            if constant.name.as_deref() == Some(NAME) && is_number(constant.ty) {
                return found(NAME.to_owned(), NAME, true);
            }
        }
        for (_, variable) in module.global_variables.iter() {
            let is_uniform = match variable.space {
                AddressSpace::Uniform | AddressSpace::Immediate => true,
                AddressSpace::Storage { access } => access == StorageAccess::LOAD,
                _ => false,
            };
            let Some(name) = variable.name.as_deref().filter(|_| is_uniform) else {
                continue;
            };
            if name == NAME && is_number(variable.ty) {
                return found(NAME.to_owned(), NAME, false);
            }
            if let Some(path) = member_path(module, variable.ty) {
                return found(format!("{name}.{path}"), name, false);
            }
        }
        None
    }
}

/// The way to a member called autoLOD.
fn member_path(module: &Module, ty: naga::Handle<naga::Type>) -> Option<String> {
    let TypeInner::Struct { members, .. } = &module.types[ty].inner else {
        return None;
    };
    members.iter().find_map(|member| {
        let name = member.name.as_deref()?;
        if name == NAME && module.types[member.ty].inner == TypeInner::Scalar(Scalar::F32) {
            return Some(name.to_owned());
        }
        Some(format!("{name}.{}", member_path(module, member.ty)?))
    })
}

/// The binding behind the last one of the last group.
pub(crate) fn free_binding(module: &Module) -> (u32, u32) {
    module
        .global_variables
        .iter()
        .filter_map(|(_, variable)| variable.binding)
        .map(|binding| (binding.group, binding.binding))
        .max()
        .map_or((0, 0), |(group, binding)| (group, binding + 1))
}
