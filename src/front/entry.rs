//! Entry points: which two lodc works on, and what they are fed.

use super::Source;
use super::names::{function_name, listed, nearest, whole_word};
use crate::{Diagnostic, Result};
use naga::{Binding, Handle, Module, ShaderStage, Span, Type, TypeInner};
use std::path::PathBuf;

/// The entry points that the user asked for; what is `None` must be unambiguous.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Stages {
    /// The vertex entry point (`--vertex`).
    pub vertex: Option<String>,
    /// The fragment entry point (`--fragment`).
    pub fragment: Option<String>,
    /// The file of the vertex entry point, where it is another one (`--vertex-file`).
    pub vertex_file: Option<PathBuf>,
}

/// One input of an entry point: an argument, or a member of an argument that is a struct.
#[derive(Clone, Debug, PartialEq)]
pub struct Input {
    /// The argument's or member's name; empty when it has none.
    pub name: String,
    /// Its location or built-in.
    pub binding: Binding,
    /// Its type, in the module's arena.
    pub ty: Handle<Type>,
    /// Where it is declared; undefined when that is not known.
    pub span: Span,
}

/// The inputs of the entry point at `entry` of a source's module, flattened, in order.
pub fn inputs(source: &Source, entry: usize) -> Vec<Input> {
    let module = &source.module;
    let mut inputs = Vec::new();
    let Some(entry) = module.entry_points.get(entry) else {
        return inputs;
    };
    for argument in &entry.function.arguments {
        match (&argument.binding, &module.types[argument.ty].inner) {
            (Some(binding), _) => {
                let name = argument.name.clone().unwrap_or_default();
                // naga keeps no span of an argument: it is the first such word after the function's name. In GLSL
                // it is a variable at module scope.
                let span = source.files().find_map(|file| {
                    let text = file.text;
                    let at = function_name(text, &entry.name)?;
                    let at = whole_word(text, at.end..text.len(), &name)?;
                    Some(file.span(at))
                });
                inputs.push(Input {
                    binding: binding.clone(),
                    ty: argument.ty,
                    span: span
                        .or_else(|| declared_outside(source, &name))
                        .unwrap_or_default(),
                    name,
                });
            }
            (None, TypeInner::Struct { members, .. }) => {
                let declared = source.place(module.types.get_span(argument.ty));
                for member in members {
                    let Some(binding) = &member.binding else {
                        continue;
                    };
                    let name = member.name.clone().unwrap_or_default();
                    let span = declared.as_ref().and_then(|place| {
                        let at = whole_word(place.file.text, place.range.clone(), &name)?;
                        Some(place.file.span(at))
                    });
                    inputs.push(Input {
                        name,
                        binding: binding.clone(),
                        ty: member.ty,
                        span: span.unwrap_or_default(),
                    });
                }
            }
            (None, _) => {}
        }
    }
    inputs
}

/// Where a variable, or a member of a block of variables, is declared at module scope.
fn declared_outside(source: &Source, name: &str) -> Option<Span> {
    let module = &source.module;
    let mut variables = module.global_variables.iter();
    variables.find_map(|(handle, variable)| {
        let in_block = || match &module.types[variable.ty].inner {
            TypeInner::Struct { members, .. } => {
                members.iter().any(|m| m.name.as_deref() == Some(name))
            }
            _ => false,
        };
        if variable.name.as_deref() != Some(name) && !in_block() {
            return None;
        }
        let place = source.place(module.global_variables.get_span(handle))?;
        let text = place.file.text;
        // The span of a block is its name, before its members.
        let end = match text[place.range.end..].find('}') {
            Some(end) if in_block() => place.range.end + end,
            _ => place.range.end,
        };
        let at = whole_word(text, place.range.start..end, name)?;
        Some(place.file.span(at))
    })
}

