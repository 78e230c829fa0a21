//! One shader held against another by what they compute, in normal form: which values are new, gone, computed otherwise, or at
//! another rate.
//!
//! Values that are computed alike are the same whatever they are called and wherever they stand. Of the others, those with one name
//! are one value that has changed. What is computed as before of values that differ is counted, and not shown.

use super::{Request, normal_form};
use crate::Result;
use crate::front::Source;
use crate::front::used::Used;
use crate::report::{
    BindingDifference, Fate, ShaderDifference, Totals, ValueAt, ValueDifference, place_of,
};
use lodc_passes::{Rates, Shader, Stage, Work, cost, operands};
use naga::{Binding, Expression, Handle, Module, TypeInner};
use std::collections::{BTreeMap, HashMap};

/// Compares two shaders.
///
/// # Errors
/// When one of them cannot be read, at its place.
pub fn difference(before: &Request, after: &Request) -> Result<ShaderDifference> {
    let (a, b) = (Side::read(before)?, Side::read(after)?);
    let mut values = Vec::new();
    let mut following = 0;
    for stage in [Stage::Vertex, Stage::Fragment] {
        let found = between(&Values::of(&a, stage), &Values::of(&b, stage));
        values.extend(found.0);
        following += found.1;
    }
    let bindings = bindings(&a.source.module, &b.source.module);
    Ok(ShaderDifference {
        version: env!("CARGO_PKG_VERSION"),
        before: a.source.name.clone(),
        after: b.source.name.clone(),
        same: a.shader.fingerprint() == b.shader.fingerprint() && bindings.is_empty(),
        values,
        following,
        bindings,
        totals: [a.totals(), b.totals()],
    })
}

/// One of the shaders.
struct Side {
    source: Source,
    shader: Shader,
}

impl Side {
    fn read(request: &Request) -> Result<Self> {
        let source = Source::read_with(&request.shader, &request.stages, &request.modules)?;
        let shader = normal_form(&source)?;
        Ok(Self { source, shader })
    }

    fn totals(&self) -> Totals {
        let module = self.shader.module();
        let work = |stage| {
            let function = self.shader.function(stage);
            let work = function.map(|function| cost::of_function(module, function));
            work.and_then(std::result::Result::ok).unwrap_or_default()
        };
        let (fragment, vertex) = (work(Stage::Fragment), work(Stage::Vertex));
        let bound = self.source.module.global_variables.iter();
        let bound = bound.filter(|(handle, variable)| {
            variable.binding.is_some() && !matches!(Used::of(&self.source, *handle), Used::Nothing)
        });
        Totals {
            operations: fragment.operations(),
            samples: fragment.samples,
            vertex_operations: vertex.total(),
            varyings: varyings(&self.shader),
            bindings: bound.count(),
        }
    }
}

/// How many components the fragment stage is handed.
fn varyings(shader: &Shader) -> u32 {
    let module = shader.module();
    let components = |binding: Option<&Binding>, ty: Handle<naga::Type>| match binding {
        Some(Binding::Location { .. }) => match module.types[ty].inner {
            TypeInner::Vector { size, .. } => size as u32,
            _ => 1,
        },
        _ => 0,
    };
    let arguments = shader.function(Stage::Fragment).map(|f| f.arguments.iter());
    let each =
        arguments
            .into_iter()
            .flatten()
            .map(|argument| match &module.types[argument.ty].inner {
                TypeInner::Struct { members, .. } => {
                    let members = members.iter();
                    members
                        .map(|member| components(member.binding.as_ref(), member.ty))
                        .sum()
                }
                _ => components(argument.binding.as_ref(), argument.ty),
            });
    each.sum()
}

