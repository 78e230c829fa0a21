//! Uniform and read-only storage buffers: what every part of them holds, from the scene file or inferred.

mod value;

use super::camera::{Pose, Sphere};
use super::chance::{child, unit};
use super::file::{Entries, Toml};
use super::layout::{LARGEST, Layout, Leaf, Place, article};
use super::materials::{Factor, Material};
use super::semantic::Semantic;
use super::{Inference, Missing};
use crate::eval::machine::Resource;
use crate::front::Source;
use crate::front::names::words;
use crate::front::used::Used;
use crate::{Diagnostic, Result};
use naga::valid::GlobalUse;
use naga::{AddressSpace, GlobalVariable, Handle, Module, ScalarKind};
use std::collections::BTreeSet;
use std::sync::Arc;
pub(super) use value::has;
use value::read_entry;

/// How a part of a buffer varies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Variation {
    /// It always has this value: it may be folded.
    Fixed,
    /// It has several values, or one that the scene computes for every picture.
    Sampled,
    /// It may take any value; pictures are drawn with one.
    Dynamic,
}

/// Which of their values the sampled parts take in a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Draw {
    /// Each its i-th, and round again.
    Listed(usize),
    /// Any of their ranges, by chance, told by a seed.
    Chance(u64),
}

impl Default for Draw {
    fn default() -> Self {
        Self::Listed(0)
    }
}

/// Where a part of a buffer gets its numbers from, column by column.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Fill {
    Semantic(Semantic),
    Fixed(Vec<f64>),
    Sampled(Vec<Vec<f64>>),
    /// As `Sampled`; whatever lies between the first and the last is meant too.
    Range(Vec<Vec<f64>>),
    Dynamic(Vec<f64>),
    /// A factor of the object's materials, until it is known which those are.
    Factor(&'static Factor),
    /// One for each draw of the object.
    PerDraw(Vec<Vec<f64>>),
}

impl Fill {
    fn variation(&self) -> Variation {
        match self {
            Self::Fixed(_) => Variation::Fixed,
            Self::Semantic(_) | Self::Sampled(_) | Self::Range(_) => Variation::Sampled,
            Self::Dynamic(_) => Variation::Dynamic,
            Self::PerDraw(all) if all.windows(2).all(|w| w[0] == w[1]) => Variation::Fixed,
            Self::Factor(_) | Self::PerDraw(_) => Variation::Sampled,
        }
    }

    fn samples(&self) -> usize {
        match self {
            Self::Semantic(semantic) => semantic.samples(),
            Self::Sampled(samples) | Self::Range(samples) => samples.len(),
            Self::Fixed(_) | Self::Dynamic(_) | Self::Factor(_) | Self::PerDraw(_) => 1,
        }
    }
}

/// A buffer of the shader and what fills it.
#[derive(Clone, Debug)]
pub(super) struct Buffer {
    group: u32,
    binding: u32,
    size: usize,
    parts: Vec<(Leaf, Fill)>,
}

/// A scalar, vector or matrix of a buffer, as the rest of the compiler sees it.
#[derive(Clone, Debug, PartialEq)]
pub struct Uniform {
    /// `camera.view_proj`, `lights.items[2].colour`, or the variable's name when it is no struct.
    pub path: String,
    /// The buffer's group.
    pub group: u32,
    /// The buffer's binding.
    pub binding: u32,
    /// Bytes from the start of the buffer.
    pub offset: u32,
    /// How it varies over the scene.
    pub variation: Variation,
    /// What the scene computes it from, if it does.
    pub semantic: Option<Semantic>,
    /// What the scene file states it to be, always: the bits of each component, a matrix column by column.
    pub stated: Option<Vec<u32>>,
}

/// What may be put into a part of a buffer.
#[derive(Clone, Debug)]
pub(crate) struct Freedom {
    leaf: Leaf,
    /// Group and binding of the buffer.
    pub(crate) at: (u32, u32),
    /// What the scene computes it from, if it does.
    pub(crate) semantic: Option<Semantic>,
    /// Values that the scene has for it; the first and the last are the ends of what is meant, unless any value is.
    pub(crate) values: Vec<Vec<f64>>,
    /// Whether it may take any value.
    pub(crate) is_any: bool,
}

impl Freedom {
    /// Such as `material.roughness`.
    pub(crate) fn path(&self) -> &str {
        &self.leaf.path
    }

    /// How many numbers it holds.
    pub(crate) fn len(&self) -> usize {
        self.leaf.len()
    }

    /// Whether it is a matrix.
    pub(crate) fn is_matrix(&self) -> bool {
        self.leaf.columns > 1
    }

    /// Puts numbers into the bytes of its buffer.
    pub(crate) fn write(&self, numbers: &[f64], bytes: &mut [u8]) {
        self.leaf.write(numbers, bytes);
    }

