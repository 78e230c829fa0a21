//! A snapshot: one level frozen into a shader of its own, and exactly what it needs bound.
//!
//! This work is based on: Marc Olano, Bob Kuehne, Maryann Simmons, "Automatic Shader Level of Detail", 2003, sections 3.2
//! and 3.3: an application that knows a level's textures can page them in ahead, and bind no others.

use super::{Files, Relocked, Request, read_lock};
use crate::emit::{self, EmitLevel};
use crate::front::Source;
use crate::front::names::nearest;
use crate::front::used::Used;
use crate::{Diagnostic, Result};
use lodc_passes::specialize::{self, Specialize};
use lodc_passes::{Facts, Pass, recipe};
use naga::{AddressSpace, ArraySize, Module, Scalar, ScalarKind, StorageAccess, TypeInner};
use std::collections::BTreeSet;
use std::path::PathBuf;

/// What a binding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ResourceKind {
    /// A texture.
    Texture,
    /// A sampler.
    Sampler,
    /// A uniform or storage buffer.
    Buffer,
}

/// Something that a host binds.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Needed {
    /// The variable's name.
    pub name: String,
    /// Its group.
    pub group: u32,
    /// Its binding in the group.
    pub binding: u32,
    /// What it is.
    pub kind: ResourceKind,
    /// The members of a buffer that are read, in the order of their names; `None` when all of it may be.
    pub members: Option<Vec<String>>,
}

/// A frozen level.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Snapshot {
    /// Which level it is; 0 is the original.
    pub level: usize,
    /// The autoLOD from which the level is used, and the one from which it no longer is.
    pub range: (f32, Option<f32>),
    /// What changed, for people; empty for the original.
    pub says: String,
    /// The shader, and the names of its files.
    pub files: Files,
    /// What it needs bound, by group and binding.
    pub needs: Vec<Needed>,
    /// What the original needs beside that.
    pub spared: Vec<Needed>,
    /// What is worth saying: a scene that has changed since.
    pub warnings: Vec<Box<Diagnostic>>,
}

/// What is frozen, and where it goes.
#[derive(Clone, Debug, Default)]
pub struct SnapshotRequest {
    /// The shader, and where its lock is: beside the output that was asked for when the lock was made.
    pub request: Request,
    /// The value of autoLOD whose level it is, from 0.
    pub autolod: f64,
    /// Run-time parameters that are known by now: members of buffers such as `material.roughness`, each with its numbers, a
    /// matrix column by column. They are folded into the shader.
    pub values: Vec<(String, Vec<f64>)>,
    /// The shader to write; by default `<stem>.snapshot.wgsl` beside the source.
    pub output: Option<PathBuf>,
}

/// Freezes the level that a value of autoLOD selects, from the lock: a shader without a choice in it.
///
/// # Errors
/// As [`super::locked`], when the autoLOD is not a number, and when a parameter is none of the shader or has another shape.
pub fn snapshot(asked: &SnapshotRequest) -> Result<Snapshot> {
    let (request, autolod) = (&asked.request, asked.autolod);
    if autolod.is_nan() {
        return Err(Diagnostic::error("an autoLOD is a number")
            .with_note("it counts halvings of scale on screen: 0 is the original"));
    }
    let mut read = read_lock(request)?;
    let output = request.emission(read.lock.output);
    read.levels = emit::settled(&read.source, &read.levels, output.form)?;
    let levels = &read.levels;
    // As the branching shader compares it: as an f32.
    let at = levels.partition_point(|level| level.autolod <= autolod as f32);
    let place = Request {
        output: asked.output.clone(),
        ..request.clone()
    };
    let (stem, name) = (request.stem(), format!("{}.snapshot", place.stem()));
    let known = known(&read.source.module, &asked.values)?;
    let frozen_level = match known.fixed.is_empty() {
        true => None,
        false => Some(with_values(&read, at, &known)),
    };
    let (one, place_of_one) = match &frozen_level {
        None => (&levels[..], at),
        Some(level) => (std::slice::from_ref(level), 1),
    };
    let (frozen, files) = emit::one_level(
        &read.source,
        one,
        place_of_one,
        output.target,
        (&stem, &name),
    )?;
    let needs = needs(&frozen);
    let spared = self::needs(&read.source).into_iter();
    let spared = spared.filter(|need| !needs.iter().any(|have| have.name == need.name));
    let files = place.placed(files, &place.stem());
    request.spare(&files, &[request.shader.clone(), request.lock()])?;
    let before = at.checked_sub(1).and_then(|before| levels.get(before));
    Ok(Snapshot {
        level: emit::number(levels, at),
        range: (
            before.map_or(0.0, |level| level.autolod),
            levels.get(at).map(|level| level.autolod),
        ),
        says: before.map_or_else(String::new, |level| level.says.clone()),
        files,
        spared: spared.collect(),
        needs,
        warnings: read.warnings,
    })
}

