//! Puts levels behind the author's text, and an entry point that chooses among them.

use super::body::{Body, Hidden, over_text, renamed_module, unwritable};
use super::control::Control;
use super::lock::FORMAT;
use super::print::{Item, Owner, Printed, Wishes, print, value_name};
use super::{EmitLevel, Form, file_name, flaw};
use crate::front::Source;
use crate::front::identifiers::{Names, in_words};
use crate::{Diagnostic, Result};
use lodc_passes::shader::Stage;
use std::collections::BTreeSet;
use std::fmt::Write;

/// The author's text with its levels.
pub(crate) struct Spliced {
    pub(crate) text: String,
    /// Whether a level is chosen by a pipeline constant.
    pub(crate) by_override: bool,
}

/// The author's text, with the fragment entry point replaced by one that chooses among it and the levels.
pub(crate) fn splice(
    source: &Source,
    levels: &[EmitLevel],
    form: Form,
    stem: &str,
) -> Result<Spliced> {
    over_text(source, |body| spliced(body, levels, form, stem))
}

fn spliced(
    body: &Body<'_>,
    levels: &[EmitLevel],
    form: Form,
    stem: &str,
) -> Result<std::result::Result<Spliced, Hidden>> {
    let (source, text) = (body.source, &body.text);
    let mut names = Names::default();
    names.reserve(text.words.iter().copied());
    let control = Control::new(body, form, &mut names)?;
    let mut out = header(source, levels, stem);
    let line_break = |out: &mut String| {
        if !out.is_empty() && !out.ends_with('\n') {
            out.push_str(text.line_end);
        }
    };
    if levels.is_empty() {
        out.push_str(text.text);
        line_break(&mut out);
        if let Some(declaration) = &control.declaration {
            write!(out, "\n{declaration}").ok();
        }
        return Ok(Ok(Spliced {
            text: with_line_ends(out, text.line_end),
            by_override: control.by_override,
        }));
    }
    let Some(signature) = text.signature(&source.fragment) else {
        return Err(Diagnostic::error(format!(
            "`{}` is no function of {}",
            source.fragment, source.name
        )));
    };
    let original = names.take(&format!("original_{}", source.fragment));
    let functions: Vec<String> = (1..=levels.len())
        .map(|level| names.take(&format!("lod_{}_{}", in_words(level), source.fragment)))
        .collect();

    out.push_str(&signature.demoted(text, &original));
    line_break(&mut out);
    if let Some(declaration) = &control.declaration {
        write!(out, "\n{declaration}").ok();
    }
    let (head, arguments) = signature.with_parameters(text, |name| {
        (name == control.root).then(|| names.take(name))
    });
    let arguments = arguments.join(", ");
    write!(out, "\n{head} {{\n").ok();
    let all: Vec<&String> = std::iter::once(&original).chain(&functions).collect();
    for (function, next) in all.iter().zip(levels) {
        let call = format!("{function}({arguments})");
        let body = if signature.returns {
            format!("return {call};")
        } else {
            format!("{call}; return;")
        };
        writeln!(
            out,
            "    if !({} >= {:?}) {{ {body} }}",
            control.value, next.autolod
        )
        .ok();
    }
    let result = if signature.returns { "return " } else { "" };
    writeln!(out, "    {result}{}({arguments});\n}}", all[levels.len()]).ok();

    let mut extra: Vec<Item> = Vec::new();
    let attribute = text
        .derivative_attribute()
        .map_or(String::new(), |a| format!("{a}\n"));
    for (at, (level, function)) in levels.iter().zip(&functions).enumerate() {
        let printed = level_function(body, level, function, &names)?;
        let mut wanted = vec![function.clone()];
        let mut done = BTreeSet::new();
        let mut behind = Vec::new();
        while let Some(name) = wanted.pop() {
            let Some(item) = printed.items.iter().find(|item| item.name == name) else {
                continue;
            };
            if body.declared.contains(&*name) || !done.insert(name.clone()) {
                continue;
            }
            if let Some(hidden) = body.hidden_from(item) {
                return Ok(Err(hidden));
            }
            wanted.extend(item.uses.iter().cloned());
            wanted.extend(
                item.predeclared
                    .iter()
                    .filter(|word| word.starts_with("_naga"))
                    .cloned(),
            );
            if name == *function {
                let says = sentence(&level.says);
                write!(
                    out,
                    "\n// Level {}. {says}\n{attribute}{}",
                    at + 1,
                    item.text
                )
                .ok();
            } else if !extra.iter().any(|have| have.text == item.text) {
                behind.push(item.clone());
            }
        }
        names.reserve(behind.iter().map(|item| item.name.as_str()));
        behind.sort_by(|a, b| a.name.cmp(&b.name));
        extra.extend(behind);
    }
    for item in &extra {
        write!(out, "\n{}", item.text).ok();
    }
    Ok(Ok(Spliced {
        text: with_line_ends(out, text.line_end),
        by_override: control.by_override,
    }))
}