    /// The numbers that the bytes of its buffer hold.
    pub(crate) fn read(&self, bytes: &[u8]) -> Vec<f64> {
        let places = (0..self.len()).map(|i| {
            let (column, row) = (i / self.leaf.rows, i % self.leaf.rows);
            self.leaf.offset as usize + column * self.leaf.stride as usize + row * 4
        });
        let words = places.map(|at| {
            let four = bytes.get(at..at + 4).and_then(|four| four.try_into().ok());
            f32::from_le_bytes(four.unwrap_or_default())
        });
        words.map(f64::from).collect()
    }
}

impl Buffer {
    /// A buffer whose parts all are semantics, by the names of its members: that of a supplied vertex stage.
    pub(super) fn of_semantics(module: &Module) -> Option<Self> {
        let layout = Layout::new(module);
        let (variable, binding) = bound(module).next()?;
        let root = root(variable);
        let parts = layout.leaves(&root, 0).into_iter().filter_map(|leaf| {
            let member = leaf.path.rsplit('.').next()?.replace('_', "-");
            Some((leaf, Fill::Semantic(Semantic::of_keyword(&member)?)))
        });
        Some(Self {
            group: binding.group,
            binding: binding.binding,
            size: layout.size(variable.ty, 0) as usize,
            parts: parts.collect(),
        })
    }

    /// How many samples of its values there are.
    pub(super) fn samples(&self) -> usize {
        self.parts
            .iter()
            .map(|(_, f)| f.samples())
            .max()
            .unwrap_or(1)
    }

    /// Whether its bytes are the same in every picture.
    pub(super) fn is_constant(&self) -> bool {
        self.parts.iter().all(|(_, fill)| {
            fill.variation() != Variation::Sampled || matches!(fill, Fill::PerDraw(_))
        })
    }

    /// Where it is bound.
    pub(super) fn slot(&self) -> (u32, u32) {
        (self.group, self.binding)
    }

    /// Its contents in a picture.
    pub(super) fn resource(&self, pose: &Pose, sphere: &Sphere, draw: Draw) -> Resource {
        let draws = self.parts.iter().map(|(_, fill)| match fill {
            Fill::PerDraw(all) => all.len(),
            _ => 1,
        });
        let contents = |of_mesh| {
            let bytes = self.contents(pose, sphere, draw, of_mesh);
            Resource::Buffer(Arc::new(bytes))
        };
        match draws.max() {
            Some(draws) if draws > 1 => Resource::PerDraw((0..draws).map(contents).collect()),
            _ => contents(0),
        }
    }

    fn contents(&self, pose: &Pose, sphere: &Sphere, draw: Draw, of_mesh: usize) -> Vec<u8> {
        let mut bytes = vec![0; self.size];
        for (leaf, fill) in &self.parts {
            match fill {
                Fill::Semantic(semantic) => {
                    leaf.write(&semantic.numbers(leaf, pose, sphere, draw), &mut bytes);
                }
                Fill::Fixed(numbers) | Fill::Dynamic(numbers) => leaf.write(numbers, &mut bytes),
                Fill::Sampled(samples) => {
                    if let Some(numbers) = draw.one_of(samples) {
                        leaf.write(numbers, &mut bytes);
                    }
                }
                Fill::Range(samples) => {
                    if let Some(numbers) = draw.between(leaf, samples) {
                        leaf.write(&numbers, &mut bytes);
                    }
                }
                Fill::PerDraw(draws) => {
                    if let Some(numbers) = draws.get(of_mesh).or(draws.last()) {
                        leaf.write(numbers, &mut bytes);
                    }
                }
                // None is left when a buffer is made.
                Fill::Factor(_) => {}
            }
        }
        bytes
    }

    /// Whether a part of it is a level of detail that the shader itself declares.
    pub(super) fn has_auto_lod(&self) -> bool {
        self.parts.iter().any(|(leaf, _)| is_auto_lod(leaf))
    }

    /// Sets that level of detail.
    pub(super) fn set_auto_lod(&mut self, auto_lod: f64) {
        for (leaf, fill) in &mut self.parts {
            if is_auto_lod(leaf) {
                *fill = Fill::Dynamic(vec![auto_lod]);
            }
        }
    }

    /// What may be put into its parts of floats, where they are not always the same.
    pub(super) fn freedoms(&self) -> impl Iterator<Item = Freedom> + '_ {
        let parts = self.parts.iter().filter(|(leaf, _)| leaf.is_float());
        parts.filter_map(|(leaf, fill)| {
            let (semantic, values, is_any) = match fill {
                Fill::Semantic(semantic) => (Some(*semantic), Vec::new(), false),
                Fill::Sampled(values) | Fill::Range(values) => (None, values.clone(), false),
                Fill::Dynamic(value) => (None, vec![value.clone()], true),
                Fill::Fixed(_) | Fill::Factor(_) | Fill::PerDraw(_) => return None,
            };
            Some(Freedom {
                leaf: leaf.clone(),
                at: self.slot(),
                semantic,
                values,
                is_any,
            })
        })
    }

    /// Its parts, as the rest of the compiler sees them.
    pub(super) fn uniforms(&self) -> impl Iterator<Item = Uniform> + '_ {
        self.parts.iter().map(|(leaf, fill)| Uniform {
            path: leaf.path.clone(),
            group: self.group,
            binding: self.binding,
            offset: leaf.offset,
            variation: fill.variation(),
            semantic: match fill {
                Fill::Semantic(semantic) => Some(*semantic),
                _ => None,
            },
            stated: match fill {
                Fill::Fixed(numbers) if leaf.width == 4 => Some(leaf.words(numbers).collect()),
                _ => None,
            },
        })
    }
}

