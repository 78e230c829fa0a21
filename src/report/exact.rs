//! What the exact tier left out, and why.

use super::{ExactReport, ReadReport, Unread, of_vertex, place_of, steps};
use crate::front::Source;
use crate::search::Found;
use lodc_passes::texture_removal::TextureRemoval;
use lodc_passes::{Pass, Shader, Stage, specialize};
use naga::{AddressSpace, Expression, Function, Handle, Module, TypeInner};
use std::collections::BTreeSet;

/// The exact tier as a report has it; nothing when there was nothing to do.
pub(super) fn report(found: &Found, base: &Shader, source: &Source) -> Option<ExactReport> {
    let exact = &found.exact;
    if exact.recipe.0.is_empty() {
        return None;
    }
    let [before, after] = exact.used.map(|used| used.work);
    let read = read(base, &exact.shader);
    let count = |of: fn(&Read) -> &BTreeSet<String>| [0, 1].map(|at| of(&read[at]).len());
    Some(ExactReport {
        cost: exact.cost(),
        operations: [before.operations(), after.operations()],
        texture_samples: [before.samples, after.samples],
        vertex_operations: [base, &exact.shader].map(of_vertex),
        recipe: steps(&exact.recipe, &[], base, source),
        read: ReadReport {
            textures: count(|read| &read.textures),
            bindings: count(|read| &read.bindings),
            varyings: count(|read| &read.varyings),
        },
        unread: unread(&read),
    })
}

/// What was left out, a sentence each: what the scene fixes, with what goes for it, what a 0 or a 1 makes pointless, what
/// nothing reads any more, and what looked like one of these and is not.
pub(super) fn left_out(found: &Found, base: &Shader, source: &Source) -> Vec<String> {
    let exact = &found.exact;
    let line = |site| {
        let place = base.find(site).and_then(|at| place_of(base, source, at));
        place.map_or_else(String::new, |place| match place.is_in_main() {
            true => format!(", line {}", place.line()),
            false => format!(", line {} of {}", place.line(), place.file.name),
        })
    };
    let mut said = Vec::new();
    for candidate in &exact.recipe.0 {
        let at = line(&candidate.site);
        let site = candidate.site.path();
        let switch = specialize::branched(candidate);
        said.push(match (specialize::folded(candidate), switch) {
            (Some((place, value)), _) => {
                format!("`{place}` is read no more{at}: the scene fixes it at {value}")
            }
            (None, Some(switch)) => format!(
                "`{site}` is computed in a branch{at}: `{}` switches it off",
                switch.path()
            ),
            (None, None) if candidate.pass == TextureRemoval.name() => {
                format!("`{site}` is not read{at}: its texture has one colour")
            }
            (None, None) => {
                format!("`{site}` needs no operation{at}: an operand is known to be 0 or 1")
            }
        });
    }
    let Unread {
        textures,
        bindings,
        varyings,
    } = unread(&read(base, &exact.shader));
    for (what, names) in [
        ("texture", textures),
        ("binding", bindings),
        ("fragment input", varyings),
    ] {
        said.extend(
            names
                .into_iter()
                .map(|name| format!("the {what} `{name}`: nothing that the scene needs reads it")),
        );
    }
    for considered in &exact.declined {
        let (candidate, declined) = (&considered.candidate, &considered.declined);
        let at = line(&candidate.site);
        if let Some(declined) = declined {
            said.push(format!(
                "not left out: {} of `{}`{at}: {declined}",
                candidate.choice.split(' ').next().unwrap_or_default(),
                candidate.site.path()
            ));
        }
    }
    said
}

/// What the fragment stage of a shader reads, and that of a variant.
fn read(base: &Shader, variant: &Shader) -> [Read; 2] {
    [base, variant].map(|shader| {
        let function = shader.function(Stage::Fragment);
        function.map_or_else(Read::default, |function| {
            Read::of(shader.module(), function)
        })
    })
}

/// What the first one reads, and the second does not.
fn unread([before, after]: &[Read; 2]) -> Unread {
    let gone = |before: &BTreeSet<String>, after: &BTreeSet<String>| {
        before.difference(after).cloned().collect()
    };
    Unread {
        textures: gone(&before.textures, &after.textures),
        bindings: gone(&before.bindings, &after.bindings),
        varyings: gone(&before.varyings, &after.varyings),
    }
}

/// What a function reads, by name.
#[derive(Default)]
struct Read {
    textures: BTreeSet<String>,
    bindings: BTreeSet<String>,
    varyings: BTreeSet<String>,
}

impl Read {
    fn of(module: &Module, function: &Function) -> Self {
        let mut read = Self::default();
        for (_, expression) in function.expressions.iter() {
            match *expression {
                Expression::GlobalVariable(variable) => {
                    let variable = &module.global_variables[variable];
                    let Some(name) = variable.name.clone().filter(|_| variable.binding.is_some())
                    else {
                        continue;
                    };
                    let is_texture = variable.space == AddressSpace::Handle
                        && !matches!(module.types[variable.ty].inner, TypeInner::Sampler { .. });
                    match is_texture {
                        true => read.textures.insert(name),
                        false => read.bindings.insert(name),
                    };
                }
                Expression::AccessIndex { base, index } => {
                    read.varyings.extend(input(module, function, base, index));
                }
                Expression::FunctionArgument(at) => {
                    let argument = function.arguments.get(at as usize);
                    let plain = argument.filter(|argument| argument.binding.is_some());
                    read.varyings
                        .extend(plain.and_then(|argument| argument.name.clone()));
                }
                _ => {}
            }
        }
        read
    }
}

/// The name of a member of an input struct.
fn input(
    module: &Module,
    function: &Function,
    base: Handle<Expression>,
    index: u32,
) -> Option<String> {
    let Expression::FunctionArgument(at) = function.expressions[base] else {
        return None;
    };
    match &module.types[function.arguments.get(at as usize)?.ty].inner {
        TypeInner::Struct { members, .. } => members.get(index as usize)?.name.clone(),
        _ => None,
    }
}
