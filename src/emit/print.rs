//! Writes a naga module as WGSL under its own names.
//!
//! naga's writer renames what ends in a digit, repeats, or has two underscores. So everything that has a name
//! is given a placeholder of letters alone, the writer writes those, and the intended names are put back word
//! by word. Values that the writer numbers (`_e17`) get readable names on the way.

use super::lines;
use super::source::{Keyword, Text};
use super::tidy::{Style, tidy, with_short_types};
use super::tokens::{Kind, tokens, words};
use crate::front;
use crate::front::identifiers::{Names, letters};
use crate::front::settle::predeclared;
use lodc_passes::shader::Stage;
use naga::back::wgsl::WriterFlags;
use naga::proc::Layouter;
use naga::{AddressSpace, Expression, Function, Handle, Module, Type, TypeInner};
use std::collections::{BTreeMap, BTreeSet};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// A declaration of a written module.
#[derive(Clone, Debug)]
pub(crate) struct Item {
    pub(crate) keyword: Keyword,
    pub(crate) name: String,
    /// Its text, ending in a line end.
    pub(crate) text: String,
    /// The words that mean something predeclared.
    pub(crate) predeclared: BTreeSet<String>,
    /// The declarations of the same module that it names.
    pub(crate) uses: BTreeSet<String>,
}

/// A written module.
#[derive(Clone, Debug, Default)]
pub(crate) struct Printed {
    /// `enable` directives that it needs.
    pub(crate) directives: Vec<String>,
    /// Its declarations, in the writer's order.
    pub(crate) items: Vec<Item>,
}

/// A function of a module.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Owner {
    Function(Handle<Function>),
    EntryPoint(usize),
}

/// How things are to be called.
pub(crate) struct Wishes<'a> {
    /// Names at module scope that stay as they are.
    pub(crate) keep: &'a dyn Fn(&str) -> bool,
    /// Names that nothing else at module scope may take.
    pub(crate) taken: &'a Names,
    /// Names at module scope outside of the module: what is local may not hide them.
    pub(crate) outside: &'a Names,
    /// A name for a value that has none of its own.
    pub(crate) value: &'a dyn Fn(Owner, Handle<Expression>) -> Option<String>,
    /// Whether types are written `vec3f`.
    pub(crate) short_types: bool,
}

/// Writes a module.
///
/// # Errors
/// What naga's validator or writer says, as one line; the module has a flaw then, or uses what WGSL has not.
pub(crate) fn print(module: &Module, wishes: &Wishes<'_>) -> Result<Printed, String> {
    let mut module = module.clone();
    let mut labels = Labels::default();
    let mut taken = wishes.taken.clone();
    let mut locals = wishes.outside.clone();
    let mut global = |wish: Option<&str>, fallback: &str| -> String {
        let name = match wish {
            Some(name) if (wishes.keep)(name) => name.to_owned(),
            _ => taken.take(wish.unwrap_or(fallback)),
        };
        taken.reserve([name.as_str()]);
        locals.reserve([name.as_str()]);
        name
    };

    let padding = padding(&module);
    label_types(&mut module, &mut labels, &padding, &mut global);
    for (_, variable) in module.global_variables.iter_mut() {
        variable.name = Some(labels.add(global(variable.name.as_deref(), "binding")));
    }
    for (_, constant) in module.constants.iter_mut() {
        if let Some(name) = &mut constant.name {
            *name = labels.add(global(Some(name), "constant"));
        }
    }
    for (_, constant) in module.overrides.iter_mut() {
        constant.name = Some(labels.add(global(constant.name.as_deref(), "setting")));
    }
    for (_, function) in module.functions.iter_mut() {
        function.name = Some(labels.add(global(function.name.as_deref(), "main")));
    }
    for entry in &mut module.entry_points {
        entry.name = labels.add(global(Some(&entry.name), "entry"));
    }

    let info = front::validate(&module).map_err(|error| {
        let inner = error.as_inner();
        match std::error::Error::source(inner) {
            Some(reason) => format!("{inner}: {reason}"),
            None => inner.to_string(),
        }
    })?;
    let mut scopes = Vec::new();
    let mut owners = BTreeMap::new();
    let handles: Vec<_> = module.functions.iter().map(|(handle, _)| handle).collect();
    let all = (handles.into_iter().map(Owner::Function))
        .chain((0..module.entry_points.len()).map(Owner::EntryPoint));
    for owner in all {
        let plan = match owner {
            Owner::Function(handle) => {
                lines::plan(&module, &module.functions[handle], &info[handle])
            }
            Owner::EntryPoint(i) => lines::plan(
                &module,
                &module.entry_points[i].function,
                info.get_entry_point(i),
            ),
        };
        let (function, label) = match owner {
            Owner::Function(handle) => {
                let function = module.functions.get_mut(handle);
                let label = function.name.clone().unwrap_or_default();
                (function, label)
            }
            Owner::EntryPoint(i) => {
                let entry = &mut module.entry_points[i];
                (&mut entry.function, entry.name.clone())
            }
        };
        owners.insert(label, scopes.len());
        scopes.push(Scope::new(owner, function, plan, &locals, &mut labels));
    }
    // naga's writer panics on what WGSL has no form for, such as ray queries.
    let written = catch_unwind(AssertUnwindSafe(|| {
        naga::back::wgsl::write_string(&module, &info, WriterFlags::empty())
    }))
    .map_err(|_| "naga's writer has no WGSL for something in it".to_owned())?
    .map_err(|e| e.to_string())?;

    let text = Text::new(&written);
    let mut printed = Printed {
        directives: text.directives.iter().map(|d| (*d).to_owned()).collect(),
        items: Vec::new(),
    };
    for declaration in &text.declarations {
        let raw = &written[declaration.span.clone()];
        let mut scope = owners
            .get(&declaration.name)
            .and_then(|at| scopes.get_mut(*at));
        if let Some(scope) = &mut scope {
            let used = words(raw)
                .into_iter()
                .filter(|word| !labels.names.contains_key(*word));
            scope.predeclared = used.map(str::to_owned).collect();
        }
        let tidied = match &scope {
            Some(scope) => scope.tidied(raw, wishes.short_types),
            None if wishes.short_types => with_short_types(raw),
            None => raw.to_owned(),
        };
        let mut item = labels.put_back(&tidied, scope, wishes);
        item.keyword = declaration.keyword;
        item.name = labels
            .names
            .get(&declaration.name)
            .unwrap_or(&declaration.name)
            .clone();
        printed.items.push(item);
    }
    Ok(printed)
}

