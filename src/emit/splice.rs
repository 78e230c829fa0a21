//! Puts levels behind the author's text, or each into a file of its own.

use super::lock::FORMAT;
use super::names::{Names, in_words, is_predeclared};
use super::print::{Item, Owner, Printed, Wishes, print, value_name};
use super::source::{Keyword, Text};
use super::{EmitLevel, Form, file_name, flaw, read_back, stem, tidy};
use crate::front::Source;
use crate::{Diagnostic, Result};
use lodc_passes::shader::Stage;
use naga::{AddressSpace, Module, Scalar, StorageAccess, TypeInner};
use std::collections::BTreeSet;
use std::fmt::Write;

/// The author's text with its levels.
pub(crate) struct Spliced {
    pub(crate) text: String,
    /// Whether a level is chosen by a pipeline constant.
    pub(crate) by_override: bool,
}

/// The author's text, with the fragment entry point replaced by one that chooses among it and the levels.
pub(crate) fn splice(source: &Source, levels: &[EmitLevel], form: Form) -> Result<Spliced> {
    let text = Text::new(&source.text);
    match spliced(source, &text, &source.module, levels, form)? {
        Some(spliced) => Ok(spliced),
        None => {
            // A declaration of the author's hides something predeclared that a level needs. In a text of our
            // own it gets another name.
            let (composed, module) = composed(source)?;
            let text = Text::new(&composed);
            spliced(source, &text, &module, levels, form)?.ok_or_else(|| {
                flaw(
                    Diagnostic::error("internal error: names still clash in a composed module"),
                    source,
                )
            })
        }
    }
}

/// The whole source as one module in which nothing hides what is predeclared.
fn composed(source: &Source) -> Result<(String, Module)> {
    let kept: BTreeSet<&str> = source
        .module
        .entry_points
        .iter()
        .map(|entry| entry.name.as_str())
        .chain(
            source
                .module
                .overrides
                .iter()
                .filter_map(|(_, o)| o.name.as_deref()),
        )
        .collect();
    let printed = print(
        &source.module,
        &Wishes {
            keep: &|name| kept.contains(name),
            taken: &Names::default(),
            outside: &Names::default(),
            value: &|_, _| None,
            short_types: uses_short_types(&Text::new(&source.text)),
        },
    )
    .map_err(|reason| unwritable(source, &reason))?;
    let author = Text::new(&source.text);
    let text = assembled(
        "",
        &directives(&author, &printed),
        &printed.items.iter().collect::<Vec<_>>(),
    );
    let module = read_back(&text, source)?.module;
    Ok((text, module))
}