/// The bindings that are elsewhere in the second, or of another type, or in one of the two alone.
fn bindings(a: &Module, b: &Module) -> Vec<BindingDifference> {
    let of = |module: &Module| -> BTreeMap<String, ([u32; 2], String)> {
        let variables = module.global_variables.iter();
        variables
            .filter_map(|(_, variable)| {
                let at = variable.binding?;
                let ty = described(module, &module.types[variable.ty].inner);
                Some((variable.name.clone()?, ([at.group, at.binding], ty)))
            })
            .collect()
    };
    let (a, b) = (of(a), of(b));
    let mut names: Vec<&String> = a.keys().chain(b.keys()).collect();
    names.sort();
    names.dedup();
    let differing = names
        .into_iter()
        .filter(|name| a.get(*name) != b.get(*name));
    differing
        .map(|name| BindingDifference {
            name: name.clone(),
            before: a.get(name).map(|(at, _)| *at),
            after: b.get(name).map(|(at, _)| *at),
        })
        .collect()
}

/// A type by what it is, to be held against one of another module: handles say nothing there.
fn described(module: &Module, inner: &TypeInner) -> String {
    let part = |ty: Handle<naga::Type>| described(module, &module.types[ty].inner);
    match inner {
        TypeInner::Struct { members, span } => {
            let members = members.iter().map(|member| {
                let name = member.name.as_deref().unwrap_or_default();
                format!("{name} {} {}", member.offset, part(member.ty))
            });
            format!("{span} {:?}", members.collect::<Vec<_>>())
        }
        TypeInner::Array { base, size, stride } => format!("{size:?} {stride} {}", part(*base)),
        TypeInner::Pointer { base, space } => format!("{space:?} {}", part(*base)),
        other => format!("{other:?}"),
    }
}

/// The values of a stage.
struct Values<'s> {
    side: &'s Side,
    stage: Stage,
    rates: Option<Rates>,
    work: Vec<Work>,
    all: Vec<Handle<Expression>>,
}

impl<'s> Values<'s> {
    fn of(side: &'s Side, stage: Stage) -> Self {
        let function = side.shader.function(stage);
        let module = side.shader.module();
        let work = function.and_then(|function| {
            let types = cost::types(module, function).ok()?;
            Some(cost::of_expressions(module, &function.expressions, &types))
        });
        let all = function.map(|f| f.expressions.iter().map(|(value, _)| value).collect());
        Self {
            side,
            stage,
            rates: Rates::of(&side.shader, stage),
            work: work.unwrap_or_default(),
            all: all.unwrap_or_default(),
        }
    }

    fn path(&self, value: Handle<Expression>) -> &str {
        self.side.shader.id(self.stage, value).path()
    }

    fn hash(&self, value: Handle<Expression>) -> u64 {
        self.side.shader.id(self.stage, value).hash()
    }

    fn rate(&self, value: Handle<Expression>) -> String {
        let rates = self.rates.as_ref();
        rates.map_or_else(String::new, |rates| rates.exactly(value).to_string())
    }

    /// Whether a reader is told of it: it costs something.
    fn counts(&self, value: Handle<Expression>) -> bool {
        self.work[value.index()].total() > 0.0
    }

    fn at(&self, value: Handle<Expression>) -> ValueAt {
        let place = place_of(&self.side.shader, &self.side.source, (self.stage, value));
        let text = place.as_ref().and_then(|place| {
            let line = place.file.text.lines().nth(place.line() as usize - 1)?;
            Some(line.trim().to_owned())
        });
        let work = self.work[value.index()];
        ValueAt {
            value: self.path(value).to_owned(),
            rate: self.rate(value),
            operations: work.operations(),
            samples: work.samples,
            file: place.as_ref().map(|place| place.file.name.to_owned()),
            line: place.as_ref().map(|place| place.line()),
            text,
        }
    }

