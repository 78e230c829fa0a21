//! A snapshot: one level frozen into a shader of its own, and exactly what it needs bound.
//!
//! This work is based on: Marc Olano, Bob Kuehne, Maryann Simmons, "Automatic Shader Level of Detail", 2003, sections 3.2
//! and 3.3: an application that knows a level's textures can page them in ahead, and bind no others.

use super::{Files, Request, read_lock};
use crate::emit;
use crate::front::Source;
use crate::front::used::Used;
use crate::{Diagnostic, Result};
use naga::TypeInner;
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
    /// The shader to write; by default `<stem>.snapshot.wgsl` beside the source.
    pub output: Option<PathBuf>,
}

/// Freezes the level that a value of autoLOD selects, from the lock: a shader without a choice in it.
///
/// # Errors
/// As [`super::locked`], and when the autoLOD is not a number.
pub fn snapshot(asked: &SnapshotRequest) -> Result<Snapshot> {
    let (request, autolod) = (&asked.request, asked.autolod);
    if autolod.is_nan() {
        return Err(Diagnostic::error("an autoLOD is a number")
            .with_note("it counts halvings of scale on screen: 0 is the original"));
    }
    let read = read_lock(request)?;
    let levels = &read.levels;
    // As the branching shader compares it: as an f32.
    let at = levels.partition_point(|level| level.autolod <= autolod as f32);
    let target = request.target.unwrap_or(read.lock.output.target);
    let place = Request {
        output: asked.output.clone(),
        ..request.clone()
    };
    let (stem, name) = (request.stem(), format!("{}.snapshot", place.stem()));
    let (frozen, files) = emit::one_level(&read.source, levels, at, target, (&stem, &name))?;
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