/// The members of structs in the host's buffers that take more bytes than WGSL gives them, with those bytes: the
/// writer leaves out what the author, or another language, says of a struct's layout.
fn padding(module: &Module) -> BTreeMap<(Handle<Type>, usize), u32> {
    let mut padding = BTreeMap::new();
    let mut layouter = Layouter::default();
    if layouter.update(module.to_ctx()).is_err() {
        // The validator says what is wrong.
        return padding;
    }
    let mut seen = BTreeSet::new();
    let mut wanted: Vec<Handle<Type>> = module
        .global_variables
        .iter()
        .filter(|(_, variable)| {
            matches!(
                variable.space,
                AddressSpace::Uniform | AddressSpace::Storage { .. } | AddressSpace::Immediate
            )
        })
        .map(|(_, variable)| variable.ty)
        .collect();
    while let Some(ty) = wanted.pop() {
        if !seen.insert(ty) {
            continue;
        }
        match &module.types[ty].inner {
            TypeInner::Array { base, .. } | TypeInner::BindingArray { base, .. } => {
                wanted.push(*base);
            }
            TypeInner::Struct { members, span } => {
                wanted.extend(members.iter().map(|member| member.ty));
                for (at, member) in members.iter().enumerate() {
                    let size = module.types[member.ty].inner.size(module.to_ctx());
                    let end = member.offset + size;
                    let (natural, next) = match members.get(at + 1) {
                        Some(next) => (layouter[next.ty].alignment.round_up(end), next.offset),
                        None => (layouter[ty].alignment.round_up(end), *span),
                    };
                    if next > natural {
                        padding.insert((ty, at), next - member.offset);
                    }
                }
            }
            _ => {}
        }
    }
    padding
}

/// Gives structs and their members placeholders. Predeclared ones keep their members' names.
fn label_types(
    module: &mut Module,
    labels: &mut Labels,
    padding: &BTreeMap<(Handle<Type>, usize), u32>,
    global: &mut dyn FnMut(Option<&str>, &str) -> String,
) {
    let predeclared = predeclared(module);
    let handles: Vec<_> = module.types.iter().map(|(handle, _)| handle).collect();
    for handle in handles {
        let mut ty = module.types[handle].clone();
        let TypeInner::Struct { members, .. } = &mut ty.inner else {
            continue;
        };
        if predeclared.contains(&handle) {
            continue;
        }
        ty.name = Some(labels.add(global(ty.name.as_deref(), "Block")));
        let mut used = Names::default();
        for (at, member) in members.iter_mut().enumerate() {
            let name = member.name.as_deref().unwrap_or("member");
            let name = used.take_member(name);
            let label = labels.add(name);
            if let Some(bytes) = padding.get(&(handle, at)) {
                labels.sizes.insert(label.clone(), *bytes);
            }
            member.name = Some(label);
        }
        module.types.replace(handle, ty);
    }
}

