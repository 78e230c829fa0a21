//! What the user wants kept, by name: `--keep`.

use super::Request;
use super::search::Ready;
use crate::emit::Transition;
use crate::front::names::nearest;
use crate::search::{Kept, is_within};
use crate::{Diagnostic, Result};
use lodc_passes::{Passes, Stage, specialize};
use naga::{Expression, Handle};
use std::collections::BTreeSet;

impl Ready {
    /// What is to be kept: textures, buffers and places in them, functions, and values by a part of their paths. And what the
    /// comments of the shader say, and the passes that may cost error.
    ///
    /// # Errors
    /// When a name is none of these or names no pass, and as [`Self::directives`].
    pub(super) fn kept(&self, request: &Request) -> Result<Kept> {
        let mut kept = Kept {
            only: passes(self.base.passes(), &named(request))?,
            unstable: request.unstable,
            same_vertex_stage: request.per_pixel,
            apart: request.transition.unwrap_or_default() != Transition::Pop,
            ..Kept::default()
        };
        #[cfg(feature = "mesh")]
        if request.is_of_meshes_alone() {
            // No pass is called so.
            kept.only.insert(super::joint::MESH.to_owned());
        }
        let read = self.read_names();
        for name in &request.keep {
            let variables = self.source.module.global_variables.iter();
            let is_variable = variables
                .filter_map(|(_, variable)| variable.name.as_ref())
                .any(|variable| is_within(name, variable));
            if is_variable {
                if read.iter().any(|place| is_within(place, name)) {
                    kept.read.insert(name.clone());
                    continue;
                }
                let mut stated = self.scene.uniforms.iter();
                if !name.contains(['.', '[']) || stated.any(|u| is_within(&u.path, name)) {
                    // It is there, and no fragment reads it.
                    continue;
                }
            }
            let values = self.values_of(name);
            let is_function = self
                .source
                .module
                .functions
                .iter()
                .any(|(_, function)| function.name.as_deref() == Some(name));
            if values.is_empty() && !is_function {
                return Err(self.nothing_to_keep(name, &read));
            }
            kept.values.extend(values);
        }
        self.directives(&read, &mut kept)?;
        Ok(kept)
    }

    /// What the fragment stage reads: variables, and places of buffers.
    pub(super) fn read_names(&self) -> BTreeSet<String> {
        let Some(function) = self.base.function(Stage::Fragment) else {
            return BTreeSet::new();
        };
        let values = function.expressions.iter();
        let read = values.filter_map(|(value, expression)| match *expression {
            Expression::GlobalVariable(variable) => {
                self.base.module().global_variables[variable].name.clone()
            }
            Expression::Load { .. } => specialize::place(&self.base, value),
            _ => None,
        });
        read.collect()
    }

    /// The paths of the values of the fragment stage that a person could mean: those that are computed.
    pub(super) fn computed(&self) -> impl Iterator<Item = (Handle<Expression>, &str)> {
        let function = self.base.function(Stage::Fragment);
        let values = function.into_iter().flat_map(|f| f.expressions.iter());
        values
            .filter(|(_, expression)| !expression.needs_pre_emit())
            .map(|(value, _)| (value, self.base.id(Stage::Fragment, value).path()))
    }

    /// The values that a name stands for: by a part of their paths, a function's all that it computes.
    fn values_of(&self, name: &str) -> BTreeSet<String> {
        let wanted: Vec<&str> = name.split('.').collect();
        let computed = self.computed().map(|(_, path)| path);
        computed
            .filter(|path| has_part(path, &wanted))
            .map(str::to_owned)
            .collect()
    }

    fn nothing_to_keep(&self, name: &str, read: &BTreeSet<String>) -> Box<Diagnostic> {
        let error = Diagnostic::error(format!("there is no `{name}` to keep"));
        let known: BTreeSet<&str> = read
            .iter()
            .map(String::as_str)
            .chain(
                self.computed()
                    .flat_map(|(_, path)| path.split('.').skip(1)),
            )
            .collect();
        let near = nearest(name, known, 3);
        error.with_note(match near.is_empty() {
            true => "name a texture, a uniform such as `material.flags`, a function, or a value that `lodc inspect` lists".to_owned(),
            false => format!("did you mean {}?", near.iter().map(|n| format!("`{n}`")).collect::<Vec<_>>().join(", ")),
        })
    }
}

/// What `--only` names of passes.
#[cfg(not(feature = "mesh"))]
fn named(request: &Request) -> Vec<String> {
    request.only.clone()
}

/// What `--only` names of passes: of a joint search, not that meshes or shaders are meant.
#[cfg(feature = "mesh")]
fn named(request: &Request) -> Vec<String> {
    use super::Strategy;
    use super::joint::{MESH, SHADER};
    let is_pass = |name: &&String| {
        request.search == Strategy::Greedy || ![MESH, SHADER].contains(&name.as_str())
    };
    request.only.iter().filter(is_pass).cloned().collect()
}

/// The passes of these names.
fn passes(all: &Passes, names: &[String]) -> Result<BTreeSet<String>> {
    let known: Vec<&str> = all
        .all()
        .filter(|pass| !pass.is_exact())
        .map(|pass| pass.name())
        .collect();
    match names.iter().find(|name| !known.contains(&name.as_str())) {
        Some(unknown) => Err(Diagnostic::error(format!(
            "there is no pass `{unknown}` that costs error"
        ))
        .with_note(format!("such passes are {}", known.join(", ")))),
        None => Ok(names.iter().cloned().collect()),
    }
}

/// Whether a part of a path is called so, step by step.
pub(super) fn has_part(path: &str, wanted: &[&str]) -> bool {
    let path: Vec<&str> = path.split('.').collect();
    path.windows(wanted.len()).any(|steps| {
        let mut pairs = steps.iter().zip(wanted);
        pairs.all(|(step, wanted)| is_called(step, wanted))
    })
}

/// Whether a step of a path is a value of that name: what a variable holds later has a number behind it.
fn is_called(step: &str, name: &str) -> bool {
    step.strip_prefix(name).is_some_and(|rest| {
        rest.is_empty()
            || rest
                .strip_prefix('_')
                .is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()))
    })
}