/// Chooses the vertex (or none) and the fragment entry point, and checks that they fit together.
pub(super) fn choose(source: &Source, stages: &Stages) -> Result<(Option<String>, String)> {
    let module = &source.module;
    let pick = |stage, wanted| pick(&source.name, &source.text, module, stage, wanted);
    let fragment = pick(ShaderStage::Fragment, stages.fragment.as_deref())?;
    let Some(fragment) = fragment else {
        let none = Diagnostic::error(format!("`{}` has no fragment entry point", source.name));
        let others: Vec<String> = module
            .entry_points
            .iter()
            .map(|e| format!("`{}` ({})", e.name, stage_name(e.stage)))
            .collect();
        let functions: Vec<&str> = module
            .functions
            .iter()
            .filter_map(|(_, f)| f.name.as_deref())
            .collect();
        return Err(if !others.is_empty() {
            none.with_note(format!("its entry points are {}", others.join(", ")))
        } else if !functions.is_empty() {
            none.with_note(format!(
                "it has the functions {}: mark one with `@fragment`",
                listed(functions.into_iter().take(8))
            ))
        } else {
            none.with_note("lodc works on a function marked `@fragment`")
        });
    };
    check_colour(source, &fragment)?;
    let vertex = pick(ShaderStage::Vertex, stages.vertex.as_deref())?;
    if let Some(vertex) = &vertex {
        check_stages(source, vertex, &fragment)?;
    }
    Ok((vertex, fragment))
}

/// The entry point of a stage: the one that is wanted, or the only one. `name` and `text` are the file's.
pub(super) fn pick(
    name: &str,
    text: &str,
    module: &Module,
    stage: ShaderStage,
    wanted: Option<&str>,
) -> Result<Option<String>> {
    let entries = module.entry_points.iter().filter(|e| e.stage == stage);
    let have: Vec<&str> = entries.map(|e| e.name.as_str()).collect();
    let what = stage_name(stage);
    match (wanted, have.as_slice()) {
        (None, []) => Ok(None),
        (None, [only]) => Ok(Some((*only).to_owned())),
        (None, several) => {
            let found = Diagnostic::error(format!(
                "`{name}` has several {what} entry points: {}",
                listed(several.iter().copied())
            ))
            .with_source(name, text);
            let places = several.iter().filter_map(|n| function_name(text, n));
            Err(places
                .fold(found, |d, place| d.with_label(place, ""))
                .with_note(format!("choose one: `--{what} {}`", several[0])))
        }
        (Some(wanted), have) if have.contains(&wanted) => Ok(Some(wanted.to_owned())),
        (Some(wanted), have) => {
            let missing =
                Diagnostic::error(format!("`{name}` has no {what} entry point `{wanted}`"));
            let near = nearest(wanted, have.iter().copied(), 1);
            Err(match (near.first(), have) {
                (Some(near), _) => missing.with_note(format!("there is a `{near}`")),
                (None, []) => missing.with_note(format!("it has no {what} entry point at all")),
                (None, have) => {
                    missing.with_note(format!("it has {}", listed(have.iter().copied())))
                }
            })
        }
    }
}

fn stage_name(stage: ShaderStage) -> String {
    format!("{stage:?}").to_lowercase()
}

/// The fragment stage must return a colour: that is what variants are compared by.
pub(super) fn check_colour(source: &Source, fragment: &str) -> Result<()> {
    let (module, text) = (&source.module, &source.text);
    let mut entries = module.entry_points.iter();
    let entry = entries.find(|e| e.stage == ShaderStage::Fragment && e.name == fragment);
    let is_colour =
        |binding: &Option<Binding>| matches!(binding, Some(Binding::Location { location: 0, .. }));
    let returns =
        entry
            .and_then(|e| e.function.result.as_ref())
            .is_some_and(|result| match &module.types[result.ty].inner {
                TypeInner::Struct { members, .. } => members.iter().any(|m| is_colour(&m.binding)),
                _ => is_colour(&result.binding),
            });
    if returns {
        return Ok(());
    }
    let error = Diagnostic::error(format!("`{fragment}` returns no colour at location 0"))
        .with_source(&source.name, text);
    let error = match function_name(text, fragment) {
        Some(place) => error.with_label(place, "what it returns is compared"),
        None => error,
    };
    Err(error.with_note("lodc measures levels by their colours: return one as `@location(0) vec4f`, in GLSL `layout(location = 0) out vec4 colour;`"))
}

