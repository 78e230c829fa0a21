//! The text that levels are put behind, under names that hide nothing that a level needs.

use super::print::Item;
use super::source::{Keyword, Text};
use super::{EmitLevel, file_name, flaw, read_back};
use crate::front::Source;
use crate::front::identifiers::Names;
use crate::{Diagnostic, Result};
use naga::{Module, Statement, StructMember, TypeInner};
use std::collections::{BTreeMap, BTreeSet};

/// A text with levels to be put behind it, and the module that it was parsed to.
pub(crate) struct Body<'a> {
    pub(crate) source: &'a Source,
    pub(crate) text: Text<'a>,
    pub(crate) module: &'a Module,
    /// What the text declares at module scope.
    pub(crate) declared: BTreeSet<&'a str>,
    /// Names of the levels' modules that this text has under others.
    renamed: BTreeMap<String, String>,
}

impl<'a> Body<'a> {
    fn new(
        source: &'a Source,
        text: &'a str,
        module: &'a Module,
        renamed: BTreeMap<String, String>,
    ) -> Self {
        let text = Text::new(text);
        let declared = text
            .declarations
            .iter()
            .map(|d| &text.text[d.name_span.clone()])
            .collect();
        Self {
            source,
            text,
            module,
            declared,
            renamed,
        }
    }

    /// A predeclared word, if a declaration of the text hides it.
    pub(crate) fn hides(&self, word: &str) -> Option<Hidden> {
        let hidden = self.declared.contains(word);
        hidden.then(|| Hidden(word.to_owned()))
    }

    /// The predeclared word that an item needs and a declaration of the text hides.
    pub(crate) fn hidden_from(&self, item: &Item) -> Option<Hidden> {
        let mut words = item.predeclared.iter();
        let hidden = words.find(|word| self.declared.contains(word.as_str()))?;
        Some(Hidden(hidden.clone()))
    }
}

/// A predeclared word that a level needs, and that a declaration of the text hides.
pub(crate) struct Hidden(String);

/// Makes something of the author's text. Where that cannot be, because a declaration of the author's hides
/// something predeclared that a level needs, of the text with that declaration under another name.
pub(crate) fn over_text<T>(
    source: &Source,
    make: impl Fn(&Body<'_>) -> Result<std::result::Result<T, Hidden>>,
) -> Result<T> {
    let text = Text::new(&source.text);
    let mut names = Names::default();
    names.reserve(text.words.iter().copied());
    let mut renamed: BTreeMap<String, String> = BTreeMap::new();
    let mut body = Body::new(source, &source.text, &source.module, BTreeMap::new());
    let (mut now, mut module);
    loop {
        let Hidden(word) = match make(&body)? {
            Ok(made) => return Ok(made),
            Err(hidden) => hidden,
        };
        // The host knows pipeline constants and entry points by their names.
        let entries = &source.module.entry_points;
        let declaration = text
            .declaration(&word)
            .filter(|d| d.keyword != Keyword::Override && entries.iter().all(|e| e.name != word));
        if declaration.is_none() || renamed.contains_key(&word) {
            let error = Diagnostic::error(format!(
                "`{word}` hides what WGSL calls so, which a level needs"
            ))
            .with_source(&source.name, &source.text);
            let error = match text.declaration(&word) {
                Some(d) => error.with_label(d.name_span.clone(), "declared here"),
                None => error,
            };
            return Err(error.with_note(
                "the host knows it by its name, so lodc cannot give it another: rename it",
            ));
        }
        let name = names.take(&word);
        renamed.insert(word, name);
        now = text.renamed(&renamed);
        module = read_back(&now, source)?.module;
        body = Body::new(source, &now, &module, renamed.clone());
    }
}

/// A level's module under the names of the text. What the text declares is not written again, so it needs no
/// value: naga's writer has no form for the values that pipeline constants may start with.
pub(crate) fn renamed_module(body: &Body<'_>, level: &EmitLevel) -> Module {
    let mut module = level.shader.module().clone();
    let rename = |name: &mut Option<String>| {
        if let Some(name) = name
            && let Some(now) = body.renamed.get(name)
        {
            name.clone_from(now);
        }
        name.as_deref()
            .is_some_and(|name| body.declared.contains(name))
    };
    for handle in module
        .types
        .iter()
        .map(|(handle, _)| handle)
        .collect::<Vec<_>>()
    {
        let mut ty = module.types[handle].clone();
        if ty
            .name
            .as_ref()
            .is_some_and(|name| body.renamed.contains_key(name))
        {
            rename(&mut ty.name);
            module.types.replace(handle, ty);
        }
    }
    rename_other_structs(&mut module, body);
    for entry in &mut module.entry_points {
        let body = &mut entry.function.body;
        if let Some(Statement::Return { value: None }) = body.last() {
            // Nobody writes it.
            let last = body.len() - 1;
            body.cull(last..);
        }
    }
    for (_, variable) in module.global_variables.iter_mut() {
        if rename(&mut variable.name) {
            variable.init = None;
        }
    }
    for (_, setting) in module.overrides.iter_mut() {
        if rename(&mut setting.name) {
            setting.init = None;
        }
    }
    for (_, constant) in module.constants.iter_mut() {
        // One that the text has within a function only is written as its value.
        if !rename(&mut constant.name) {
            constant.name = None;
        }
    }
    module
}

/// Gives structs of a level that are called as one of the text is, but have other members, names of their own.
fn rename_other_structs(module: &mut Module, body: &Body<'_>) {
    let handles: Vec<_> = module.types.iter().map(|(handle, _)| handle).collect();
    let mut names = Names::default();
    names.reserve(body.text.words.iter().copied());
    for handle in handles {
        let ty = &module.types[handle];
        let (TypeInner::Struct { members, .. }, Some(name)) = (&ty.inner, &ty.name) else {
            continue;
        };
        let mut authors = body.module.types.iter();
        let authors = authors.find(|(_, authors)| authors.name.as_ref() == Some(name));
        let is_other = match authors.map(|(_, authors)| &authors.inner) {
            Some(TypeInner::Struct {
                members: authors, ..
            }) => {
                let binding = |member: &StructMember| (member.name.clone(), member.binding.clone());
                !members.iter().map(binding).eq(authors.iter().map(binding))
            }
            _ => false,
        };
        if is_other {
            let mut ty = ty.clone();
            ty.name = Some(names.take(name));
            module.types.replace(handle, ty);
        }
    }
}

/// Says that a level cannot be written.
pub(crate) fn unwritable(source: &Source, reason: &str) -> Box<Diagnostic> {
    let error = Diagnostic::error(format!(
        "internal error: {} cannot be written: {reason}",
        file_name(source)
    ));
    flaw(error, source)
}
