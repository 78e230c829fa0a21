//! A level as a file of its own: the author's declarations that it needs, and its entry points.

use super::body::{Body, Hidden, over_text, renamed_module, unwritable};
use super::lock::FORMAT;
use super::print::{Owner, Printed, Wishes, print, value_name};
use super::source::{Keyword, Text};
use super::splice::{sentence, with_line_ends};
use super::tokens::words;
use super::{EmitLevel, file_name};
use crate::Result;
use crate::front::Source;
use crate::front::identifiers::Names;
use lodc_passes::shader::Stage;
use std::collections::BTreeSet;

/// A level as a module of its own, with the author's names.
pub(crate) fn alone(
    source: &Source,
    number: usize,
    level: &EmitLevel,
    stem: &str,
) -> Result<String> {
    over_text(source, |body| written_alone(body, number, level, stem))
}

/// A level's entry points with the declarations of the text that they need, as they stand there.
fn written_alone(
    body: &Body<'_>,
    number: usize,
    level: &EmitLevel,
    stem: &str,
) -> Result<std::result::Result<String, Hidden>> {
    let (source, text) = (body.source, &body.text);
    let module = renamed_module(body, level);
    let entries: BTreeSet<&str> = module
        .entry_points
        .iter()
        .map(|e| e.name.as_str())
        .collect();
    let mut taken = Names::default();
    taken.reserve(text.words.iter().copied());
    let printed = print(
        &module,
        &Wishes {
            keep: &|name| body.declared.contains(name),
            taken: &taken,
            outside: &Names::default(),
            value: &|owner, value| {
                let Owner::EntryPoint(entry) = owner else {
                    return None;
                };
                let stages = [Stage::Vertex, Stage::Fragment, Stage::Parameter];
                let stage = stages
                    .into_iter()
                    .find(|stage| level.shader.index(*stage) == Some(entry))?;
                value_name(&level.shader, stage, value)
            },
            short_types: text.uses_short_types(),
        },
    )
    .map_err(|reason| unwritable(source, &reason))?;

    // Pipeline constants stay, used or not: a host that sets one that is not there gets an error.
    let mut wanted: Vec<&str> = text
        .declarations
        .iter()
        .filter(|d| d.keyword == Keyword::Override)
        .map(|d| d.name.as_str())
        .chain(entries.iter().copied())
        // The parameter stage may have had to give its name away.
        .chain(
            (printed.items.iter())
                .filter(|item| item.text.starts_with("@compute"))
                .map(|item| item.name.as_str()),
        )
        .collect();
    let own = |name: &str| text.declaration(name).filter(|_| !entries.contains(name));
    let mut needed = BTreeSet::new();
    while let Some(name) = wanted.pop() {
        if !needed.insert(name) {
            continue;
        }
        if let Some(declaration) = own(name) {
            let words = words(&text.text[declaration.span.clone()]);
            wanted.extend(words.into_iter().filter(|word| own(word).is_some()));
        } else if let Some(item) = printed.items.iter().find(|item| item.name == name) {
            if let Some(hidden) = body.hidden_from(item) {
                return Ok(Err(hidden));
            }
            wanted.extend(
                item.uses
                    .iter()
                    .chain(&item.predeclared)
                    .map(String::as_str),
            );
        }
    }
    let mut items: Vec<(Keyword, String)> = Vec::new();
    for declaration in text
        .declarations
        .iter()
        .filter(|d| !entries.contains(d.name.as_str()))
    {
        if needed.contains(declaration.name.as_str()) {
            let span = declaration.span.clone();
            items.push((
                declaration.keyword,
                format!("{}\n", text.text[span].replace("\r\n", "\n")),
            ));
        }
    }
    for item in printed
        .items
        .iter()
        .filter(|item| own(&item.name).is_none())
    {
        if needed.contains(item.name.as_str()) {
            let attribute = text
                .derivative_attribute()
                .filter(|_| item.text.starts_with("@fragment"))
                .map_or(String::new(), |attribute| format!("{attribute}\n"));
            items.push((item.keyword, format!("{attribute}{}", item.text)));
        }
    }
    let header = format!(
        "// Level {number} of {}, by lodc (lock format {FORMAT}). Made from {}.lod.toml: change that, not this.\n\
         // From autoLOD {:.2} on. {}\n\n",
        file_name(source),
        stem,
        level.autolod,
        sentence(&level.says),
    );
    let items: Vec<(Keyword, &str)> = items.iter().map(|(k, text)| (*k, text.as_str())).collect();
    let written = assembled(&header, &directives(text, &printed), &items);
    Ok(Ok(with_line_ends(written, text.line_end)))
}

/// Directives of the author's, then those that the writer asks for beside them.
fn directives(author: &Text<'_>, printed: &Printed) -> Vec<String> {
    let mut all: Vec<String> = author.directives.iter().map(|d| (*d).to_owned()).collect();
    for directive in &printed.directives {
        if !all.contains(directive) {
            all.push(directive.clone());
        }
    }
    all
}

/// A module's text from its parts: blank lines around what takes several lines.
pub(crate) fn assembled(header: &str, directives: &[String], items: &[(Keyword, &str)]) -> String {
    let mut out = header.to_owned();
    for directive in directives {
        out.push_str(directive);
        out.push('\n');
    }
    let mut before: Option<(Keyword, bool)> = None;
    for (keyword, text) in items {
        let is_long = text.trim_end().contains('\n');
        let apart = match before {
            None => !directives.is_empty(),
            Some((kind, was_long)) => was_long || is_long || kind != *keyword,
        };
        if apart {
            out.push('\n');
        }
        out.push_str(text);
        before = Some((*keyword, is_long));
    }
    out
}