/// Every location that the fragment stage reads must be written by the vertex stage, in a type that fits.
/// naga validates each stage alone.
pub(super) fn check_stages(source: &Source, vertex: &str, fragment: &str) -> Result<()> {
    let module = &source.module;
    let find = |stage, wanted: &str| {
        let mut all = module.entry_points.iter();
        all.position(|e| e.stage == stage && e.name == wanted)
    };
    let (Some(v), Some(f)) = (
        find(ShaderStage::Vertex, vertex),
        find(ShaderStage::Fragment, fragment),
    ) else {
        return Ok(());
    };
    let mut written = Vec::new();
    if let Some(result) = &module.entry_points[v].function.result {
        match (&result.binding, &module.types[result.ty].inner) {
            (Some(Binding::Location { location, .. }), _) => written.push((*location, result.ty)),
            (None, TypeInner::Struct { members, .. }) => {
                for member in members {
                    if let Some(Binding::Location { location, .. }) = member.binding {
                        written.push((location, member.ty));
                    }
                }
            }
            _ => {}
        }
    }
    for input in inputs(source, f) {
        let Binding::Location { location, .. } = input.binding else {
            continue;
        };
        let wrong =
            |message: String| source.error(message, input.span, format!("read by `{fragment}`"));
        match written.iter().find(|(at, _)| *at == location) {
            None => {
                return Err(wrong(format!(
                    "`{fragment}` reads `{}` at location {location}, which `{vertex}` does not write",
                    input.name
                ))
                .with_note(format!(
                    "write it in `{vertex}`, or choose another vertex entry point with `--vertex`"
                )));
            }
            Some((_, ty)) => {
                let shape = |ty: Handle<Type>| {
                    let inner = &module.types[ty].inner;
                    let size = match inner {
                        TypeInner::Vector { size, .. } => *size as u32,
                        _ => 1,
                    };
                    (inner.scalar(), size)
                };
                let ((have, have_size), (want, want_size)) = (shape(*ty), shape(input.ty));
                if have != want || have_size < want_size {
                    return Err(wrong(format!(
                        "`{fragment}` reads `{}` at location {location} in another type than `{vertex}` writes",
                        input.name
                    ))
                    .with_note("give both the same type"));
                }
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const TWO: &str = "
        @vertex fn va() -> @builtin(position) vec4f { return vec4f(); }
        @vertex fn vb() -> @builtin(position) vec4f { return vec4f(); }
        @fragment fn fa() -> @location(0) vec4f { return vec4f(); }
        @fragment fn fb() -> @location(0) vec4f { return vec4f(); }";

    fn stages(vertex: Option<&str>, fragment: Option<&str>) -> Stages {
        Stages {
            vertex: vertex.map(str::to_owned),
            fragment: fragment.map(str::to_owned),
            vertex_file: None,
        }
    }

    #[test]
    fn one_entry_point_a_stage_needs_no_choice() {
        let source = Source::parse(
            "a.wgsl",
            "@fragment fn f() -> @location(0) vec4f { return vec4f(); }",
        )
        .unwrap();
        assert_eq!(
            (source.vertex.as_deref(), source.fragment.as_str()),
            (None, "f")
        );
        assert_eq!(source.fragment_entry().0, 0);
        assert!(source.vertex_entry().is_none());
    }

    #[test]
    fn several_are_listed_and_a_name_chooses() {
        let error = Source::parse("a.wgsl", TWO).unwrap_err();
        assert_eq!(
            error.message,
            "`a.wgsl` has several fragment entry points: `fa` and `fb`"
        );
        assert_eq!(error.labels.len(), 2);
        assert_eq!(error.notes, ["choose one: `--fragment fa`"]);
        let error = Source::parse_stages("a.wgsl", TWO, &stages(None, Some("fb"))).unwrap_err();
        assert!(
            error
                .message
                .contains("several vertex entry points: `va` and `vb`"),
            "{error}"
        );
        let source = Source::parse_stages("a.wgsl", TWO, &stages(Some("vb"), Some("fb"))).unwrap();
        assert_eq!(
            (source.vertex_entry().unwrap().0, source.fragment_entry().0),
            (1, 3)
        );
    }

    #[test]
    fn a_wrong_name_lists_what_there_is() {
        let error = Source::parse_stages("a.wgsl", TWO, &stages(None, Some("lit"))).unwrap_err();
        assert_eq!(error.message, "`a.wgsl` has no fragment entry point `lit`");
        let error = Source::parse_stages("a.wgsl", TWO, &stages(None, Some("main"))).unwrap_err();
        assert_eq!(error.notes, ["it has `fa` and `fb`"]);
        let error = Source::parse_stages(
            "a.wgsl",
            TWO.replace("fb", "shade"),
            &stages(None, Some("shader")),
        )
        .unwrap_err();
        assert_eq!(error.notes, ["there is a `shade`"]);
    }

    #[test]
    fn without_a_fragment_entry_point_the_error_lists_what_there_is() {
        let none = |text: &str| Source::parse("a.wgsl", text).unwrap_err();
        let error = none("@vertex fn v() -> @builtin(position) vec4f { return vec4f(); }");
        assert_eq!(error.message, "`a.wgsl` has no fragment entry point");
        assert_eq!(error.notes, ["its entry points are `v` (vertex)"]);
        let error = none("fn shade() -> f32 { return 1.0; }");
        assert_eq!(
            error.notes,
            ["it has the functions `shade`: mark one with `@fragment`"]
        );
        assert!(none("const a = 1;").notes[0].contains("@fragment"));
    }

    #[test]
    fn a_fragment_without_a_colour_is_refused() {
        for result in ["", "-> @builtin(frag_depth) f32", "-> @location(1) vec4f"] {
            let body = match result {
                "" => "",
                r if r.ends_with("f32") => "return 1.0;",
                _ => "return vec4f();",
            };
            let text = format!("@fragment fn fs() {result} {{ {body} }}");
            let error = Source::parse("a.wgsl", text).unwrap_err();
            assert_eq!(error.message, "`fs` returns no colour at location 0");
            assert_eq!(error.labels[0].0, 13..15);
        }
        let several = "struct O { @location(1) n: vec4f, @location(0) c: vec4f }
            @fragment fn fs() -> O { return O(); }";
        assert!(Source::parse("a.wgsl", several).is_ok());
    }

    #[test]
    fn the_stages_must_fit_together() {
        let vertex = "struct V { @builtin(position) p: vec4f, @location(0) uv: vec2f }
            @vertex fn vs() -> V { return V(); }\n";
        let error = |fragment: &str| {
            Source::parse("a.wgsl", format!("{vertex}{fragment}"))
                .map(|_| ())
                .map_err(|e| e.to_string())
        };
        assert!(error("@fragment fn fs(@location(0) uv: vec2f) -> @location(0) vec4f { return vec4f(uv, uv); }").is_ok());
        let missing = error("@fragment fn fs(@location(1) n: vec3f) -> @location(0) vec4f { return vec4f(n, 1.0); }").unwrap_err();
        assert!(
            missing.contains("`fs` reads `n` at location 1, which `vs` does not write"),
            "{missing}"
        );
        assert!(missing.contains("a.wgsl:3:"), "{missing}");
        let wider =
            error("@fragment fn fs(@location(0) uv: vec4f) -> @location(0) vec4f { return uv; }")
                .unwrap_err();
        assert!(wider.contains("in another type"), "{wider}");
    }

    #[test]
    fn inputs_are_flattened_with_their_places() {
        let text = "struct I { @location(1) uv: vec2f, @builtin(front_facing) front: bool }
            @fragment fn fs(i: I, @location(0) tint: vec3f) -> @location(0) vec4f { return vec4f(tint, i.uv.x); }";
        let source = Source::parse("a.wgsl", text).unwrap();
        let found: Vec<_> = inputs(&source, 0)
            .into_iter()
            .map(|i| (i.name.clone(), &text[i.span.to_range().unwrap()]))
            .map(|(a, b)| (a, b.to_owned()))
            .collect();
        for (name, place) in &found {
            assert_eq!(name, place);
        }
        assert_eq!(found.len(), 3);
    }
}