/// Placeholders and the names that they stand for.
#[derive(Default)]
struct Labels {
    names: BTreeMap<String, String>,
    /// The bytes of members that take more than WGSL gives them.
    sizes: BTreeMap<String, u32>,
}

impl Labels {
    fn add(&mut self, name: String) -> String {
        let label = format!("lodq{}q", letters(self.names.len()));
        self.names.insert(label.clone(), name);
        label
    }

    /// The text with names in the place of placeholders and numbers.
    fn put_back(&self, text: &str, mut scope: Option<&mut Scope>, wishes: &Wishes<'_>) -> Item {
        let mut out = String::with_capacity(text.len());
        let mut uses = BTreeSet::new();
        let mut predeclared = BTreeSet::new();
        // Neither members nor attributes are looked up among declarations.
        let mut after_point = false;
        let mut after_at = false;
        let mut in_attribute = false;
        for token in tokens(text) {
            let word = &text[token.span];
            if token.kind != Kind::Word {
                after_point = word == ".";
                in_attribute = (in_attribute && word != ")") || (after_at && word == "(");
                after_at = word == "@";
                out.push_str(word);
                continue;
            }
            let local = scope.as_mut().and_then(|scope| scope.name(word, wishes));
            match (local, self.names.get(word)) {
                (Some(name), _) => out.push_str(&name),
                (None, Some(name)) => {
                    if !after_point {
                        uses.insert(name.clone());
                    }
                    // Outside of functions a member is named where it is declared alone.
                    if let (None, Some(bytes)) = (&scope, self.sizes.get(word)) {
                        out.push_str(&format!("@size({bytes}) "));
                    }
                    out.push_str(name);
                }
                (None, None) => {
                    if !(after_point || after_at || in_attribute) {
                        predeclared.insert(word.to_owned());
                    }
                    out.push_str(word);
                }
            }
            after_point = false;
        }
        // The writer leaves a blank behind attributes.
        let mut text = out.replace(" \n", "\n");
        if !text.ends_with('\n') {
            text.push('\n');
        }
        if let Some(variable) = text.find("\nvar") {
            text.replace_range(variable..=variable, " ");
        }
        Item {
            keyword: Keyword::Fn,
            name: String::new(),
            text,
            predeclared,
            uses,
        }
    }
}

/// The names within a function.
struct Scope {
    owner: Owner,
    taken: Names,
    /// Words of the function that mean something predeclared.
    predeclared: BTreeSet<String>,
    /// Placeholders and numbered values that have their names.
    given: BTreeMap<String, String>,
    /// Placeholders of arguments and variables, and the names that they should have.
    variables: BTreeMap<String, String>,
    /// Placeholders of values.
    values: BTreeMap<String, (Handle<Expression>, Option<String>)>,
    expressions: BTreeMap<usize, Handle<Expression>>,
    style: Style,
}

impl Scope {
    fn new(
        owner: Owner,
        function: &mut Function,
        plan: lines::Lines,
        taken: &Names,
        labels: &mut Labels,
    ) -> Self {
        let mut scope = Self {
            owner,
            taken: taken.clone(),
            predeclared: BTreeSet::new(),
            given: BTreeMap::new(),
            variables: BTreeMap::new(),
            values: BTreeMap::new(),
            expressions: function
                .expressions
                .iter()
                .map(|(handle, _)| (handle.index(), handle))
                .collect(),
            style: Style {
                inline: plan
                    .inline
                    .iter()
                    .map(|handle| format!("_e{}", handle.index()))
                    .collect(),
                short_types: false,
                bare_numbers: plan.bare_numbers,
            },
        };
        let arguments = function
            .arguments
            .iter_mut()
            .map(|a| (&mut a.name, "input"));
        let locals = function.local_variables.iter_mut();
        for (name, fallback) in arguments.chain(locals.map(|(_, l)| (&mut l.name, "local"))) {
            let label = labels.add(String::new());
            let wish = name.take().unwrap_or_else(|| fallback.to_owned());
            scope.variables.insert(label.clone(), wish);
            *name = Some(label);
        }
        let own_names = std::mem::take(&mut function.named_expressions);
        for value in plan.named {
            let label = labels.add(String::new());
            scope
                .values
                .insert(label.clone(), (value, own_names.get(&value).cloned()));
            function.named_expressions.insert(value, label);
        }
        scope
    }