    /// What is done in a value and what comes of it, without its operands; and these.
    fn operation(&self, value: Handle<Expression>) -> (String, Vec<Handle<Expression>>) {
        let shader = &self.side.shader;
        let mut of = Vec::new();
        let Some(function) = shader.function(self.stage) else {
            return (String::new(), of);
        };
        let expression = &function.expressions[value];
        operands::each(expression, |operand| of.push(operand));
        // Handles are shown as numbers in brackets: they are others in another module.
        let mut text = String::new();
        let mut depth = 0_u32;
        for c in format!("{expression:?}").chars() {
            depth += u32::from(c == '[');
            if depth == 0 {
                text.push(c);
            }
            depth = depth.saturating_sub(u32::from(c == ']'));
        }
        let ty = described(shader.module(), shader.type_of(self.stage, value));
        (text + &ty, of)
    }
}

/// What differs between the values of a stage, and how many follow.
fn between(a: &Values<'_>, b: &Values<'_>) -> (Vec<ValueDifference>, usize) {
    let pairs = pairs(a, b);
    let mut differences = Vec::new();
    let mut following = 0;
    let stage = match b.stage {
        Stage::Vertex => "vertex",
        _ => "fragment",
    };
    for value in &b.all {
        let other = pairs.get(value).copied();
        let fate = match other {
            None => Fate::New,
            Some(other) if a.hash(other) == b.hash(*value) => {
                if a.rate(other) == b.rate(*value) {
                    continue;
                }
                Fate::Rate
            }
            Some(other) => {
                let ((had, of_a), (has, of_b)) = (a.operation(other), b.operation(*value));
                let mut operands = of_b.iter().map(|operand| pairs.get(operand).copied());
                let follows = had == has && operands.by_ref().eq(of_a.into_iter().map(Some));
                if follows && a.rate(other) == b.rate(*value) {
                    following += usize::from(b.counts(*value));
                    continue;
                }
                if follows { Fate::Rate } else { Fate::Changed }
            }
        };
        if b.counts(*value) || other.is_some_and(|other| a.counts(other)) {
            differences.push(ValueDifference {
                fate,
                stage,
                before: other.map(|other| a.at(other)),
                after: Some(b.at(*value)),
            });
        }
    }
    let paired: Vec<_> = pairs.into_values().collect();
    for value in &a.all {
        if !paired.contains(value) && a.counts(*value) {
            differences.push(ValueDifference {
                fate: Fate::Gone,
                stage,
                before: Some(a.at(*value)),
                after: None,
            });
        }
    }
    let key = |found: &ValueDifference| {
        let at = found.after.as_ref().or(found.before.as_ref());
        (found.after.is_none(), at.and_then(|at| at.line))
    };
    differences.sort_by_key(key);
    (differences, following)
}

/// The value of `a` that each value of `b` is: one that is computed alike, with the same name if there are several, else one with the
/// same name.
fn pairs(a: &Values<'_>, b: &Values<'_>) -> HashMap<Handle<Expression>, Handle<Expression>> {
    let mut alike: HashMap<u64, Vec<Handle<Expression>>> = HashMap::new();
    for value in &a.all {
        alike.entry(a.hash(*value)).or_default().push(*value);
    }
    let mut pairs = HashMap::new();
    let mut left: Vec<Handle<Expression>> = Vec::new();
    for value in &b.all {
        let same = alike.get_mut(&b.hash(*value)).and_then(|all| {
            let at = all
                .iter()
                .position(|other| a.path(*other) == b.path(*value))?;
            Some(all.remove(at))
        });
        match same {
            Some(other) => drop(pairs.insert(*value, other)),
            None => left.push(*value),
        }
    }
    left.retain(|value| match alike.get_mut(&b.hash(*value)) {
        Some(all) if !all.is_empty() => {
            pairs.insert(*value, all.remove(0));
            false
        }
        _ => true,
    });
    let mut named: HashMap<&str, Handle<Expression>> = HashMap::new();
    for value in alike.into_values().flatten() {
        named.insert(a.path(value), value);
    }
    for value in left {
        if let Some(other) = named.remove(b.path(value)) {
            pairs.insert(value, other);
        }
    }
    pairs
}