/// `None` when a declaration of the text hides something predeclared that a level needs.
fn spliced(
    source: &Source,
    text: &Text<'_>,
    module: &Module,
    levels: &[EmitLevel],
    form: Form,
) -> Result<Option<Spliced>> {
    let mut names = Names::default();
    names.reserve(text.words.iter().copied());
    let control = Control::new(source, text, module, form, &mut names)?;
    let mut out = header(source, levels);
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
        return Ok(Some(Spliced {
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

    let declared: BTreeSet<&str> = text.declarations.iter().map(|d| d.name.as_str()).collect();
    let mut extra: Vec<Item> = Vec::new();
    let attribute = text
        .derivative_attribute()
        .map_or(String::new(), |a| format!("{a}\n"));
    for (at, (level, function)) in levels.iter().zip(&functions).enumerate() {
        let printed = level_function(source, text, level, function, &declared, &mut names)?;
        let mut wanted = vec![function.clone()];
        let mut done = BTreeSet::new();
        let mut behind = Vec::new();
        while let Some(name) = wanted.pop() {
            let Some(item) = printed.items.iter().find(|item| item.name == name) else {
                continue;
            };
            if declared.contains(&*name) || !done.insert(name.clone()) {
                continue;
            }
            if item
                .predeclared
                .iter()
                .any(|word| declared.contains(word.as_str()))
            {
                return Ok(None);
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
    Ok(Some(Spliced {
        text: with_line_ends(out, text),
        by_override: control.by_override,
    }))
}

/// The function of a level, written with what it needs.
fn level_function(
    source: &Source,
    text: &Text<'_>,
    level: &EmitLevel,
    name: &str,
    declared: &BTreeSet<&str>,
    names: &mut Names,
) -> Result<Printed> {
    let mut module = level.shader.module().clone();
    let Some(entry) = level.shader.index(Stage::Fragment) else {
        return Err(Diagnostic::error(
            "internal error: a level has no fragment entry point",
        ));
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
    module.functions.append(function, naga::Span::UNDEFINED);
    // Constants within functions have names too, but not at module scope.
    let texts_own = |name: &str| declared.contains(name);
    for (_, constant) in module.constants.iter_mut() {
        constant.name.take_if(|name| !texts_own(name));
    }
    let mut outside = Names::default();
    outside.reserve(declared.iter().copied());
    print(
        &module,
        &Wishes {
            keep: &|wish| wish == name || texts_own(wish),
            taken: names,
            outside: &outside,
            value: &|_, value| value_name(&level.shader, Stage::Fragment, value),
            short_types: uses_short_types(text),
        },
    )
    .map_err(|reason| unwritable(source, &reason))
}

/// A level as a module of its own, with the author's names.
pub(crate) fn alone(source: &Source, number: usize, level: &EmitLevel) -> Result<String> {
    let text = Text::new(&source.text);
    let declared: BTreeSet<&str> = text.declarations.iter().map(|d| d.name.as_str()).collect();
    let module = level.shader.module();
    let entries: BTreeSet<&str> = module
        .entry_points
        .iter()
        .map(|e| e.name.as_str())
        .collect();
    let settings: BTreeSet<&str> = module
        .overrides
        .iter()
        .filter_map(|(_, o)| o.name.as_deref())
        .collect();
    let fragment = level.shader.index(Stage::Fragment);
    let mut taken = Names::default();
    taken.reserve(text.words.iter().copied());
    let printed = print(
        module,
        &Wishes {
            keep: &|name| {
                entries.contains(name)
                    || settings.contains(name)
                    || (declared.contains(name) && !is_predeclared(name))
            },
            taken: &taken,
            outside: &Names::default(),
            value: &|owner, value| {
                let stage = if owner == Owner::EntryPoint(fragment?) {
                    Stage::Fragment
                } else {
                    Stage::Vertex
                };
                value_name(&level.shader, stage, value)
            },
            short_types: uses_short_types(&text),
        },
    )
    .map_err(|reason| unwritable(source, &reason))?;

    // Pipeline constants stay, used or not: a host that sets one that is not there gets an error.
    let mut wanted: Vec<String> = printed
        .items
        .iter()
        .filter(|item| item.keyword == Keyword::Override || entries.contains(item.name.as_str()))
        .map(|item| item.name.clone())
        .collect();
    let mut used = BTreeSet::new();
    while let Some(name) = wanted.pop() {
        if let Some(item) = printed.items.iter().find(|item| item.name == name)
            && used.insert(name)
        {
            wanted.extend(item.uses.iter().cloned());
            wanted.extend(item.predeclared.iter().cloned());
        }
    }
    let mut items: Vec<Item> = printed
        .items
        .iter()
        .filter(|item| used.contains(&item.name))
        .cloned()
        .collect();
    if let Some(attribute) = text.derivative_attribute() {
        for item in items
            .iter_mut()
            .filter(|item| item.text.starts_with("@fragment"))
        {
            item.text = format!("{attribute}\n{}", item.text);
        }
    }
    let header = format!(
        "// Level {number} of {}, by lodc (lock format {FORMAT}). Made from {}.lod.toml: change that, not this.\n\
         // From autoLOD {:.2} on. {}\n\n",
        file_name(source),
        stem(source),
        level.autolod,
        sentence(&level.says),
    );
    let text_of_level = assembled(
        &header,
        &directives(&text, &printed),
        &items.iter().collect::<Vec<_>>(),
    );
    Ok(with_line_ends(text_of_level, &text))
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
fn assembled(header: &str, directives: &[String], items: &[&Item]) -> String {
    let mut out = header.to_owned();
    for directive in directives {
        out.push_str(directive);
        out.push('\n');
    }
    let is_long = |item: &Item| item.text.trim_end().contains('\n');
    for (at, item) in items.iter().enumerate() {
        let before = at.checked_sub(1).map(|before| items[before]);
        let apart = match before {
            None => !directives.is_empty(),
            Some(before) => is_long(before) || is_long(item) || before.keyword != item.keyword,
        };
        if apart {
            out.push('\n');
        }
        out.push_str(&item.text);
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

/// Whether types are written `vec3f`: unless the author writes `vec3<f32>`.
fn uses_short_types(text: &Text<'_>) -> bool {
    !text.words.iter().any(|word| tidy::is_generic(word))
}

/// The comment at the top: a function of the levels and the file's name alone.
fn header(source: &Source, levels: &[EmitLevel]) -> String {
    let mut out = format!(
        "// Levels of detail of {}, by lodc (lock format {FORMAT}). Made from {}.lod.toml: change that, not this.\n\
         // level  autoLOD  error  cost  what changed\n\
         // 0      0.00     -      1.00  the original\n",
        file_name(source),
        stem(source),
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
    fn new(
        source: &Source,
        text: &Text<'_>,
        module: &Module,
        form: Form,
        names: &mut Names,
    ) -> Result<Self> {
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