impl Draw {
    /// Its one of several: that of the same place in all lists.
    pub(super) fn one_of<T>(self, listed: &[T]) -> Option<&T> {
        match self {
            Self::Listed(sample) => listed.get(sample % listed.len().max(1)),
            // The same share of each list, so that lists of one length stay together.
            Self::Chance(seed) => listed.get((unit(seed) * listed.len() as f64) as usize),
        }
    }

    /// A value of a range; by chance, all parts of a value alike.
    fn between(self, leaf: &Leaf, samples: &[Vec<f64>]) -> Option<Vec<f64>> {
        let seed = match self {
            Self::Listed(_) => return self.one_of(samples).cloned(),
            Self::Chance(seed) => seed,
        };
        // Ranges are apart from each other: each takes what its own name tells.
        let share = unit(
            leaf.path
                .bytes()
                .fold(seed, |seed, b| child(seed, b.into())),
        );
        let (low, high) = (samples.first()?, samples.last()?);
        let numbers = low.iter().zip(high).map(|(low, high)| {
            let number = low + (high - low) * share;
            match leaf.kind {
                ScalarKind::Float => number,
                _ => number.round(),
            }
        });
        Some(numbers.collect())
    }
}

fn root(variable: &GlobalVariable) -> Place {
    Place {
        path: variable.name.clone().unwrap_or_default(),
        ty: variable.ty,
        offset: 0,
        runtime: 0,
    }
}

/// The buffers of a module that are bound, in the order of their declaration.
fn bound(module: &Module) -> impl Iterator<Item = (&GlobalVariable, &naga::ResourceBinding)> {
    let buffers = module.global_variables.iter().filter(|(_, v)| {
        matches!(
            v.space,
            AddressSpace::Uniform | AddressSpace::Storage { .. }
        )
    });
    buffers.filter_map(|(_, v)| Some((v, v.binding.as_ref()?)))
}

/// What there is to say besides the buffers.
#[derive(Debug, Default)]
pub(super) struct Said {
    pub(super) inferences: Vec<Inference>,
    /// Parts that have no value and mean nothing known.
    pub(super) missing: Vec<Missing>,
    /// The keywords of the material factors that the shader has a place for.
    pub(super) factors: BTreeSet<&'static str>,
}

