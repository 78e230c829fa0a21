//! Brings a module to normal form: one function per entry point, without calls and early returns, with
//! stores forwarded to loads, constants folded, and nothing that no statement needs.
//!
//! Control flow stays, and so does behaviour, to the bit. What cannot be analysed, such as an array
//! that is indexed dynamically, stays in memory. Normal form is a fixed point of this function.
//!
//! The steps, each of which gives a valid module again: `returns`, `inline`, then `split`,
//! `forward` and `crate::live` until nothing changes, and `names` at the end.

pub(crate) mod forward;
mod inline;
pub(crate) mod names;
mod returns;
pub(crate) mod split;

use crate::fingerprint::{self, Declared};
use crate::{Shader, Stage, live};
use forward::{Changes, Origin};
use naga::{Expression, Function, Module, ShaderStage, Span};
use names::Tag;
use std::fmt;
use std::sync::Arc;

/// Why a module has no normal form.
#[derive(Clone, Debug, PartialEq)]
pub struct NormalizeError {
    /// What is wrong: lower case, without a full stop.
    pub message: String,
    /// Where, in the text that the module was parsed from.
    pub span: Span,
}

impl fmt::Display for NormalizeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for NormalizeError {}

/// Rounds after which the fixed point is given up; real shaders take two to four.
const ROUNDS: usize = 32;

/// How many values there may be for each that is left in the end, before constants decide which calls
/// are made at all.
const ROOM: usize = 64;

/// The normal form of a valid module, for a fragment entry point and perhaps a vertex entry point; the
/// others, and what only they use, are left out. `limit` bounds how many values an entry point may have;
/// while its calls are inlined there may be 64 times as many, since libraries choose among their
/// functions by constants.
///
/// # Errors
/// When there is no such entry point, or one grows beyond the limit.
pub fn normalize(
    module: &Module,
    vertex: Option<&str>,
    fragment: &str,
    limit: usize,
) -> Result<Shader, NormalizeError> {
    let vertex = vertex.map(|name| (Stage::Vertex, name));
    let entries: Vec<_> = vertex
        .into_iter()
        .chain([(Stage::Fragment, fragment)])
        .collect();
    normalize_stages(module, &entries, limit)
}

/// The same for the entry points of any stages, a fragment entry point among them.
///
/// # Errors
/// As [`normalize`].
pub fn normalize_stages(
    module: &Module,
    entries: &[(Stage, &str)],
    limit: usize,
) -> Result<Shader, NormalizeError> {
    let mut module = module.clone();
    module.entry_points.retain(|point| {
        let mut entries = entries.iter();
        entries.any(|(stage, name)| point.stage == ShaderStage::from(*stage) && point.name == *name)
    });
    for (stage, name) in entries {
        let mut points = module.entry_points.iter();
        if !points.any(|point| point.stage == ShaderStage::from(*stage)) {
            let stage = format!("{stage:?}").to_lowercase();
            return Err(NormalizeError {
                message: format!("there is no {stage} entry point `{name}`"),
                span: Span::UNDEFINED,
            });
        }
    }

    let functions = inline::prepare(&mut module);
    let mut tags = Vec::new();
    for entry in 0..module.entry_points.len() {
        let mut point = module.entry_points[entry].clone();
        returns::remove_early(&mut module.types, &mut point.function);
        let inlined = inline::inline(&module, &functions, &point, limit.saturating_mul(ROOM))?;
        let path: Arc<str> = point.name.as_str().into();
        let mut tagged = Tagged {
            function: inlined.function,
            tags: inlined.tags,
            locals: inlined.locals,
            path,
        };
        let mut declared = Declared::of(&module);
        let mut before = None;
        for _ in 0..ROUNDS {
            tagged.split(&module);
            tagged.forward(&mut module, &mut declared);
            tagged.keep_needed();
            let now = Some(fingerprint::of_function(&declared, &tagged.function));
            if now == before {
                break;
            }
            before = now;
        }
        let count = tagged.function.expressions.len();
        if count > limit {
            return Err(NormalizeError {
                message: format!(
                    "entry point `{}` has {count} values in normal form, more than {limit}",
                    point.name
                ),
                span: inline::place(&point),
            });
        }
        tagged.name_loads();
        module.entry_points[entry].function = tagged.function;
        tags.push(tagged.tags);
    }
    drop_unused(&mut module);
    let ids = names::ids(&mut module, &tags);
    Ok(Shader::new(module, ids))
}

