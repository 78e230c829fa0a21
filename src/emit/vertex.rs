//! The vertex stage of a text with several levels: what its entry point does for each, and what it hands over.
//!
//! ```text
//! struct VaryingsOfLevels { the author's, then those of levels }
//! fn vs_main(..) -> VaryingsOfLevels { original: the author's, and zeros | level: its own function }
//! fn fs_main(the author's, then those of levels) -> ..
//! ```

use super::EmitLevel;
use super::body::Hidden;
use super::level::{HandedOver, vertex_function};
use super::parameters::Block;
use super::splice::{Behind, Chosen};
use super::varyings::{Output, Varyings, outputs};
use crate::Result;
use crate::front::identifiers::Names;
use lodc_passes::Shader;
use lodc_passes::shader::Stage;
use naga::Module;
use std::collections::BTreeSet;

/// What the vertex stage comes to.
pub(crate) struct VertexStage {
    /// The struct that it returns, where that is none of the author's.
    pub(crate) declaration: String,
    /// What the entry point does, for the original and for each level.
    pub(crate) bodies: Vec<String>,
    /// What it does in the band behind the threshold of each level.
    pub(crate) between: Vec<String>,
    /// The function of each level that has one to itself.
    pub(crate) functions: Vec<Option<String>>,
    /// What is handed over beside the author's.
    pub(crate) further: Vec<Further>,
    result: Option<String>,
    varyings: Varyings,
}

/// A value that is handed over beside the author's.
pub(crate) struct Further {
    /// How it is declared, `@location(3) specular: vec3f`.
    pub(crate) declaration: String,
    pub(crate) name: String,
    ty: String,
}

impl Further {
    /// What is handed over where there is no such value.
    fn zero(&self) -> String {
        match &*self.ty {
            "f32" => "0.0".to_owned(),
            ty => format!("{ty}()"),
        }
    }
}

/// For each level, whether its vertex stage is another than the one of its base.
pub(crate) fn has_own_vertex_stage(
    base: &Shader,
    levels: &[EmitLevel],
    varyings: &Varyings,
) -> Vec<bool> {
    let print = |shader: &Shader| shader.stage_fingerprint(Stage::Vertex);
    let of_base = print(base);
    let levels = levels.iter().zip(&varyings.of_levels);
    levels
        .map(|(level, own)| !own.is_empty() || print(&level.shader) != of_base)
        .collect()
}

impl VertexStage {
    /// That of a text whose vertex stage stays as it is.
    pub(crate) fn of_nobody(levels: &[EmitLevel]) -> Self {
        Self {
            declaration: String::new(),
            bodies: Vec::new(),
            between: vec![String::new(); levels.len()],
            functions: vec![None; levels.len()],
            further: Vec::new(),
            result: None,
            varyings: Varyings {
                shared: Vec::new(),
                of_levels: vec![Vec::new(); levels.len()],
            },
        }
    }

