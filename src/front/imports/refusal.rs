//! What naga_oil refuses, said at the place that is wrong in the file that a person wrote.

use super::demangle::{parts, readable};
use super::library::Library;
use super::spans::{Words, module_text, preprocessed};
use super::{Definitions, Main, located};
use crate::Diagnostic;
use crate::front::names::{listed, nearest, whole_word};
use crate::front::parse::uncapitalised;
use naga_oil::compose::{Composer, ComposerError, ComposerErrorInner, ErrSource};
use std::ops::Range;

/// The file that an error is in, and how much naga_oil put before its text.
struct Wrong<'a> {
    name: &'a str,
    text: &'a str,
    /// The text as naga saw it.
    seen: String,
    header: usize,
}

/// An error of composing a text.
pub(super) fn refusal(
    error: &ComposerError,
    composer: &Composer,
    library: &Library,
    main: Main<'_>,
    definitions: &Definitions,
) -> Box<Diagnostic> {
    let wrong = match &error.source {
        ErrSource::Module { name, offset, .. } => library.module(name).map(|file| Wrong {
            name: &file.name,
            text: &file.text,
            seen: module_text(composer, name, definitions),
            header: *offset,
        }),
        ErrSource::Constructing { .. } => None,
    };
    let wrong = wrong.unwrap_or_else(|| Wrong {
        name: main.name,
        text: main.text,
        seen: preprocessed(main.text, definitions),
        header: error.source.offset(),
    });
    if let Some(missing) = missing_module(&error.inner, library) {
        return missing;
    }
    if let ComposerErrorInner::WgslParseError(parse) = &error.inner {
        let words = Words::new(&wrong.seen, wrong.text);
        let message = uncapitalised(&readable(parse.message()));
        let mut found = Diagnostic::error(message).with_source(wrong.name, wrong.text);
        let mut main_place = None;
        for (span, remark) in parse.labels() {
            let place = span.to_range().and_then(|range| {
                let from = range.start.checked_sub(wrong.header)?;
                let to = range.end.checked_sub(wrong.header)?;
                words.written(from..to)
            });
            if let Some(place) = place {
                main_place.get_or_insert(place.clone());
                found = found.with_label(place, readable(remark));
            }
        }
        found = parse
            .notes()
            .fold(found, |d, note| d.with_reason(readable(note)));
        let undefined =
            main_place.and_then(|place| undefined_definition(wrong.text, place, definitions));
        return match undefined {
            Some((name, place)) => {
                let file = (wrong.name, wrong.text);
                located(
                    format!("the shader def `{name}` has no value"),
                    file,
                    place,
                    "put in here",
                )
                .with_note(format!("give it one: `-D {name}=8`"))
            }
            None => with_near_items(found, parse.message(), library),
        };
    }
    directive_error(&error.inner, (wrong.name, wrong.text), definitions)
}

/// An error of adding a module.
pub(super) fn of_module(error: &ComposerError, name: &str, text: &str) -> Box<Diagnostic> {
    directive_error(&error.inner, (name, text), &Definitions::new())
}

/// The module that is not there, when that is what is wrong: its items are unknown to naga.
fn missing_module(error: &ComposerErrorInner, library: &Library) -> Option<Box<Diagnostic>> {
    match error {
        ComposerErrorInner::ImportNotFound(module, _) => library.missing(module),
        ComposerErrorInner::WgslParseError(parse) => {
            mangled(parse.message()).find_map(|(_, module)| library.missing(&module))
        }
        _ => None,
    }
}

/// The mangled names in a message, taken apart.
fn mangled(message: &str) -> impl Iterator<Item = (String, String)> + '_ {
    let words = message.split(|c: char| !(c.is_alphanumeric() || c == '_'));
    words.filter_map(parts)
}

/// Names items of a module that are like one that it lacks.
fn with_near_items(error: Box<Diagnostic>, message: &str, library: &Library) -> Box<Diagnostic> {
    let Some((item, module)) = mangled(message).next() else {
        return error;
    };
    let Some(file) = library.module(&module) else {
        return error;
    };
    let words = file
        .text
        .split(|c: char| !(c.is_alphanumeric() || c == '_'));
    let keywords = ["fn", "struct", "const", "override", "alias"];
    let mut declared = Vec::new();
    let mut before = "";
    for word in words.filter(|word| !word.is_empty()) {
        if keywords.contains(&before) {
            declared.push(word);
        }
        before = word;
    }
    let near = nearest(&item, declared, 3);
    match near.is_empty() {
        true => error.with_reason(format!("`{module}` is {}", file.name)),
        false => error.with_note(format!("`{module}` has {}", listed(near))),
    }
}

/// A shader def that was to be put in near a place, and is not defined.
fn undefined_definition(
    text: &str,
    place: Range<usize>,
    definitions: &Definitions,
) -> Option<(String, Range<usize>)> {
    let start = text[..place.start.min(text.len())]
        .rfind('\n')
        .map_or(0, |at| at + 1);
    let line = text[start..].lines().next()?;
    let at = line.find("#{")?;
    let name = line[at + 2..].split('}').next()?;
    let missing = !definitions.contains_key(name);
    missing.then(|| (name.to_owned(), start + at..start + at + name.len() + 3))
}