/// Fills every buffer of a shader from the file's `[uniforms]` and `[storage]`, and from the materials of the object's
/// draws, if it has any.
pub(super) fn resolve(
    source: &Source,
    toml: Toml,
    uniforms: &Entries,
    storage: &Entries,
    materials: &[Material],
    said: &mut Said,
) -> Result<Vec<Buffer>> {
    let layout = Layout::new(&source.module);
    let tables = [(uniforms, "uniforms"), (storage, "storage")];
    let mut given = Vec::new();
    for (entries, table) in tables {
        for (key, value) in &entries.0 {
            given.push(read_entry(
                source, &layout, toml, table, key, value, &given,
            )?);
        }
    }
    let filled = source.filled();
    let mut buffers = Vec::new();
    for (handle, variable) in source.module.global_variables.iter() {
        let table = match variable.space {
            AddressSpace::Uniform => "uniforms",
            AddressSpace::Storage { .. } => "storage",
            _ => continue,
        };
        let Some(binding) = &variable.binding else {
            continue;
        };
        let root = root(variable);
        let own = || given.iter().filter(|g| is_in(&g.place.path, &root.path));
        let runtime = own().map(|g| g.place.runtime).max().unwrap_or(0);
        let size = layout.size(variable.ty, runtime);
        if size > LARGEST {
            return Err(source
                .error(
                    format!(
                        "the buffer `{}` has {size} bytes, and at most {LARGEST} are evaluated",
                        root.path
                    ),
                    source.variable(handle),
                    "",
                )
                .with_note("declare a shorter array, or keep what is read of it in a texture"));
        }
        let mut used = Used::of(source, handle);
        let mut blocks = filled.iter();
        if blocks.any(|block| [block.read, block.stored].contains(&handle)) {
            // The text's own entry point says what it holds.
            used = Used::Nothing;
        }
        if is_written(source, handle) {
            // The evaluator refuses the write, at its place; what the buffer holds is no question then.
            used = Used::Nothing;
        }
        let mut parts = Vec::new();
        if layout.has_runtime_array(variable.ty) && runtime == 0 && used.any() {
            // The runtime array is the last member: its one element is what comes with a length of 1.
            let leaves = layout.leaves(&root, 1);
            let before = layout.leaves(&root, 0).len();
            let element = leaves.iter().skip(before);
            said.missing
                .extend(element.map(|leaf| missing(source, handle, leaf, table)));
        }
        for leaf in layout.leaves(&root, runtime) {
            let given = |is_rest: bool| {
                // Of several that fill what is left, the one that says most about where.
                let own = own().filter(|g| g.is_rest == is_rest);
                let fills = own.filter_map(|g| {
                    let (_, fill) = g.fills.iter().find(|(l, _)| l.path == leaf.path)?;
                    Some((g.place.path.len(), fill.clone()))
                });
                fills
                    .max_by_key(|(length, _)| *length)
                    .map(|(_, fill)| fill)
            };
            if let Some(fill) = given(false) {
                let fill = match fill {
                    Fill::Factor(factor) if materials.is_empty() => {
                        let key = own().find(|g| g.fills.iter().any(|(l, _)| l.path == leaf.path));
                        let span = key.map_or(0..0, |given| given.key.span());
                        return Err(toml
                            .error(
                                format!(
                                    "`{}` is to be the {} of a material, and the object has none",
                                    leaf.path, factor.keyword
                                ),
                                span,
                                "",
                            )
                            .with_note(
                                "name a model, `object = \"model.glb\"`, or give a number",
                            ));
                    }
                    Fill::Factor(factor) => per_draw(factor, materials, &leaf, said),
                    other => other,
                };
                parts.push((leaf, fill));
                continue;
            }
            if !used.uses(&leaf.path) || is_padding(&leaf) {
                continue;
            }
            if leaf.width != 4 {
                return Err(source.error(
                    format!(
                        "`{}` is {}, which the evaluator does not run",
                        leaf.path,
                        article(&leaf.type_name())
                    ),
                    source.variable(handle),
                    "",
                ));
            }
            let guess = match Semantic::infer(&leaf) {
                _ if is_auto_lod(&leaf) => {
                    Some((Fill::Dynamic(vec![0.0]), "{ dynamic = 0.0 }".to_owned()))
                }
                Some(semantic) => {
                    let keyword = semantic.keyword();
                    Some((Fill::Semantic(semantic), format!("\"{keyword}\"")))
                }
                None if materials.is_empty() => None,
                None => Factor::infer(&leaf).map(|factor| {
                    let fill = per_draw(factor, materials, &leaf, said);
                    (fill, format!("\"{}\"", factor.keyword))
                }),
            };
            match guess {
                Some((fill, value)) => {
                    let reason = match &fill {
                        Fill::Semantic(semantic) => semantic.says().to_owned(),
                        Fill::PerDraw(all) => factors_said(all),
                        _ => "lodc chooses it; the original runs at 0".to_owned(),
                    };
                    let told = Inference::new(table, &leaf.path, &value);
                    said.inferences
                        .push(told.because(format!("{}: {reason}", leaf.type_name())));
                    parts.push((leaf, fill));
                }
                None => match given(true) {
                    Some(fill) => parts.push((leaf, fill)),
                    None => said.missing.push(missing(source, handle, &leaf, table)),
                },
            }
        }
        buffers.push(Buffer {
            group: binding.group,
            binding: binding.binding,
            size: size as usize,
            parts,
        });
    }
    Ok(buffers)
}

/// A factor of every draw's material.
fn per_draw(factor: &'static Factor, materials: &[Material], leaf: &Leaf, said: &mut Said) -> Fill {
    said.factors.insert(factor.keyword);
    let all = materials.iter();
    Fill::PerDraw(all.map(|m| m.numbers(factor, leaf)).collect())
}

/// The factors of the materials, for a person.
fn factors_said(all: &[Vec<f64>]) -> String {
    let mut values: Vec<String> = Vec::new();
    for numbers in all {
        let numbers: Vec<String> = numbers.iter().map(|n| (*n as f32).to_string()).collect();
        let value = numbers.join(", ");
        if !values.contains(&value) {
            values.push(value);
        }
    }
    match values.as_slice() {
        [one] => format!("the material's, {one}"),
        several if several.len() <= 4 => format!("each material's: {}", several.join("; ")),
        several => format!("each material's, {} values", several.len()),
    }
}

/// Whether a chosen entry point writes to a variable.
fn is_written(source: &Source, handle: Handle<GlobalVariable>) -> bool {
    let entries = [
        Some(source.fragment_entry().0),
        source.vertex_entry().map(|(i, _)| i),
    ];
    entries.into_iter().flatten().any(|i| {
        let uses = source.info.get_entry_point(i)[handle];
        uses.intersects(GlobalUse::WRITE | GlobalUse::ATOMIC)
    })
}