    /// The function's text without clutter.
    fn tidied(&self, raw: &str, short_types: bool) -> String {
        let style = Style {
            short_types,
            ..self.style.clone()
        };
        let start = if raw.starts_with("fn ") {
            0
        } else {
            raw.find("\nfn ").map_or(0, |at| at + 1)
        };
        match tidy(&raw[start..], &style) {
            Some(text) => format!("{}{text}", &raw[..start]),
            None => raw.to_owned(),
        }
    }

    /// The name that a word of the function's text stands for, when it is one of the function's own.
    fn name(&mut self, word: &str, wishes: &Wishes<'_>) -> Option<String> {
        if let Some(name) = self.given.get(word) {
            return Some(name.clone());
        }
        let wish = match (self.variables.get(word), self.values.get(word)) {
            (Some(wish), _) | (_, Some((_, Some(wish)))) => Some(wish.clone()),
            (None, Some((value, None))) => (wishes.value)(self.owner, *value),
            (None, None) => {
                let index = word.strip_prefix("_e")?.parse::<usize>().ok()?;
                (wishes.value)(self.owner, *self.expressions.get(&index)?)
            }
        };
        let wish = wish.as_deref().unwrap_or("value");
        let name = self.taken.take_local(wish, &self.predeclared);
        self.given.insert(word.to_owned(), name.clone());
        Some(name)
    }
}

/// A short name for a value from the path of its id: the last two parts, without the entry point's name.
pub(crate) fn short_name(path: &str, entry_point: &str) -> String {
    let parts: Vec<&str> = path.split('.').collect();
    let from = match &*parts {
        [first, _, ..] if *first == entry_point => 1,
        _ => 0,
    };
    parts[from.max(parts.len().saturating_sub(2))..].join("_")
}

/// Wishes for the values of a shader in normal form.
pub(crate) fn value_name(
    shader: &lodc_passes::Shader,
    stage: Stage,
    value: Handle<Expression>,
) -> Option<String> {
    shader.entry_point(stage)?;
    Some(path_name(shader, shader.id(stage, value).path()))
}