    /// Makes it, for the vertex stage and the fragment stage behind it; `of_vertex` says which levels have one of their
    /// own.
    pub(crate) fn new(
        (vertex, fragment): (&Chosen, &Chosen),
        base: &Shader,
        (levels, of_vertex): (&[EmitLevel], &[bool]),
        (mut varyings, block): (Varyings, Option<&Block>),
        behind: &mut Behind<'_, '_>,
    ) -> Result<std::result::Result<Self, Hidden>> {
        let body = behind.body;
        let authors = Returned::of(body.module, body.source.vertex.as_deref());
        // An argument in one place and a member in the other: it is called like nothing else in either.
        let mut called = Names::default();
        called.reserve(body.declared.iter().copied());
        for stage in [vertex, fragment] {
            called.reserve(&stage.functions);
            called.reserve(&stage.arguments);
        }
        let mut local = called.clone();
        called.reserve(
            authors
                .outputs
                .iter()
                .filter_map(|output| output.member.as_ref()),
        );
        for varying in &mut varyings.shared {
            varying.name = called.take_local(&varying.name, &BTreeSet::new());
        }
        let name = match (&authors.name, varyings.shared.is_empty()) {
            (Some(name), true) => Some(name.clone()),
            (Some(name), false) => Some(behind.names.take(&format!("{name}OfLevels"))),
            (None, true) => None,
            (None, false) => Some(behind.names.take("VertexOfLevels")),
        };
        let handed_over = name.as_ref().map(|name| HandedOver {
            name,
            base,
            varyings: &varyings,
        });

        let mut calls: Vec<Option<String>> = vec![None];
        let mut functions: Vec<Option<String>> = Vec::new();
        let mut written: Vec<(&str, String)> = Vec::new();
        for (at, level) in levels.iter().enumerate() {
            if !of_vertex[at] {
                calls.push(None);
                functions.push(None);
                continue;
            }
            let name = &*vertex.functions[at + 1];
            let over = handed_over.as_ref();
            let printed = vertex_function(body, (at, level), name, (over, block), &behind.names)?;
            let function = match behind.take(&printed, name) {
                Ok(function) => function,
                Err(hidden) => return Ok(Err(hidden)),
            };
            // Levels with the same vertex stage have one function between them.
            let bare = |text: &str, name: &str| text.replacen(&format!("fn {name}("), "fn (", 1);
            let mut same = written.iter();
            match same.find(|(other, text)| bare(text, other) == bare(&function, name)) {
                Some((other, _)) => {
                    calls.push(Some((*other).to_owned()));
                    functions.push(None);
                }
                None => {
                    calls.push(Some(name.to_owned()));
                    functions.push(Some(function.clone()));
                    written.push((name, function));
                }
            }
        }
        let mut declaration = String::new();
        let mut further = Vec::new();
        let item = name.as_ref().and_then(|name| behind.take_out(name));
        if let Some(item) = item {
            let all = members(&item.text);
            let own = all.len().saturating_sub(varyings.shared.len());
            further.extend(all.into_iter().skip(own));
            declaration = format!(
                "\n// What the vertex stage hands over: zeros where a level has no use for them.\n{}",
                item.text
            );
        }
        let original = vertex.call(&vertex.functions[0], &[]);
        let original = match &name {
            Some(name) if !further.is_empty() => {
                let variable = local.take_local("original", &BTreeSet::new());
                authors.extended(name, &further, &original, &variable)
            }
            _ => format!("return {original};"),
        };
        let bodies = calls.iter().map(|function| match function {
            None => original.clone(),
            Some(function) => format!("return {};", vertex.call(function, &[])),
        });
        let bodies: Vec<String> = bodies.collect();
        // Both levels find there what they need: the author's values are the same in all.
        let [near, far] = ["near", "far"].map(|wish| local.take_local(wish, &BTreeSet::new()));
        let between = (0..levels.len()).map(|at| {
            let (Some(name), Some(function)) = (&name, &calls[at + 1]) else {
                return bodies[at].clone();
            };
            if further.is_empty() || calls[at] == calls[at + 1] {
                return bodies[at].clone();
            }
            let before = match &calls[at] {
                None => vertex.call(&vertex.functions[0], &[]),
                Some(function) => vertex.call(function, &[]),
            };
            let is_original = calls[at].is_none();
            let author = authors.outputs.iter().map(|output| match &output.member {
                Some(member) => format!("{near}.{member}"),
                None if is_original => near.clone(),
                None => format!("{near}.position"),
            });
            let carries = |level: usize, place: usize| {
                let mut places = varyings.of_levels[level].iter();
                places.any(|(_, own)| *own == place)
            };
            let levels = further
                .iter()
                .enumerate()
                .map(|(place, one)| match at.checked_sub(1) {
                    _ if carries(at, place) => format!("{far}.{}", one.name),
                    Some(before) if carries(before, place) && !is_original => {
                        format!("{near}.{}", one.name)
                    }
                    _ => one.zero(),
                });
            let all: Vec<String> = author.chain(levels).collect();
            format!(
                "let {near} = {before};\nlet {far} = {};\nreturn {name}({});",
                vertex.call(function, &[]),
                all.join(", ")
            )
        });
        let between = between.collect();
        Ok(Ok(Self {
            bodies,
            between,
            declaration,
            functions,
            result: name.filter(|_| !further.is_empty()),
            further,
            varyings,
        }))
    }

    /// The type that the entry point returns, where that is none of the author's.
    pub(crate) fn result(&self) -> Option<&str> {
        self.result.as_deref()
    }

    /// What a level's fragment stage takes of what is handed over, in its order.
    pub(crate) fn handed_to(&self, level: usize) -> Vec<&str> {
        let places = self.varyings.of_levels[level].iter();
        let further = places.filter_map(|(_, place)| self.further.get(*place));
        further.map(|further| &*further.name).collect()
    }
}

/// What the author's vertex stage returns.
struct Returned {
    /// The struct's name, if it is one.
    name: Option<String>,
    outputs: Vec<Output>,
}

impl Returned {
    fn of(module: &Module, entry: Option<&str>) -> Self {
        let mut entries = module.entry_points.iter();
        let stage = naga::ShaderStage::Vertex;
        let entry = entries.find(|e| e.stage == stage && Some(&*e.name) == entry);
        let result = entry.and_then(|entry| entry.function.result.as_ref());
        Self {
            name: result
                .filter(|result| result.binding.is_none())
                .and_then(|result| module.types[result.ty].name.clone()),
            outputs: entry.map_or(Vec::new(), |entry| outputs(module, &entry.function)),
        }
    }

    /// What returns the author's outputs with zeros behind them, from a call of the author's function.
    fn extended(&self, ty: &str, further: &[Further], call: &str, variable: &str) -> String {
        let zeros = further.iter().map(Further::zero);
        let members = self.outputs.iter().map(|output| match &output.member {
            Some(member) => format!("{variable}.{member}"),
            None => call.to_owned(),
        });
        let all: Vec<String> = members.chain(zeros).collect();
        let returned = format!("return {ty}({});", all.join(", "));
        match self.name {
            Some(_) => format!("let {variable} = {call};\n{returned}"),
            None => returned,
        }
    }
}

/// The members of a struct as it was written, a line each.
pub(crate) fn members(text: &str) -> Vec<Further> {
    let lines = text.lines().filter_map(|line| {
        let declaration = line.trim().strip_suffix(',')?;
        let (head, ty) = declaration.rsplit_once(": ")?;
        Some(Further {
            declaration: declaration.to_owned(),
            name: head.rsplit(' ').next()?.to_owned(),
            ty: ty.to_owned(),
        })
    });
    lines.collect()
}