/// What is wrong with directives.
fn directive_error(
    error: &ComposerErrorInner,
    file: (&str, &str),
    definitions: &Definitions,
) -> Box<Diagnostic> {
    use ComposerErrorInner as Error;
    let text = file.1;
    let line = |at: usize| line_at(text, at);
    match error {
        Error::ImportParseError(what, at) => {
            located("cannot read an import", file, line(*at), what.clone())
                .with_note("an import reads `#import a::b` or `#import a::{b, c::d as e}`")
        }
        Error::ImportNotFound(module, at) => located(
            format!("there is no module `{module}`"),
            file,
            line(*at),
            "imported here",
        ),
        Error::NotEnoughEndIfs(at) => located(
            "an `#if` is not closed",
            file,
            line(*at),
            "the text ends here",
        )
        .with_note("put an `#endif` behind it"),
        Error::TooManyEndIfs(at) => {
            located("an `#endif` without an `#if`", file, line(*at), "here")
        }
        Error::ElseWithoutCondition(at) => {
            located("an `#else` without an `#if`", file, line(*at), "here")
        }
        Error::UnknownShaderDef {
            pos,
            shader_def_name: name,
        } => {
            let place = condition(text, name).unwrap_or_else(|| line(*pos));
            let error = located(
                format!("the shader def `{name}` has no value"),
                file,
                place,
                "compared here",
            );
            let near = nearest(name, definitions.keys().map(String::as_str), 1);
            match near.first() {
                Some(near) => error.with_note(format!("there is a `{near}`")),
                None => error,
            }
            .with_note(format!("give it one: `-D {name}=8`"))
        }
        Error::UnknownShaderDefOperator { pos, operator } => located(
            format!("`{operator}` compares no shader defs"),
            file,
            line(*pos),
            "here",
        )
        .with_note("use `==`, `!=`, `<`, `<=`, `>` or `>=`"),
        Error::InvalidShaderDefComparisonValue {
            pos,
            shader_def_name: name,
            expected,
            value,
        } => {
            let place = condition(text, name).unwrap_or_else(|| line(*pos));
            located(
                format!("the shader def `{name}` is {expected}, and is compared with `{value}`"),
                file,
                place,
                "compared here",
            )
            .with_note(format!(
                "define it as what it is compared with: `-D {name}={value}`"
            ))
        }
        Error::DefineInModule(at) => located(
            "an imported module cannot define shader defs",
            file,
            line(*at),
            "here",
        )
        .with_note("define it with `-D`, or in the file that imports the module"),
        Error::InvalidShaderDefDefinitionValue { name, value, pos } => located(
            format!("the shader def `{name}` cannot have the value `{value}`"),
            file,
            line(*pos),
            "here",
        ),
        Error::DecorationInSource(range) => located(
            "a name has a part that composing puts into names",
            file,
            range.clone(),
            "this part",
        )
        .with_note("rename it"),
        Error::OverrideNotVirtual { name, .. } => {
            let error = Diagnostic::error(format!("`{name}` is overridden and is not virtual"))
                .with_source(file.0, text);
            let error = match whole_word(text, 0..text.len(), name) {
                Some(place) => error.with_label(place, "overridden here"),
                None => error,
            };
            error.with_note("declare it as `virtual fn` where it is defined")
        }
        Error::InvalidIdentifier { original, .. } => {
            let name = parts(original).map_or_else(|| original.clone(), |(item, _)| item);
            let error = Diagnostic::error(format!("`{name}` cannot be imported under this name"))
                .with_source(file.0, text);
            let error = match whole_word(text, 0..text.len(), &name) {
                Some(place) => error.with_label(place, "declared here"),
                None => error,
            };
            error.with_note(
                "names that are imported may not end in a digit or have `__` in them: rename it",
            )
        }
        Error::InvalidWgslDirective {
            directive,
            position,
            reason,
        } => {
            // The position is a line.
            let lines = text.split_inclusive('\n').take(*position);
            let at = lines.map(str::len).sum();
            located(
                format!("cannot read the directive `{directive}`"),
                file,
                line(at),
                reason.clone(),
            )
        }
        other => Diagnostic::error(uncapitalised(&readable(&other.to_string())))
            .with_source(file.0, text),
    }
}

/// The line at an offset, without blanks around it; offsets of naga_oil drift, so that a line without anything
/// is the one before it.
fn line_at(text: &str, at: usize) -> Range<usize> {
    let mut at = at.min(text.len());
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    let start = text[..at].rfind('\n').map_or(0, |n| n + 1);
    let line = text[start..].lines().next().unwrap_or("");
    if line.trim().is_empty() && start > 0 {
        return line_at(text, start - 1);
    }
    let from = start + line.len() - line.trim_start().len();
    from..(start + line.trim_end().len()).max(from)
}

/// Where a shader def is compared.
fn condition(text: &str, name: &str) -> Option<Range<usize>> {
    let mut offset = 0;
    for line in text.split_inclusive('\n') {
        let directive = line.trim_start().starts_with('#') && line.contains("if");
        if directive && let Some(found) = whole_word(text, offset..offset + line.len(), name) {
            return Some(found);
        }
        offset += line.len();
    }
    None
}