/// What run-time parameters state, by their places.
fn known(module: &Module, values: &[(String, Vec<f64>)]) -> Result<Facts> {
    let mut known = Facts::default();
    for (path, numbers) in values {
        let Some(inner) = member(module, path) else {
            let variables = module.global_variables.iter();
            let buffers = variables
                .filter(|(_, variable)| is_read_only(variable.space))
                .filter_map(|(_, variable)| variable.name.as_deref());
            let near = nearest(path, buffers, 3).join("`, `");
            let error = Diagnostic::error(format!("there is no `{path}` to set"));
            return Err(error.with_note(match near.is_empty() {
                true => {
                    "name a number, a vector or a matrix in a uniform, such as `material.roughness`"
                        .to_owned()
                }
                false => format!(
                    "name a number, a vector or a matrix in a uniform, such as a member of `{near}`"
                ),
            }));
        };
        let (count, scalar) = match *inner {
            TypeInner::Scalar(scalar) => (1, scalar),
            TypeInner::Vector { size, scalar } => (size as usize, scalar),
            TypeInner::Matrix {
                columns,
                rows,
                scalar,
            } => (columns as usize * rows as usize, scalar),
            _ => (0, Scalar::F32),
        };
        let words = numbers.iter().map(|number| word(*number, scalar));
        let words: Option<Vec<u32>> = words.collect();
        let Some(words) = words.filter(|words| count > 0 && words.len() == count) else {
            let kind = match scalar.kind {
                ScalarKind::Float => "finite number",
                ScalarKind::Sint => "whole number",
                _ => "whole number from 0",
            };
            return Err(Diagnostic::error(format!("`{path}` is set to what it cannot hold")).with_note(match count {
                0 => "name a member of it: a number, a vector or a matrix".to_owned(),
                1 => format!("it is one {kind}"),
                _ => format!("it is {count} of a {kind}, with commas between them, a matrix column by column"),
            }));
        };
        known.fixed.insert(path.clone(), words);
    }
    Ok(known)
}

/// The bits of a number in a buffer, if it has that number.
fn word(number: f64, scalar: Scalar) -> Option<u32> {
    let is_whole = number.fract() == 0.0;
    match scalar {
        Scalar::F32 => Some((number as f32).to_bits()).filter(|_| (number as f32).is_finite()),
        Scalar::I32 => Some((number as i32).cast_unsigned())
            .filter(|_| is_whole && (f64::from(i32::MIN)..=f64::from(i32::MAX)).contains(&number)),
        Scalar::U32 => Some(number as u32)
            .filter(|_| is_whole && (0.0..=f64::from(u32::MAX)).contains(&number)),
        _ => None,
    }
}

/// Whether a shader only reads what is there.
fn is_read_only(space: AddressSpace) -> bool {
    match space {
        AddressSpace::Uniform => true,
        AddressSpace::Storage { access } => !access.contains(StorageAccess::STORE),
        _ => false,
    }
}

/// The type of `material.roughness` or `lights[2].colour`, in a buffer that is only read.
fn member<'m>(module: &'m Module, path: &str) -> Option<&'m TypeInner> {
    let apart = path.replace('[', ".[");
    let mut steps = apart.split('.');
    let root = steps.next()?;
    let mut variables = module.global_variables.iter();
    let (_, variable) = variables.find(|(_, variable)| {
        variable.name.as_deref() == Some(root) && is_read_only(variable.space)
    })?;
    let mut ty = variable.ty;
    for step in steps {
        ty = match (&module.types[ty].inner, step.strip_prefix('[')) {
            (TypeInner::Array { base, size, .. }, Some(index)) => {
                let index: u32 = index.strip_suffix(']')?.parse().ok()?;
                let is_there = match size {
                    ArraySize::Constant(size) => index < size.get(),
                    _ => true,
                };
                Some(*base).filter(|_| is_there)?
            }
            (TypeInner::Struct { members, .. }, None) => {
                let mut members = members.iter();
                members
                    .find(|member| member.name.as_deref() == Some(step))?
                    .ty
            }
            _ => return None,
        };
    }
    Some(&module.types[ty].inner)
}

