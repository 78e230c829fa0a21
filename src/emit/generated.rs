//! The generated textures of a text with several levels: each under one name, at one binding.
//!
//! Levels that read the same texture share it. In a text of all levels no binding is used twice, and the author's keep
//! theirs; in the form of one file a level, a generated texture takes the binding of one that the level no longer reads.

use super::composed::composed;
use super::control::free_binding;
use super::tokens::words;
use super::{EmitLevel, Form};
use crate::Result;
use crate::front::Source;
use lodc_passes::{Fingerprint, Generated};
use naga::{Module, TypeInner};
use std::collections::{BTreeMap, BTreeSet};

/// How many bindings what levels have beside textures may take behind the last one: that of autoLOD, and those of the
/// parameter block.
const OTHERS: u32 = 3;

/// A generated texture of a result.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct GeneratedTexture {
    /// The name of its variable.
    pub name: String,
    /// What computes it.
    pub generated: Generated,
}

/// Levels whose generated textures have the names and bindings of the result.
pub(crate) struct Settled {
    pub(crate) levels: Vec<EmitLevel>,
    /// Each once, in the order in which levels read them first.
    pub(crate) textures: Vec<GeneratedTexture>,
}

/// The generated textures of levels of a source, as a form has them: each once.
///
/// # Errors
/// When the source is made of several files that cannot be written as one.
pub fn generated_textures(
    source: &Source,
    levels: &[EmitLevel],
    form: Form,
) -> Result<Vec<GeneratedTexture>> {
    let source = &*composed(source)?;
    Ok(Settled::new(source, levels, form).textures)
}

/// Levels of a source with their generated textures under the names and at the bindings that they have in a form.
///
/// # Errors
/// As [`generated_textures`].
pub(crate) fn settled(source: &Source, levels: &[EmitLevel], form: Form) -> Result<Vec<EmitLevel>> {
    let source = &*composed(source)?;
    Ok(Settled::new(source, levels, form).levels)
}

impl Settled {
    /// Those of levels of a source, in a form.
    pub(crate) fn new(source: &Source, levels: &[EmitLevel], form: Form) -> Self {
        let mut taken: BTreeSet<String> = words(&source.text).into_iter().map(Into::into).collect();
        let mut known: BTreeMap<Fingerprint, (String, (u32, u32))> = BTreeMap::new();
        let mut next: BTreeMap<u32, u32> = BTreeMap::new();
        let mut textures = Vec::new();
        let mut settled = Vec::new();
        for level in levels {
            let mut places = Vec::new();
            let mut reused = freed(level);
            for (variable, generated) in level.shader.generated() {
                let (group, own) = generated.binding;
                let (name, shared) = known.entry(generated.definition()).or_insert_with(|| {
                    let declared = &level.shader.module().global_variables[variable];
                    let name = free(declared.name.as_deref().unwrap_or("loctx_0"), &taken);
                    taken.insert(name.clone());
                    textures.push(GeneratedTexture {
                        name: name.clone(),
                        generated: generated.clone(),
                    });
                    let next = next
                        .entry(group)
                        .or_insert_with(|| first_free(&source.module, group));
                    *next += 1;
                    (name, (group, *next - 1))
                });
                let binding = match form {
                    Form::Files => match reused.iter().position(|(of, _)| *of == group) {
                        Some(at) => reused.remove(at),
                        None => (group, own),
                    },
                    Form::Override | Form::Uniform => *shared,
                };
                places.push((name.clone(), binding));
            }
            settled.push(EmitLevel {
                shader: level.shader.with_generated_at(&places),
                ..level.clone()
            });
        }
        Self {
            levels: settled,
            textures,
        }
    }
}

/// The bindings of textures of the author's that a level does not read.
fn freed(level: &EmitLevel) -> Vec<(u32, u32)> {
    let module = level.shader.module();
    let mut read = vec![false; module.global_variables.len()];
    for point in &module.entry_points {
        for (_, expression) in point.function.expressions.iter() {
            if let naga::Expression::GlobalVariable(variable) = expression {
                read[variable.index()] = true;
            }
        }
    }
    let made: Vec<(u32, u32)> = level.shader.made().map(|made| made.binding).collect();
    let variables = module.global_variables.iter();
    let mut freed: Vec<(u32, u32)> = variables
        .filter(|(variable, declared)| {
            let inner = &module.types[declared.ty].inner;
            !read[variable.index()] && matches!(inner, TypeInner::Image { .. })
        })
        .filter_map(|(_, declared)| Some((declared.binding?.group, declared.binding?.binding)))
        .filter(|binding| !made.contains(binding))
        .collect();
    freed.sort_unstable();
    freed
}

/// The first binding of a group that neither the author nor anything else of the levels has.
fn first_free(module: &Module, group: u32) -> u32 {
    let bindings = module
        .global_variables
        .iter()
        .filter_map(|(_, variable)| variable.binding);
    let last = bindings
        .filter(|at| at.group == group)
        .map(|at| at.binding)
        .max();
    let behind = last.map_or(0, |last| last + 1);
    match free_binding(module) {
        (of_others, binding) if of_others == group => behind.max(binding + OTHERS),
        _ => behind,
    }
}

/// The name, or where it is taken the same with the next number that is free: `loctx_1_silk` for `loctx_0_silk`.
fn free(name: &str, taken: &BTreeSet<String>) -> String {
    let parts = name
        .strip_prefix("loctx_")
        .and_then(|rest| rest.split_once('_'));
    let (number, source) = match parts.map(|(number, source)| (number.parse::<u64>(), source)) {
        Some((Ok(number), source)) => (number, source),
        _ => (0, name),
    };
    let numbered = |number: u64| format!("loctx_{number}_{source}");
    let mut number = number;
    while taken.contains(&numbered(number)) {
        number += 1;
    }
    numbered(number)
}