/// Whether a path is a place or lies within it.
fn is_in(path: &str, place: &str) -> bool {
    path.strip_prefix(place)
        .is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
}

/// Members that only fill room. Nobody has a value for them.
fn is_padding(leaf: &Leaf) -> bool {
    let name = leaf.path.rsplit('.').next().unwrap_or_default();
    let filler = ["pad", "padding", "unused", "reserved", "dummy"];
    let words = words(name);
    let digits = |word: &str| word.bytes().all(|b| b.is_ascii_digit());
    let says = words.iter().any(|w| filler.contains(&w.as_str()));
    says && words
        .iter()
        .all(|w| filler.contains(&w.as_str()) || digits(w))
}

/// A level of detail that the shader itself declares: lodc sets it, the original runs at 0.
fn is_auto_lod(leaf: &Leaf) -> bool {
    let name = leaf.path.rsplit('.').next().unwrap_or_default();
    leaf.is_float() && leaf.len() == 1 && words(name) == ["auto", "lod"]
}

fn missing(
    source: &Source,
    handle: Handle<GlobalVariable>,
    leaf: &Leaf,
    table: &'static str,
) -> Missing {
    let numbers = |n: usize, number: &str| vec![number; n].join(", ");
    let number = match leaf.kind {
        ScalarKind::Float => "0.0",
        _ => "0",
    };
    let value = match (leaf.columns, leaf.rows) {
        (1, 1) => number.to_owned(),
        (1, rows) => format!("[{}]", numbers(rows, number)),
        (columns, rows) => {
            // The unit matrix: zeros would hide what it does.
            let column = |c: usize| {
                let of: Vec<&str> = (0..rows)
                    .map(|r| if r == c { "1.0" } else { "0.0" })
                    .collect();
                format!("[{}]", of.join(", "))
            };
            format!(
                "[{}]",
                (0..columns).map(column).collect::<Vec<_>>().join(", ")
            )
        }
    };
    Missing {
        table,
        line: format!("\"{}\" = {value}", leaf.path),
        what: leaf.path.clone(),
        type_name: leaf.type_name(),
        span: source.variable(handle),
    }
}