/// Drops what no entry point uses.
fn drop_unused(module: &mut Module) {
    // Constants with a name would be kept.
    let mut used = vec![false; module.constants.len()];
    let functions = module.entry_points.iter().map(|e| &e.function.expressions);
    for expressions in functions.chain([&module.global_expressions]) {
        for (_, expression) in expressions.iter() {
            if let Expression::Constant(constant) = expression {
                used[constant.index()] = true;
            }
        }
    }
    for (handle, constant) in module.constants.iter_mut() {
        if !used[handle.index()] {
            constant.name = None;
        }
    }
    let lengths = |module: &Module| -> Vec<usize> {
        let entries = module.entry_points.iter();
        entries.map(|e| e.function.expressions.len()).collect()
    };
    let before = lengths(module);
    naga::compact::compact(module, naga::compact::KeepUnused::No);
    assert_eq!(before, lengths(module), "every value is needed");
}

/// A function, and where its values and variables come from.
struct Tagged {
    function: Function,
    tags: Vec<Tag>,
    locals: Vec<Tag>,
    path: Arc<str>,
}

impl Tagged {
    fn split(&mut self, module: &Module) {
        let Some(split) = split::split(module, &self.function) else {
            return;
        };
        self.tags = split
            .origins
            .iter()
            .map(|origin| match origin {
                Some(old) => self.tags[old.index()].clone(),
                None => Tag::of(self.path.clone()),
            })
            .collect();
        self.locals = split
            .locals
            .iter()
            .map(|(old, members)| {
                let Tag { path, name } = &self.locals[old.index()];
                let name = name.as_ref().map(|name| format!("{name}{members}"));
                Tag::named(path.clone(), name.as_deref())
            })
            .collect();
        self.function = split.function;
    }

    fn forward(&mut self, module: &mut Module, declared: &mut Declared) {
        let rebuilt = forward::rebuild(
            module,
            declared,
            &self.function,
            &Changes::none(&self.function),
        );
        let locals = rebuilt.function.local_variables.iter();
        self.locals = locals
            .map(|(local, variable)| match self.locals.get(local.index()) {
                Some(tag) => tag.clone(),
                None => Tag::named(self.path.clone(), variable.name.as_deref()),
            })
            .collect();
        let mut tags: Vec<Tag> = rebuilt
            .origins
            .iter()
            .map(|origin| match origin {
                Origin::Value(old) => self.tags[old.index()].clone(),
                Origin::Local(local) => self.locals[local.index()].clone(),
                Origin::Made => Tag::of(self.path.clone()),
            })
            .collect();
        self.function = rebuilt.function;
        // What a person called a variable, the values that it holds are called.
        for (value, local) in rebuilt.stored {
            let tag = &mut tags[value.index()];
            if tag.name.is_none() && !names::is_place(&self.function.expressions, value) {
                *tag = self.locals[local.index()].clone();
            }
        }
        self.tags = tags;
    }

    /// What is loaded from a variable is called like it, too.
    fn name_loads(&mut self) {
        for (value, expression) in self.function.expressions.iter() {
            if let Expression::Load { pointer } = *expression
                && let Expression::LocalVariable(local) = self.function.expressions[pointer]
                && self.tags[value.index()].name.is_none()
            {
                self.tags[value.index()] = self.locals[local.index()].clone();
            }
        }
    }

    fn keep_needed(&mut self) {
        let kept = live::keep_needed(&self.function);
        let origins = kept.origins.iter();
        self.tags = origins.map(|old| self.tags[old.index()].clone()).collect();
        let locals = kept.locals.iter();
        self.locals = locals.map(|old| self.locals[old.index()].clone()).collect();
        self.function = kept.function;
    }
}