/// A short name for a value of any stage: those of the parameter stage are called as where they came from.
pub(crate) fn path_name(shader: &lodc_passes::Shader, path: &str) -> String {
    let (first, _) = path.split_once('.').unwrap_or((path, ""));
    let mut entries = shader.module().entry_points.iter();
    let entry = entries.find(|entry| entry.name == first);
    short_name(path, entry.map_or("", |entry| &entry.name))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The body of the function `f` of a text, written with names of values forgotten.
    #[track_caller]
    fn body(text: &str) -> String {
        body_of(naga::front::wgsl::parse_str(text).expect("it is WGSL"))
    }

    #[track_caller]
    fn body_of(mut module: Module) -> String {
        for (_, function) in module.functions.iter_mut() {
            function.named_expressions.clear();
        }
        let printed = print(
            &module,
            &Wishes {
                keep: &|_| true,
                taken: &Names::default(),
                outside: &Names::default(),
                value: &|_, _| None,
                short_types: true,
            },
        )
        .expect("it can be written");
        let all: String = printed
            .items
            .iter()
            .map(|item| item.text.as_str())
            .collect();
        naga::front::wgsl::parse_str(&all).unwrap_or_else(|e| panic!("{e}\n{all}"));
        let f = printed
            .items
            .iter()
            .find(|item| item.name == "f")
            .expect("it is there");
        let (_, body) = f.text.split_once("{\n").expect("it has a body");
        body.trim_end().trim_end_matches('}').to_owned()
    }

    #[test]
    fn a_load_does_not_move_past_a_store() {
        let written = body("fn f(n: f32) -> f32 { var a = n; let k = a; a = 2.0; return k + a; }");
        assert_eq!(
            written,
            "    var a = n;\n    let value = a;\n    a = 2.0;\n    return value + a;\n"
        );
        let written =
            body("fn f(n: f32) -> f32 { var a = n; let k = a; var b = k; return a + b; }");
        assert_eq!(
            written,
            "    var a = n;\n    var b = a;\n    return a + b;\n"
        );
        // The store is to another variable, or part of the statement that reads.
        let written = body(
            "fn f(n: f32) -> f32 { var a = n; var b = n; let k = a; b = 1.0; a = k * b; return a; }",
        );
        assert_eq!(
            written,
            "    var a = n;\n    var b = n;\n    b = 1.0;\n    a *= b;\n    return a;\n"
        );
    }

    #[test]
    fn a_load_does_not_move_past_a_call_that_may_store() {
        let written = body(
            "fn up(p: ptr<function, f32>) -> f32 { *p = 3.0; return 1.0; }
             fn f() -> f32 { var a = 1.0; return a + up(&a); }",
        );
        assert!(written.contains("= a;\n"), "{written}");
    }

    #[test]
    fn a_load_does_not_move_into_a_loop_that_stores() {
        let written = body(
            "fn f(n: i32) -> i32 {
                 var a = n; let k = a; var i = 0;
                 loop { if i > k { break; } i = i + k; a = 7; }
                 return i;
             }",
        );
        assert!(written.contains("let value = a;\n"), "{written}");
        let written = body(
            "fn f(n: i32) -> i32 {
                 var a = n; let k = a; var i = 0;
                 loop { if i > k { break; } i = i + k; }
                 return i;
             }",
        );
        assert!(!written.contains("let"), "{written}");
    }

    #[test]
    fn a_store_to_a_part_counts() {
        let written = body(
            "fn f(n: f32) -> f32 { var a = vec2f(n); let k = a; a.x = 2.0; return k.x + a.y; }",
        );
        assert!(written.contains("let value = a;\n"), "{written}");
    }

    #[test]
    fn samples_stay_within_straight_line_code() {
        let head =
            "@group(0) @binding(0) var t: texture_2d<f32>; @group(0) @binding(1) var s: sampler;";
        let written = body(&format!(
            "{head} fn f(v: vec2f) -> f32 {{ let c = textureSample(t, s, v); return c.x; }}"
        ));
        assert_eq!(written, "    return textureSample(t, s, v).x;\n");
        for text in [
            "fn f(v: vec2f) -> f32 { let c = textureSample(t, s, v); if v.x > 0.5 { return c.x; } return 0.0; }",
            "fn f(v: vec2f) -> f32 { let c = textureSample(t, s, v); return c.x + c.y; }",
            "fn f(v: vec2f) -> f32 { let c = dpdx(v.x); if v.x > 0.5 { return 0.0; } return c; }",
        ] {
            let written = body(&format!("{head} {text}"));
            assert!(written.starts_with("    let value = "), "{written}");
        }
    }

    #[test]
    fn samples_stay_out_of_what_may_not_be_evaluated() {
        let text = "@group(0) @binding(0) var t: texture_2d<f32>; @group(0) @binding(1) var s: sampler;
             fn f(v: vec2f) -> bool { let c = textureSample(t, s, v); return (v.x > 0.5) & (c.x > 0.5); }";
        let mut module = naga::front::wgsl::parse_str(text).expect("it is WGSL");
        assert!(!body_of(module.clone()).contains("let"));
        // naga reads `&&` as a branch, but normal form has the operator.
        for (_, function) in module.functions.iter_mut() {
            for (_, expression) in function.expressions.iter_mut() {
                if let Expression::Binary { op, .. } = expression
                    && *op == naga::BinaryOperator::And
                {
                    *op = naga::BinaryOperator::LogicalAnd;
                }
            }
        }
        let written = body_of(module);
        assert!(
            written.starts_with("    let value = textureSample"),
            "{written}"
        );
        assert!(
            written.contains("(v.x > 0.5) && (value.x > 0.5)"),
            "{written}"
        );
    }

    #[test]
    fn long_expressions_get_lines() {
        let terms: Vec<String> = (0..40).map(|n| format!("sqrt(v * {n}.5)")).collect();
        let written = body(&format!(
            "fn f(v: f32) -> f32 {{ return {}; }}",
            terms.join(" + ")
        ));
        assert!(written.lines().count() > 2, "{written}");
        assert!(written.lines().all(|line| line.len() < 160), "{written}");
    }

    #[test]
    fn numbers_alone_keep_their_type() {
        let text = "const A = 3.5; fn f(v: f32) -> f32 { return v + pow(2.0, A) + v * 2.0; }";
        let written = body(text);
        assert!(written.contains("2.0"), "{written}");
    }

    #[test]
    fn names_are_short_and_whole() {
        assert_eq!(short_name("main.specular.pow", "main"), "specular_pow");
        assert_eq!(short_name("main", "main"), "main");
        assert_eq!(
            short_name("main.shade.half_vector.mul_2", "main"),
            "half_vector_mul_2"
        );
    }
}