/// The function of a level, written with what it needs.
fn level_function(
    body: &Body<'_>,
    level: &EmitLevel,
    name: &str,
    names: &Names,
) -> Result<Printed> {
    let mut module = renamed_module(body, level);
    let Some(entry) = level.shader.index(Stage::Fragment) else {
        let error = Diagnostic::error("internal error: a level has no fragment entry point");
        return Err(flaw(error, body.source));
    };
    let mut function = module.entry_points.swap_remove(entry).function;
    module.entry_points.clear();
    for argument in &mut function.arguments {
        argument.binding = None;
    }
    if let Some(result) = &mut function.result {
        result.binding = None;
    }
    function.name = Some(name.to_owned());
    let handle = module.functions.append(function, naga::Span::UNDEFINED);
    let mut outside = Names::default();
    outside.reserve(body.declared.iter().copied());
    print(
        &module,
        &Wishes {
            keep: &|wish| wish == name || body.declared.contains(wish),
            taken: names,
            outside: &outside,
            value: &|owner, value| {
                let is_own = owner == Owner::Function(handle);
                is_own.then(|| value_name(&level.shader, Stage::Fragment, value))?
            },
            short_types: body.text.uses_short_types(),
        },
    )
    .map_err(|reason| unwritable(body.source, &reason))
}

/// The comment at the top: a function of the levels and the file's name alone.
fn header(source: &Source, levels: &[EmitLevel], stem: &str) -> String {
    let mut out = format!(
        "// Levels of detail of {}, by lodc (lock format {FORMAT}). Made from {}.lod.toml: change that, not this.\n\
         // level  autoLOD  error  cost  what changed\n\
         // 0      0.00     -      1.00  the original\n",
        file_name(source),
        stem,
    );
    for (at, level) in levels.iter().enumerate() {
        writeln!(
            out,
            "// {:<5}  {:<7.2}  {:.3}  {:.2}  {}",
            at + 1,
            level.autolod,
            level.error,
            level.cost,
            one_line(&level.says)
        )
        .ok();
    }
    out.push('\n');
    out
}

/// A text without line breaks, which would end the comment that it stands in.
fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// With a capital letter in front and a full stop behind.
pub(crate) fn sentence(says: &str) -> String {
    let says = one_line(says);
    let mut letters = says.chars();
    match letters.next() {
        // A name keeps its letters.
        Some(first)
            if says
                .split(' ')
                .next()
                .is_some_and(|word| !word.contains(['_', '.'])) =>
        {
            format!("{}{}.", first.to_uppercase(), letters.as_str())
        }
        Some(_) => format!("{says}."),
        None => String::new(),
    }
}

/// Generated line ends made those of the author's text. Text of the author's has its own already.
pub(crate) fn with_line_ends(text: String, line_end: &str) -> String {
    if line_end == "\n" {
        return text;
    }
    let mut out = String::with_capacity(text.len() + text.len() / 32);
    let mut before = ' ';
    for c in text.chars() {
        if c == '\n' && before != '\r' {
            out.push('\r');
        }
        out.push(c);
        before = c;
    }
    out
}