/// A level, the original being at 0, with what is known folded into it.
fn with_values(read: &Relocked, at: usize, known: &Facts) -> EmitLevel {
    let level = at.checked_sub(1).and_then(|before| read.levels.get(before));
    let mut shader = level.map_or(&read.base, |level| &level.shader).clone();
    loop {
        let folding = Specialize.candidates(&shader, known).into_iter();
        let mut folding = folding.filter(|candidate| specialize::folded(candidate).is_some());
        match folding.find_map(|c| recipe::apply(&shader, &c).ok()) {
            Some(next) => shader = next,
            None => break,
        }
    }
    let names: Vec<&str> = known.fixed.keys().map(String::as_str).collect();
    let level = match level {
        Some(level) => level.clone(),
        None => EmitLevel::original(read.base.clone()),
    };
    EmitLevel {
        shader,
        says: format!("{}; {} known", level.says, names.join(", ")),
        ..level
    }
}

/// What the chosen entry points of a shader need bound, by group and binding.
fn needs(source: &Source) -> Vec<Needed> {
    let variables = source.module.global_variables.iter();
    let mut needs: Vec<Needed> = variables
        .filter_map(|(handle, variable)| {
            let binding = variable.binding?;
            let used = Used::of(source, handle);
            let kind = match source.module.types[variable.ty].inner {
                TypeInner::Image { .. } => ResourceKind::Texture,
                TypeInner::Sampler { .. } => ResourceKind::Sampler,
                _ => ResourceKind::Buffer,
            };
            let members = match used {
                Used::Nothing => return None,
                Used::All => None,
                Used::Members(names) => Some(names.into_iter().collect()),
            };
            Some(Needed {
                name: variable.name.clone().unwrap_or_default(),
                group: binding.group,
                binding: binding.binding,
                kind,
                members,
            })
        })
        .collect();
    needs.sort_by_key(|need| (need.group, need.binding));
    needs
}

impl Snapshot {
    /// Names every texture that a draw with it binds, once each: what an application pages in ahead.
    pub fn each_texture(&self, mut bind: impl FnMut(&Needed)) {
        let textures = self.needs.iter();
        textures
            .filter(|need| need.kind == ResourceKind::Texture)
            .for_each(&mut bind);
    }

    /// It as lines for a terminal.
    pub fn summary(&self) -> String {
        use std::fmt::Write;
        let mut out = String::new();
        let mut line = |title: &str, text: &str| {
            let _ = writeln!(out, "  {title:<16}{text}");
        };
        let range = match self.range {
            (from, Some(until)) => format!("from autoLOD {from:.2}, below {until:.2}"),
            (from, None) => format!("from autoLOD {from:.2} on"),
        };
        let says = match self.says.is_empty() {
            true => "the original",
            false => &self.says,
        };
        line("level", &format!("{}, {range}: {says}", self.level));
        let names = |of: &[Needed], kind: ResourceKind| {
            let all = of.iter().filter(|need| need.kind == kind);
            let all = all.map(|need| match &need.members {
                Some(members) => format!("{} ({})", need.name, members.join(", ")),
                None => need.name.clone(),
            });
            let names: BTreeSet<String> = all.collect();
            names.into_iter().collect::<Vec<_>>().join(", ")
        };
        for (title, kind) in [
            ("textures", ResourceKind::Texture),
            ("samplers", ResourceKind::Sampler),
            ("buffers", ResourceKind::Buffer),
        ] {
            let names = names(&self.needs, kind);
            line(title, if names.is_empty() { "none" } else { &names });
        }
        let spared: Vec<&str> = self.spared.iter().map(|need| need.name.as_str()).collect();
        if !spared.is_empty() {
            line("not needed", &spared.join(", "));
        }
        out
    }
}
