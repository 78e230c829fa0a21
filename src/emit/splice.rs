//! Puts levels behind the author's text, or each into a file of its own.

use super::lock::FORMAT;
use super::names::{Names, in_words, is_predeclared};
use super::print::{Item, Owner, Printed, Wishes, print, value_name};
use super::source::{Keyword, Text};
use super::tokens::words;
use super::{EmitLevel, Form, file_name, flaw, read_back};
use crate::front::Source;
use crate::{Diagnostic, Result};
use lodc_passes::shader::Stage;
use naga::{AddressSpace, Module, Scalar, StorageAccess, TypeInner};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

/// The author's text with its levels.
pub(crate) struct Spliced {
    pub(crate) text: String,
    /// Whether a level is chosen by a pipeline constant.
    pub(crate) by_override: bool,
}

/// A text with levels to be put behind it, and the module that it was parsed to.
struct Body<'a> {
    source: &'a Source,
    text: Text<'a>,
    module: &'a Module,
    declared: BTreeSet<&'a str>,
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
        // The names borrow from the text itself, which outlives what was read of it.
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

    /// The predeclared word that an item needs and a declaration of the text hides.
    fn hidden_from(&self, item: &Item) -> Option<Hidden> {
        let mut words = item.predeclared.iter();
        let hidden = words.find(|word| self.declared.contains(word.as_str()))?;
        Some(Hidden(hidden.clone()))
    }
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

/// A level as a module of its own, with the author's names.
pub(crate) fn alone(
    source: &Source,
    number: usize,
    level: &EmitLevel,
    stem: &str,
) -> Result<String> {
    over_text(source, |body| written_alone(body, number, level, stem))
}

/// A predeclared word that a level needs, and that a declaration of the text hides.
struct Hidden(String);

/// Makes something of the author's text. Where that cannot be, because a declaration of the author's hides
/// something predeclared that a level needs, of the text with that declaration under another name.
fn over_text<T>(
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
            text: with_line_ends(out, text),
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
        text: with_line_ends(out, text),
        by_override: control.by_override,
    }))
}

/// A level's module under the names of the text. What the text declares is not written again, so it needs no
/// value: naga's writer has no form for the values that pipeline constants may start with.
fn renamed_module(body: &Body<'_>, level: &EmitLevel) -> Module {
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
    let fragment = level.shader.index(Stage::Fragment);
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
                let is_fragment = Some(entry) == fragment;
                let stage = if is_fragment {
                    Stage::Fragment
                } else {
                    Stage::Vertex
                };
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
    Ok(Ok(with_line_ends(written, text)))
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
fn assembled(header: &str, directives: &[String], items: &[(Keyword, &str)]) -> String {
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

fn unwritable(source: &Source, reason: &str) -> Box<Diagnostic> {
    let error = Diagnostic::error(format!(
        "internal error: {} cannot be written: {reason}",
        file_name(source)
    ));
    flaw(error, source)
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
fn sentence(says: &str) -> String {
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
fn with_line_ends(text: String, author: &Text<'_>) -> String {
    if author.line_end == "\n" {
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

/// Where a level is chosen by.
struct Control {
    /// The expression that reads it.
    value: String,
    /// The name at module scope that the expression starts with.
    root: String,
    /// What has to be declared for it.
    declaration: Option<String>,
    by_override: bool,
}

/// The name that the host knows.
const NAME: &str = "autoLOD";

impl Control {
    fn new(body: &Body<'_>, form: Form, names: &mut Names) -> Result<Self> {
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
                Self {
                    value: format!("{variable}.{NAME}"),
                    declaration: Some(format!(
                        "// Halvings of scale on screen since the nearest view; 0 is the original.\n\
                         struct {ty} {{\n    @size(16) {NAME}: f32,\n}}\n\
                         @group({group}) @binding({binding}) var<uniform> {variable}: {ty};\n"
                    )),
                    root: variable,
                    by_override: false,
                }
            }
        })
    }

    /// The author's own autoLOD: a pipeline constant, or a member of something that the host fills.
    fn own(module: &Module) -> Option<Self> {
        let is_number =
            |ty: naga::Handle<naga::Type>| module.types[ty].inner == TypeInner::Scalar(Scalar::F32);
        let found = |value: String, root: &str, by_override| {
            Some(Self {
                value,
                root: root.to_owned(),
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
fn free_binding(module: &Module) -> (u32, u32) {
    module
        .global_variables
        .iter()
        .filter_map(|(_, variable)| variable.binding)
        .map(|binding| (binding.group, binding.binding))
        .max()
        .map_or((0, 0), |(group, binding)| (group, binding + 1))
}