/// The error for every part without a value, with all the lines to add.
pub(super) fn missing_error(source: &Source, file: &str, missing: &[Missing]) -> Box<Diagnostic> {
    let what = match missing {
        [one] => format!("what `{}` holds is not known", one.what),
        several => format!("what {} uniforms hold is not known", several.len()),
    };
    let mut error = Diagnostic::error(what);
    let mut at = BTreeSet::new();
    for one in missing {
        let range = one.span.to_range();
        // One label for a variable, however many of its members are missing.
        if let Some(range) = range
            && at.insert((range.start, range.end))
        {
            error = source.locate(
                error,
                one.span,
                format!("`{}` is {}", one.what, article(&one.type_name)),
            );
        }
    }
    let mut lines = format!(
        "their names do not say it; put values into {file} (\"zero\" gives a whole struct or array zeros):"
    );
    if missing.len() == 1 {
        lines = format!("its name does not say it; put a value into {file}:");
    }
    let mut table = "";
    for one in missing {
        if one.table != table {
            table = one.table;
            lines.push_str(&format!("\n[{table}]"));
        }
        lines.push_str(&format!("\n{}", one.line));
    }
    error.with_note(lines)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::file::SceneFile;
    use glam::{DMat4, DVec3};

    const TEXT: &str = "
        struct Lamp { position: vec3f, power: f32 }
        struct Scene {
            view_proj: mat4x4f, eye: vec3f, gloss: f32, tint: vec3f, _pad: f32,
            lamps: array<Lamp, 2>, mode: u32, turn: mat3x3f, autoLOD: f32, unused: f32, bias: i32,
        }
        @group(0) @binding(0) var<uniform> s: Scene;
        @group(0) @binding(1) var<uniform> wet: f32;
        @group(1) @binding(0) var<storage> items: array<Lamp>;
        @group(1) @binding(1) var<uniform> idle: vec4f;
        @fragment fn fs() -> @location(0) vec4f {
            let p = s.view_proj * vec4f(s.eye + s.tint + s.turn[0] + s.lamps[1].position, s.gloss + wet + s.autoLOD);
            return p + vec4f(items[0].power + f32(s.mode) + f32(s.bias) + s._pad);
        }";

    fn source() -> Source {
        Source::parse("a.wgsl", TEXT).unwrap()
    }

    fn resolved(text: &str) -> (Result<Vec<Buffer>>, Said) {
        let toml = Toml {
            name: "a.toml",
            text,
        };
        let file: SceneFile = toml.parse().unwrap();
        let mut said = Said::default();
        let buffers = resolve(
            &source(),
            toml,
            &file.uniforms,
            &file.storage,
            &[],
            &mut said,
        );
        (buffers, said)
    }

    const GOOD: &str = r#"
        [uniforms]
        "s.gloss" = { from = 0.0, to = 1.0, count = 3 }
        "s.tint" = { samples = [[1, 0, 0], [0, 1, 0]] }
        "s.lamps[0].position" = [1, 2, 3]
        "s.lamps[0].power" = 4
        "s.lamps[1].position" = [5, 6, 7]
        "s.lamps[1].power" = 8.5
        "s.mode" = true
        "s.turn" = [[1, 2, 3], [4, 5, 6], [7, 8, 9]]
        "s.bias" = { dynamic = -3 }
        wet = 0.25
        [storage]
        "items[1].power" = 2.0
        "items[0].power" = 1.0
        "items[0].position" = [0, 0, 0]
        "items[1].position" = [1, 1, 1]
    "#;

    fn bytes(buffer: &Buffer, sample: usize) -> Vec<f32> {
        let sphere = Sphere {
            centre: DVec3::ZERO,
            radius: 1.0,
        };
        let pose = Pose::new(DMat4::IDENTITY, sphere, DVec3::Z, 3.0, 45.0, [8, 8]);
        let Resource::Buffer(bytes) = buffer.resource(&pose, &sphere, Draw::Listed(sample)) else {
            panic!()
        };
        bytes
            .chunks(4)
            .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
            .collect()
    }

    #[test]
    fn zero_fills_what_nothing_else_says() {
        let toml = "
            [uniforms]
            s = \"zero\"
            \"s.gloss\" = 0.5
            \"s.lamps[1].power\" = 4
            wet = \"zero\"
            [storage]
            items = \"zero\"";
        let file: SceneFile = toml::from_str(toml).unwrap();
        let named = Toml {
            name: "a.toml",
            text: toml,
        };
        let mut said = Said::default();
        let resolved = resolve(
            &source(),
            named,
            &file.uniforms,
            &file.storage,
            &[],
            &mut said,
        );
        let buffers = resolved.unwrap_or_else(|error| panic!("{error}"));
        assert!(said.missing.is_empty());
        let fill = |path: &str| {
            let mut parts = buffers.iter().flat_map(|b| &b.parts);
            parts
                .find(|(leaf, _)| leaf.path == path)
                .map(|(_, fill)| fill.clone())
        };
        assert_eq!(
            fill("s.view_proj"),
            Some(Fill::Semantic(Semantic::ViewProjection))
        );
        assert_eq!(fill("s.gloss"), Some(Fill::Fixed(vec![0.5])));
        assert_eq!(fill("s.mode"), Some(Fill::Fixed(vec![0.0])));
        assert_eq!(fill("s.turn"), Some(Fill::Fixed(vec![0.0; 9])));
        assert_eq!(fill("s.lamps[1].power"), Some(Fill::Fixed(vec![4.0])));
        assert_eq!(fill("items[0].power"), Some(Fill::Fixed(vec![0.0])));
    }

    #[test]
    fn values_land_where_wgsl_reads_them() {
        let (buffers, said) = resolved(GOOD);
        let buffers = buffers.unwrap();
        assert!(said.missing.is_empty(), "{:?}", said.missing);
        let inferred: Vec<_> = said
            .inferences
            .iter()
            .map(|i| (i.what.as_str(), i.as_.as_str()))
            .collect();
        assert_eq!(
            inferred,
            [
                ("s.view_proj", "view-projection"),
                ("s.eye", "camera-position"),
                ("s.autoLOD", "{ dynamic = 0.0 }")
            ]
        );
        let words = bytes(&buffers[0], 0);
        // view_proj 0, eye 64, gloss 76, tint 80, lamps 96 and 112, mode 128, turn 144.
        assert_eq!(words[16..19], [0.0, 0.0, 3.0]);
        assert_eq!(words[19], 0.0);
        assert_eq!(words[20..23], [1.0, 0.0, 0.0]);
        assert_eq!(words[24..32], [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.5]);
        assert_eq!(words[32].to_bits(), 1);
        assert_eq!(
            words[36..47],
            [1.0, 2.0, 3.0, 0.0, 4.0, 5.0, 6.0, 0.0, 7.0, 8.0, 9.0]
        );
        assert_eq!(words[50].to_bits(), (-3i32).cast_unsigned());
        let later = bytes(&buffers[0], 1);
        assert_eq!((later[19], later[20], later[21]), (0.5, 0.0, 1.0));
        // The third of gloss, the first of tint again.
        let third = bytes(&buffers[0], 2);
        assert_eq!((third[19], third[20]), (1.0, 1.0));
        assert_eq!(buffers[0].samples(), 3);
        assert_eq!(bytes(&buffers[1], 0), [0.25]);
        assert!(buffers[1].is_constant() && !buffers[0].is_constant());
        assert_eq!(
            bytes(&buffers[2], 0),
            [0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 2.0]
        );
        // A buffer that nothing reads is there, and empty.
        assert_eq!(bytes(&buffers[3], 0), [0.0; 4]);
        let varies: Vec<_> = buffers[0]
            .uniforms()
            .map(|u| (u.path, u.variation))
            .collect();
        assert!(varies.contains(&("s.gloss".to_owned(), Variation::Sampled)));
        assert!(varies.contains(&("s.mode".to_owned(), Variation::Fixed)));
        assert!(varies.contains(&("s.bias".to_owned(), Variation::Dynamic)));
        assert!(varies.contains(&("s.eye".to_owned(), Variation::Sampled)));
    }

    #[test]
    fn all_that_is_missing_is_named_with_its_lines() {
        let (buffers, said) = resolved("[uniforms]\n\"s.tint\" = [1, 1, 1]");
        assert!(buffers.is_ok());
        let lines: Vec<_> = said.missing.iter().map(|m| m.line.as_str()).collect();
        assert_eq!(
            lines,
            [
                "\"s.gloss\" = 0.0",
                "\"s.lamps[0].position\" = [0.0, 0.0, 0.0]",
                "\"s.lamps[0].power\" = 0.0",
                "\"s.lamps[1].position\" = [0.0, 0.0, 0.0]",
                "\"s.lamps[1].power\" = 0.0",
                "\"s.mode\" = 0",
                "\"s.turn\" = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]",
                "\"s.bias\" = 0",
                "\"wet\" = 0.0",
                "\"items[0].position\" = [0.0, 0.0, 0.0]",
                "\"items[0].power\" = 0.0",
            ]
        );
        let text = missing_error(&source(), "`a.toml`", &said.missing).to_string();
        assert!(
            text.contains("what 11 uniforms hold is not known"),
            "{text}"
        );
        assert!(
            text.contains("[uniforms]") && text.contains("[storage]"),
            "{text}"
        );
        assert!(text.contains("a.wgsl:7:"), "{text}");
    }

    #[test]
    fn what_the_error_says_to_add_is_enough() {
        let (_, said) = resolved("");
        let of = |table| {
            let lines = said.missing.iter().filter(|m| m.table == table);
            lines.map(|m| m.line.clone()).collect::<Vec<_>>().join("\n")
        };
        let text = format!(
            "[uniforms]\n{}\n[storage]\n{}\n",
            of("uniforms"),
            of("storage")
        );
        let (buffers, said) = resolved(&text);
        assert!(buffers.is_ok() && said.missing.is_empty());
    }

    #[test]
    fn wrong_entries_are_located() {
        for (line, message, place) in [
            (
                "\"s.glos\" = 1.0",
                "there is no uniform `s.glos`",
                "\"s.glos\"",
            ),
            (
                "\"t.gloss\" = 1.0",
                "there is no uniform `t.gloss`",
                "\"t.gloss\"",
            ),
            (
                "\"s.gloss.x\" = 1.0",
                "there is no uniform `s.gloss.x`",
                "\"s.gloss.x\"",
            ),
            (
                "\"s.lamps[2].power\" = 1.0",
                "there is no uniform `s.lamps[2].power`",
                "\"s.lamps[2].power\"",
            ),
            (
                "\"s.lamps.power\" = 1.0",
                "there is no uniform `s.lamps.power`",
                "\"s.lamps.power\"",
            ),
            ("\"s.gloss\" = true", "`s.gloss` is an f32", "true"),
            ("\"s.gloss\" = nan", "`s.gloss` is an f32", "nan"),
            ("\"s.gloss\" = 1e300", "`s.gloss` is an f32", "1e300"),
            ("\"s.tint\" = [1, 2]", "`s.tint` is a vec3<f32>", "[1, 2]"),
            ("\"s.tint\" = 1", "`s.tint` is a vec3<f32>", "1"),
            ("\"s.mode\" = -1", "`s.mode` is a u32", "-1"),
            ("\"s.mode\" = 0.5", "`s.mode` is a u32", "0.5"),
            (
                "\"s.bias\" = 3000000000",
                "`s.bias` is an i32",
                "3000000000",
            ),
            (
                "\"s.turn\" = [1, 2, 3]",
                "`s.turn` is a mat3x3<f32>",
                "[1, 2, 3]",
            ),
            ("\"s.lamps\" = [1]", "`s.lamps` is an array<Lamp, 2>", "[1]"),
            ("\"s.lamps[0]\" = [1]", "`s.lamps[0]` is a Lamp", "[1]"),
            (
                "\"s.eye\" = \"camera-postion\"",
                "there is no meaning `camera-postion`",
                "\"camera-postion\"",
            ),
            (
                "\"s.eye\" = \"view-projection\"",
                "`s.eye` cannot be the view-projection",
                "\"view-projection\"",
            ),
            ("\"s.gloss\" = { samples = [] }", "`samples` is empty", "[]"),
            (
                "\"s.gloss\" = { samples = 1 }",
                "`samples` wants a list of values",
                "1",
            ),
            (
                "\"s.gloss\" = { from = 0.0 }",
                "a domain needs `to`",
                "{ from = 0.0 }",
            ),
            (
                "\"s.gloss\" = { from = 0.0, until = 1.0 }",
                "unknown key `until`",
                "until",
            ),
            (
                "\"s.gloss\" = { from = 0, to = 1, count = 1 }",
                "`count` wants a whole number of 2 to 64",
                "1",
            ),
            (
                "\"s.gloss\" = { dynamic = 0, samples = [1] }",
                "this says in no way, or in several, which values are taken",
                "{ dynamic = 0, samples = [1] }",
            ),
            (
                "\"s.gloss\" = {}",
                "this says in no way, or in several, which values are taken",
                "{}",
            ),
            ("items = [1]", "`items` is no uniform", "items"),
        ] {
            let text = format!("[uniforms]\n{line}\n");
            let error = resolved(&text).0.expect_err(line);
            assert_eq!(error.message, message);
            assert_eq!(&text[error.labels[0].0.clone()], place, "{line}");
            assert!(
                !error.notes.is_empty() || line.contains("samples = 1") || line.contains("count"),
                "{error}"
            );
        }
        let text = "[uniforms]\n\"s.lamps[0].power\" = 1\n\"s.lamps[0].power\" = 2\n";
        let toml = Toml { name: "a", text };
        assert!(toml.parse().is_err());
        let text = "[uniforms]\nwet = 1\n[storage]\nwet = 2\n";
        assert!(
            resolved(text)
                .0
                .unwrap_err()
                .message
                .contains("no storage buffer")
        );
    }

    #[test]
    fn buffers_that_are_written_need_no_values() {
        let source = Source::parse(
            "a.wgsl",
            "@group(0) @binding(0) var<storage, read_write> hits: array<atomic<u32>>;
            @fragment fn fs() -> @location(0) vec4f { atomicAdd(&hits[0], 1u); return vec4f(); }",
        )
        .unwrap();
        let mut said = Said::default();
        let none = Entries::default();
        let toml = Toml {
            name: "a.toml",
            text: "",
        };
        let buffers = resolve(&source, toml, &none, &none, &[], &mut said).unwrap();
        assert!(said.missing.is_empty());
        assert_eq!(bytes(&buffers[0], 0), [0.0]);
    }

    #[test]
    fn padding_is_told_by_its_whole_name() {
        let padding = |path: &str| {
            let width = 4;
            let kind = ScalarKind::Float;
            is_padding(&Leaf {
                path: path.to_owned(),
                offset: 0,
                columns: 1,
                rows: 1,
                stride: 0,
                kind,
                width,
            })
        };
        assert!(
            ["s._pad", "s.padding_1", "s.unused0", "s.pad_padding"]
                .into_iter()
                .all(padding)
        );
        assert!(
            !["s.pad_strength", "s.launchpad", "s.x1", "s._1"]
                .into_iter()
                .any(padding)
        );
    }

    #[test]
    fn what_the_evaluator_cannot_hold_is_refused() {
        let refused = |declared: &str, toml: &str| {
            let text = format!(
                "enable f16; {declared}
                @fragment fn fs() -> @location(0) vec4f {{ return vec4f(f32(b[0])); }}"
            );
            let source = Source::parse("a.wgsl", text).unwrap();
            let toml = Toml {
                name: "a.toml",
                text: toml,
            };
            let file = toml.parse().unwrap();
            let mut said = Said::default();
            resolve(&source, toml, &file.uniforms, &file.storage, &[], &mut said).unwrap_err()
        };
        let large = refused(
            "@group(0) @binding(0) var<storage> b: array<f32, 2000000>;",
            "",
        );
        assert_eq!(
            large.message,
            "the buffer `b` has 8000000 bytes, and at most 4194304 are evaluated"
        );
        let half = "@group(0) @binding(0) var<storage> b: array<f16, 2>;";
        assert_eq!(
            refused(half, "").message,
            "`b[0]` is an f16, which the evaluator does not run"
        );
        let given = refused(half, "[storage]\n\"b[0]\" = 1.0");
        assert!(given.notes[0].contains("32 bits"), "{given}");
    }

    #[test]
    fn near_names_are_offered() {
        let error = resolved("[uniforms]\n\"s.glos\" = 1.0\n").0.unwrap_err();
        assert_eq!(error.notes, ["did you mean `s.gloss`?"]);
        let error = resolved("[uniforms]\ngloss = 1.0\n").0.unwrap_err();
        assert_eq!(error.notes, ["did you mean `s.gloss`?"]);
        let error = resolved("[uniforms]\n\"s.lamps[7].power\" = 1.0\n")
            .0
            .unwrap_err();
        assert_eq!(
            error.notes,
            ["`s.lamps` is an array: `s.lamps[0]` to `s.lamps[1]`"]
        );
    }
}
