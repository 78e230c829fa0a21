//! `[lighting]` and `[targets]`: the full-screen shader of a deferred scene, and the formats of what it reads.
//!
//! The lighting shader is resolved as a material is, against tables of its own: `[lighting.uniforms]` and so on. Its
//! textures that hold the material's outputs are told from their names, or said: `gbuffer_normal = "target 1"`.

use super::buffers::{self, Buffer, Said};
use super::camera::{Pose, Sphere};
use super::file::{Entries, LightingTable, Node, Toml, suggest};
use super::mesh::Mesh;
use super::objects::Object;
use super::textures::{self, Place, is_colour};
use super::{Inference, InputFile, hash};
use crate::eval::draw::{Format, Lighting, Plane};
use crate::eval::generated::Store;
use crate::eval::machine::Bindings;
use crate::eval::program::Program;
use crate::eval::raster::Frame;
use crate::eval::refusal;
use crate::front::names::{listed, whole_word, words};
use crate::front::{Input, Source, Stages, inputs, read_text, validate};
use crate::{Diagnostic, Result};
use naga::{
    Binding, GlobalVariable, Handle, ImageClass, ImageDimension, Module, Scalar, ScalarKind, Span,
    TypeInner, VectorSize,
};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;
use toml::Spanned;

/// The lighting of a deferred scene.
#[derive(Clone, Debug)]
pub struct SceneLighting {
    /// The shader's file as the scene names it.
    pub file: String,
    /// What the evaluator runs.
    pub(super) lighting: Arc<Lighting>,
    source: Arc<Source>,
    /// The vertex stage that lodc supplies, when the shader has none; its one entry point is at 0.
    supplied: Option<Arc<Module>>,
    buffers: Vec<Buffer>,
    /// The bindings that are the same in every picture.
    constant: Bindings,
    screen: Arc<Mesh>,
}

/// What is found on the way.
#[derive(Debug, Default)]
pub(super) struct Found {
    pub(super) inferences: Vec<Inference>,
    pub(super) warnings: Vec<Diagnostic>,
    /// The shader and its images.
    pub(super) inputs: Vec<InputFile>,
}

impl SceneLighting {
    /// How many samples of its values there are.
    pub(super) fn samples(&self) -> usize {
        self.buffers.iter().map(Buffer::samples).max().unwrap_or(1)
    }

    /// The vertex stage: a module, and the place of its entry point.
    pub fn vertex(&self) -> (&Module, usize) {
        match (&self.supplied, self.source.vertex_entry()) {
            (None, Some((entry, _))) => (&self.source.module, entry),
            (Some(supplied), _) => (supplied, 0),
            (None, None) => unreachable!("a stage is supplied where there is none"),
        }
    }

    /// The fragment stage: a module, and the place of its entry point.
    pub fn fragment(&self) -> (&Module, usize) {
        (&self.source.module, self.source.fragment_entry().0)
    }

    /// What it reads of the material: group, binding, and what.
    pub fn reads(&self) -> &[((u32, u32), Plane)] {
        self.lighting.reads()
    }

    /// How many bytes the material writes to the targets that it reads, for a pixel.
    pub fn target_bytes(&self) -> u32 {
        let colours = self.reads().iter().filter_map(|(_, plane)| match plane {
            Plane::Target(location, format) => Some((*location, format.bytes())),
            Plane::Depth => None,
        });
        let colours: BTreeMap<u32, u32> = colours.collect();
        colours.values().sum()
    }

    /// The frame that lights a picture of the material: its pixels are the picture's fine pixels.
    pub(super) fn frame(&self, material: &Frame, pose: &Pose, sphere: &Sphere) -> Frame {
        let pose = pose.moved(material.offset, material.grid);
        let mut bindings = self.constant.clone();
        for buffer in &self.buffers {
            bindings.insert(
                buffer.slot(),
                buffer.resource(&pose, sphere, material.shot.draw),
            );
        }
        Frame {
            mesh: self.screen.clone(),
            attributes: BTreeMap::new(),
            bindings,
            width: material.width * material.grid,
            height: material.height * material.grid,
            offset: [0.0; 2],
            grid: 1,
            states: Arc::default(),
            shot: material.shot,
            baked: Store::default(),
        }
    }
}

/// A colour that the material returns.
struct Output {
    location: u32,
    name: String,
    kind: ScalarKind,
    /// Where it is declared.
    span: Span,
}

/// Whether a shader returns something at a location.
pub(super) fn returns(source: &Source, location: &str) -> bool {
    let location = location.parse().ok();
    let mut outputs = outputs(source).into_iter();
    outputs.any(|output| Some(output.location) == location)
}

/// What the fragment entry point returns at locations, in order.
fn outputs(source: &Source) -> Vec<Output> {
    let types = &source.module.types;
    let Some(result) = &source.fragment_entry().1.function.result else {
        return Vec::new();
    };
    let declared = source.place(types.get_span(result.ty));
    let span = |name: &str| {
        let place = declared.as_ref()?;
        let at = whole_word(place.file.text, place.range.clone(), name)?;
        Some(place.file.span(at))
    };
    let own = |binding: &Option<Binding>, name: &Option<String>, ty| match binding {
        Some(Binding::Location {
            location,
            blend_src: None | Some(0),
            ..
        }) => Some(Output {
            location: *location,
            name: name.clone().unwrap_or_default(),
            kind: types[ty].inner.scalar_kind().unwrap_or(ScalarKind::Float),
            span: name.as_deref().and_then(span).unwrap_or_default(),
        }),
        _ => None,
    };
    let mut outputs: Vec<Output> = match &types[result.ty].inner {
        TypeInner::Struct { members, .. } => {
            let all = members.iter();
            all.filter_map(|m| own(&m.binding, &m.name, m.ty)).collect()
        }
        _ => own(&result.binding, &None, result.ty).into_iter().collect(),
    };
    outputs.sort_by_key(|output| output.location);
    outputs
}

/// Reads `[lighting]` and `[targets]` against a material; nothing when the scene has none and needs none.
pub(super) fn resolve(
    material: &Source,
    toml: Toml,
    table: Option<&Spanned<LightingTable>>,
    targets: &Entries,
    place: Place,
    found: &mut Found,
) -> Result<Option<SceneLighting>> {
    let outputs = outputs(material);
    let targets = read_targets(toml, targets, &outputs)?;
    let Some(table) = table else {
        return forward(material, toml, &outputs, &targets).map(|()| None);
    };
    let (table, whole) = (table.get_ref(), table.span());
    let Some(file) = &table.shader else {
        return Err(toml
            .error("`[lighting]` names no shader", whole, "")
            .with_note(
                "add `shader = \"lighting.wgsl\"`: a full-screen shader that reads what the material writes",
            ));
    };
    let path: PathBuf = place.folder.join(file.get_ref());
    // What is wrong with the name is wrong in the scene; what is wrong in the file, there.
    read_text(&path, "lighting shader").map_err(|error| {
        let located = toml.error(&error.message, file.span(), "relative to this file");
        let notes = error.notes.into_iter();
        // The path is not relative to the current folder here.
        let notes = notes.filter(|note| !note.starts_with("check the path"));
        notes.fold(located, Diagnostic::with_note)
    })?;
    let stages = Stages {
        fragment: table.fragment.clone(),
        ..Stages::default()
    };
    let source = Source::read_stages(&path, &stages)?;
    found.inputs.push(InputFile {
        name: file.get_ref().clone(),
        hash: hash(source.text.as_bytes()),
    });
    found
        .inputs
        .extend(source.others.iter().map(|file| InputFile {
            name: file.name.clone(),
            hash: hash(file.text.as_bytes()),
        }));
    let finder = Finder {
        source: &source,
        toml,
        table,
        outputs: &outputs,
        targets: &targets,
    };
    let reads = finder.reads(whole, found)?;
    for output in &outputs {
        let reads_it =
            |read: &Read| matches!(read.plane, Plane::Target(at, _) if at == output.location);
        let said = matches!(targets.get(&output.location), Some((None, _)));
        if !said && !reads.iter().any(reads_it) {
            found
                .warnings
                .push(*unread(material, output, file.get_ref()));
        }
    }
    let (supplied, vertex) = vertex(&source)?;
    let fragment = Program::compile(&source.module, source.fragment_entry().0, &[])
        .map_err(|refused| refusal(&refused, &source))?;

    let mut said = Said::default();
    let buffers = buffers::resolve(
        &source,
        toml,
        &table.uniforms,
        &table.storage,
        &[],
        &mut said,
    )
    .map_err(of_lighting)?;
    if !said.missing.is_empty() {
        let missing = buffers::missing_error(&source, &format!("`{}`", toml.name), &said.missing);
        return Err(of_lighting(missing));
    }
    // What holds an output of the material is no image of a file.
    let held = |name: &String| reads.iter().any(|read| read.name == *name);
    let mut entries = table.textures.clone();
    entries.0.retain(|(key, _)| !held(key.get_ref()));
    entries.0.extend(reads.iter().map(|read| {
        let dynamic = Node::Text("dynamic".to_owned());
        (
            Spanned::new(0..0, read.name.clone()),
            Spanned::new(0..0, dynamic),
        )
    }));
    let images =
        textures::resolve(&source, toml, &entries, &table.samplers, place).map_err(of_lighting)?;
    let mut constant = Bindings::new();
    for texture in images
        .textures
        .iter()
        .filter(|texture| !held(&texture.name))
    {
        constant.insert((texture.group, texture.binding), texture.resource());
    }
    for sampler in images.samplers {
        constant.insert((sampler.group, sampler.binding), sampler.resource());
    }
    let inferred = said.inferences.into_iter().chain(images.inferences);
    found.inferences.extend(inferred.map(|inference| Inference {
        table: match inference.table {
            "uniforms" => "lighting.uniforms",
            "storage" => "lighting.storage",
            _ => "lighting.textures",
        },
        ..inference
    }));
    let warnings = images.warnings.into_iter();
    found
        .warnings
        .extend(warnings.map(|warning| *of_lighting(Box::new(warning))));
    let files = images.inputs.into_iter();
    found
        .inputs
        .extend(files.map(|(name, hash)| InputFile { name, hash }));
    Ok(Some(SceneLighting {
        file: file.get_ref().clone(),
        lighting: Arc::new(Lighting::new(
            vertex,
            fragment,
            reads
                .into_iter()
                .map(|read| (read.at, read.plane))
                .collect(),
        )),
        source: Arc::new(source),
        supplied: supplied.map(Arc::new),
        buffers,
        constant,
        screen: Arc::new(Object::Screen.mesh(0)),
    }))
}

/// What names a table of the scene names it as one of the lighting.
fn of_lighting(mut diagnostic: Box<Diagnostic>) -> Box<Diagnostic> {
    for note in &mut diagnostic.notes {
        for table in ["uniforms", "storage", "textures", "samplers"] {
            *note = note.replace(&format!("[{table}]"), &format!("[lighting.{table}]"));
        }
    }
    diagnostic
}

fn lines_to_add(why: &str) -> String {
    format!("{why}:\n[lighting]\nshader = \"lighting.wgsl\"")
}

/// Checks a scene without lighting: what is seen is location 0, and the scene says so where there are others.
fn forward(material: &Source, toml: Toml, outputs: &[Output], targets: &Targets) -> Result<()> {
    let formats = targets.values().find(|(format, _)| format.is_some());
    if let Some((_, span)) = formats {
        return Err(toml
            .error(
                "formats are for a scene with `[lighting]` only",
                span.clone(),
                "",
            )
            .with_note(lines_to_add(
                "leave it out, or name the shader that reads the targets",
            )));
    }
    if let Some((_, span)) = targets.get(&0) {
        return Err(toml
            .error("location 0 is what is seen", span.clone(), "")
            .with_note(lines_to_add(
                "leave it out, or name the shader that makes the picture of the others",
            )));
    }
    let others: Vec<&Output> = outputs
        .iter()
        .filter(|output| output.location > 0 && !targets.contains_key(&output.location))
        .collect();
    let Some(first) = others.first() else {
        return Ok(());
    };
    let (_, entry) = material.fragment_entry();
    let error = Diagnostic::error(format!(
        "`{}` returns {} colours, and nothing says what is seen of them",
        entry.name,
        outputs.len()
    ));
    let error = others.iter().fold(error, |error, output| {
        material.locate(error, output.span, "more than a picture")
    });
    let unread: String = others
        .iter()
        .map(|output| format!("\n{} = \"{UNREAD}\"", output.location))
        .collect();
    Err(error
        .with_note(lines_to_add(
            "name the full-screen shader that makes the picture of them, in the scene",
        ))
        .with_note(format!(
            "it reads them as textures, by their names (`gbuffer_{}`) or as the scene says",
            match first.name.as_str() {
                "" => "1",
                name => name,
            }
        ))
        .with_note(format!(
            "or, when location 0 alone is seen and levels may return anything elsewhere:\n[targets]{unread}"
        )))
}

/// What `[targets]` says of the outputs: their format, and nothing of one that is said to be unread.
type Targets = BTreeMap<u32, (Option<Format>, Range<usize>)>;

/// What a target that no lighting reads is called.
const UNREAD: &str = "unread";

/// Reads `[targets]`.
fn read_targets(toml: Toml, targets: &Entries, outputs: &[Output]) -> Result<Targets> {
    let mut said = Targets::new();
    for (key, value) in &targets.0 {
        let location = key.get_ref().parse().ok();
        let Some(output) = outputs.iter().find(|o| Some(o.location) == location) else {
            let known: Vec<String> = outputs.iter().map(|o| o.location.to_string()).collect();
            return Err(toml.unknown("target", key, known.iter().map(String::as_str)));
        };
        let Node::Text(name) = value.get_ref() else {
            return Err(toml
                .error(
                    "a target's format is a text",
                    value.span(),
                    format!("this is {}", value.get_ref().what()),
                )
                .with_note("such as \"rgba8unorm-srgb\" or \"rgba16float\""));
        };
        if name == UNREAD {
            said.insert(output.location, (None, value.span()));
            continue;
        }
        let Some(format) = Format::of_name(name) else {
            let error = toml.error(format!("there is no format `{name}`"), value.span(), "");
            if name.contains("32uint") || name.contains("32sint") {
                return Err(error.with_note(
                    "integers of 32 bits are not drawn to targets; 16 bits are, such as \"rgba16uint\"",
                ));
            }
            let known: Vec<&str> = Format::names().chain([UNREAD]).collect();
            return Err(suggest(error, name, &known));
        };
        if format.kind() != output.kind {
            return Err(toml
                .error(
                    format!(
                        "`{name}` does not hold what the material returns at location {}",
                        output.location
                    ),
                    value.span(),
                    format!("it holds {}", kind_name(format.kind())),
                )
                .with_note(format!(
                    "the material returns {} there, as \"{}\" holds them",
                    kind_name(output.kind),
                    guess(output)
                )));
        }
        said.insert(output.location, (Some(format), value.span()));
    }
    Ok(said)
}

fn kind_name(kind: ScalarKind) -> &'static str {
    match kind {
        ScalarKind::Sint => "signed integers",
        ScalarKind::Uint => "unsigned integers",
        _ => "floats",
    }
}

/// The format that an output most likely has.
fn guess(output: &Output) -> &'static str {
    match output.kind {
        ScalarKind::Sint => "rgba16sint",
        ScalarKind::Uint => "rgba16uint",
        _ if is_colour(&output.name)
            && !words(&output.name).iter().any(|w| w.starts_with("emissi")) =>
        {
            "rgba8unorm-srgb"
        }
        _ => "rgba16float",
    }
}

/// A texture of the lighting shader that holds what the material wrote.
struct Read {
    name: String,
    at: (u32, u32),
    plane: Plane,
}

/// An output that the picture does not depend on.
fn unread(material: &Source, output: &Output, file: &str) -> Box<Diagnostic> {
    let location = output.location;
    let name = match output.name.as_str() {
        "" => String::new(),
        name => format!("`{name}`, "),
    };
    let warning = Diagnostic::warning(format!(
        "{name}location {location}, is read by no texture of `{file}`: levels may return anything there"
    ));
    material.locate(warning, output.span, "returned here").with_note(format!(
        "let that shader read it, when another pass does; or say `{location} = \"{UNREAD}\"` under [targets]"
    ))
}

/// Finds the textures that hold the material's outputs.
struct Finder<'f> {
    source: &'f Source,
    toml: Toml<'f>,
    table: &'f LightingTable,
    outputs: &'f [Output],
    targets: &'f Targets,
}

impl Finder<'_> {
    fn reads(&self, whole: Range<usize>, found: &mut Found) -> Result<Vec<Read>> {
        let Self {
            source,
            toml,
            table,
            outputs,
            ..
        } = *self;
        let module = &source.module;
        let mut reads = Vec::new();
        for (handle, variable) in module.global_variables.iter() {
            let TypeInner::Image {
                dim,
                arrayed,
                class,
            } = module.types[variable.ty].inner
            else {
                continue;
            };
            let (Some(binding), Some(name)) = (&variable.binding, &variable.name) else {
                continue;
            };
            let entry = table.textures.get(name);
            let said = entry.and_then(|entry| match entry.get_ref() {
                Node::Text(text) => Some((text.strip_prefix("target ")?, entry.span())),
                _ => None,
            });
            let wanted = match (&said, entry) {
                (Some((what, span)), _) => {
                    let known: Vec<String> = (outputs.iter().map(|o| o.location.to_string()))
                        .chain(["depth".to_owned()])
                        .collect();
                    if !known.iter().any(|known| known == what) {
                        return Err(toml
                            .error(
                                format!("the material has no target `{what}`"),
                                span.clone(),
                                "",
                            )
                            .with_note(format!(
                                "it has {}",
                                listed(known.iter().map(String::as_str))
                            )));
                    }
                    what.parse().ok()
                }
                // It has an image of its own.
                (None, Some(_)) => continue,
                (None, None) => match infer(name, outputs) {
                    Some(wanted) => {
                        let value = match wanted {
                            Some(location) => format!("\"target {location}\""),
                            None => "\"target depth\"".to_owned(),
                        };
                        found
                            .inferences
                            .push(Inference::new("lighting.textures", name, &value));
                        wanted
                    }
                    None => continue,
                },
            };
            let output = outputs
                .iter()
                .find(|output| Some(output.location) == wanted);
            let plane = match output {
                Some(output) => Plane::Target(output.location, self.format(output, name, found)?),
                None => Plane::Depth,
            };
            let fits = match (class, plane) {
                (ImageClass::Sampled { kind, multi: false }, Plane::Target(_, format)) => {
                    kind == format.kind()
                }
                (ImageClass::Sampled { kind, multi: false }, Plane::Depth) => {
                    kind == ScalarKind::Float
                }
                (ImageClass::Depth { multi: false }, Plane::Depth) => true,
                _ => false,
            };
            if !fits || dim != ImageDimension::D2 || arrayed {
                return Err(cannot_hold(source, handle, name, plane));
            }
            reads.push(Read {
                name: name.clone(),
                at: (binding.group, binding.binding),
                plane,
            });
        }
        if reads.is_empty() {
            let example = outputs.first().map_or(0, |output| output.location);
            let textures: BTreeSet<&str> = module
                .global_variables
                .iter()
                .filter(|(_, v)| matches!(module.types[v.ty].inner, TypeInner::Image { .. }))
                .filter_map(|(_, v)| v.name.as_deref())
                .collect();
            let error = toml.error(
                "the lighting shader reads nothing that the material writes",
                whole,
                "",
            );
            return Err(match textures.first() {
            None => error.with_note("declare a texture for each output that it wants, such as `@group(0) @binding(0) var gbuffer_albedo: texture_2d<f32>;`"),
            Some(texture) => error.with_note(format!(
                "say which of its textures hold outputs:\n[lighting.textures]\n{texture} = \"target {example}\""
            )),
        });
        }
        Ok(reads)
    }

    /// The format of an output that a texture reads: said, or told from its name and type.
    fn format(&self, output: &Output, texture: &str, found: &mut Found) -> Result<Format> {
        let location = output.location;
        match self.targets.get(&location) {
            Some((Some(format), _)) => return Ok(*format),
            Some((None, span)) => {
                return Err(self
                    .toml
                    .error(
                        format!("target {location} is read by `{texture}`"),
                        span.clone(),
                        "",
                    )
                    .with_note("say in which format it is stored, such as \"rgba16float\""));
            }
            None => {}
        }
        let name = guess(output);
        let key = location.to_string();
        let inference = Inference::new("targets", &key, &format!("\"{name}\""));
        if !found.inferences.contains(&inference) {
            found.inferences.push(inference);
        }
        Ok(Format::of_name(name).expect("what is guessed is a format"))
    }
}

fn cannot_hold(
    source: &Source,
    handle: Handle<GlobalVariable>,
    name: &str,
    plane: Plane,
) -> Box<Diagnostic> {
    let (what, wants) = match plane {
        Plane::Depth => (
            "the depth".to_owned(),
            "texture_depth_2d` or `texture_2d<f32>",
        ),
        Plane::Target(location, format) => (
            format!("target {location}, a {}", format.name()),
            match format.kind() {
                ScalarKind::Uint => "texture_2d<u32>",
                ScalarKind::Sint => "texture_2d<i32>",
                _ => "texture_2d<f32>",
            },
        ),
    };
    source
        .error(format!("`{name}` cannot hold {what}"), source.variable(handle), "")
        .with_note(format!(
            "declare it as `{wants}`, or say in the scene what it holds: `{name} = ...` under [lighting.textures]"
        ))
}

/// What a texture's name says that it holds: a location, or (inner `None`) the depth.
fn infer(name: &str, outputs: &[Output]) -> Option<Option<u32>> {
    const FILLERS: [&str; 17] = [
        "g",
        "gbuffer",
        "buffer",
        "gbuf",
        "rt",
        "t",
        "tex",
        "texture",
        "map",
        "target",
        "deferred",
        "scene",
        "input",
        "attachment",
        "out",
        "output",
        "material",
    ];
    let meaning = |name: &str| -> Vec<String> {
        let all = words(name).into_iter();
        all.filter(|word| !FILLERS.contains(&word.as_str()))
            .collect()
    };
    let wanted = meaning(name);
    if wanted.is_empty() {
        return None;
    }
    let mut named = outputs.iter();
    if let Some(output) = named.find(|output| meaning(&output.name) == wanted) {
        return Some(Some(output.location));
    }
    match wanted.as_slice() {
        [word] if word == "depth" => Some(None),
        [number] => {
            let location = number.parse().ok()?;
            let known = outputs.iter().any(|output| output.location == location);
            known.then_some(Some(location))
        }
        _ => None,
    }
}

/// The vertex stage of the lighting: its own, or one that covers the screen, with its module.
fn vertex(source: &Source) -> Result<(Option<Module>, Program)> {
    if let Some((entry, _)) = source.vertex_entry() {
        let mut read = inputs(source, entry).into_iter();
        if let Some(input) = read.find(|i| matches!(i.binding, Binding::Location { .. })) {
            return Err(source
                .error(
                    format!("the lighting shader's vertex stage reads `{}` from a mesh", input.name),
                    input.span,
                    "",
                )
                .with_note("a full-screen shader makes its triangle of `@builtin(vertex_index)`; leave the stage out, and lodc supplies one"));
        }
        let own = Program::compile(&source.module, entry, &[]);
        return Ok((None, own.map_err(|refused| refusal(&refused, source))?));
    }
    let read = inputs(source, source.fragment_entry().0);
    let mut members = String::new();
    let mut values = String::new();
    for Input {
        name,
        binding,
        ty,
        span,
    } in read
    {
        let Binding::Location { location, .. } = binding else {
            continue;
        };
        let two = TypeInner::Vector {
            size: VectorSize::Bi,
            scalar: Scalar::F32,
        };
        if source.module.types[ty].inner != two {
            return Err(source
                .error(format!("nothing feeds `{name}` of the lighting shader"), span, "")
                .with_note("without a vertex stage a lighting shader is given its texture coordinates, a vec2f, and built-ins"));
        }
        members.push_str(&format!(
            "    @location({location}) at{location}_: vec2<f32>,\n"
        ));
        values.push_str(", uv");
    }
    let text = format!(
        "struct Screen {{\n    @builtin(position) position: vec4<f32>,\n{members}}}\n\
         @vertex fn screen(@builtin(vertex_index) index: u32) -> Screen {{\n    \
         let uv = vec2<f32>(f32((index << 1u) & 2u), f32(index & 2u));\n    \
         return Screen(vec4<f32>(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y, 0.0, 1.0){values});\n}}\n"
    );
    let broken = |what: String| {
        Diagnostic::error("the vertex stage that lodc supplies to the lighting is not valid")
            .with_reason(what)
            .with_note(
                "this is a bug in lodc; a vertex entry point in the lighting shader goes round it",
            )
    };
    let module =
        naga::front::wgsl::parse_str(&text).map_err(|error| broken(error.emit_to_string(&text)))?;
    validate(&module).map_err(|error| broken(error.emit_to_string(&text)))?;
    let program = Program::compile(&module, 0, &[]).map_err(|refused| broken(refused.what))?;
    Ok((Some(module), program))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eval::draw::Shading;
    use crate::eval::raster::rasterize;
    use crate::scene::Scene;

    /// A folder of its own for a test, removed at the end.
    struct Folder(PathBuf);

    impl Folder {
        fn new(name: &str) -> Self {
            let name = format!("lodc-lighting-{name}-{}", std::process::id());
            let path = std::env::temp_dir().join(name);
            std::fs::create_dir_all(&path).unwrap();
            Self(path)
        }

        /// The scene of a material that a shader lights; the scene names it.
        fn scene(&self, material: &str, lighting: &str, toml: &str) -> Result<(Source, Scene)> {
            std::fs::write(self.0.join("light.wgsl"), lighting).unwrap();
            let path = self.0.join("scene.toml");
            let source = Source::parse("a.wgsl", material)?;
            let scene = Scene::resolve(&source, Some((&path, toml)))?;
            Ok((source, scene))
        }
    }

    impl Drop for Folder {
        fn drop(&mut self) {
            let _ = std::fs::remove_dir_all(&self.0);
        }
    }

    const MATERIAL: &str = "
        struct G { @location(0) base_color: vec4f, @location(1) world: vec4f, @location(3) id: u32 }
        @fragment fn fs(@builtin(position) at: vec4f, @location(0) world_position: vec3f) -> G {
            return G(vec4f(0.2, 0.4, 0.6, 1.0), vec4f(world_position, 1.0), u32(at.x));
        }";

    /// How far the world position out of the depth is from the one that the material wrote.
    const LIGHTING: &str = "
        struct Camera { inverse_view_projection: mat4x4f, screen_size: vec2f }
        @group(0) @binding(0) var<uniform> camera: Camera;
        @group(0) @binding(1) var gbuffer_base_color: texture_2d<f32>;
        @group(0) @binding(2) var gbuffer1: texture_2d<f32>;
        @group(0) @binding(3) var depth_texture: texture_2d<f32>;
        @group(0) @binding(4) var ids: texture_2d<u32>;
        @fragment fn light(@builtin(position) at: vec4f) -> @location(0) vec4f {
            let pixel = vec2i(at.xy);
            let clip = vec4f(at.xy / camera.screen_size * vec2f(2.0, -2.0) + vec2f(-1.0, 1.0),
                textureLoad(depth_texture, pixel, 0).x, 1.0);
            let world = camera.inverse_view_projection * clip;
            let off = distance(world.xyz / world.w, textureLoad(gbuffer1, pixel, 0).xyz);
            return vec4f(off, textureLoad(gbuffer_base_color, pixel, 0).x, f32(textureLoad(ids, pixel, 0).x), at.x);
        }";

    const TOML: &str = "
        resolution = [48, 32]
        [targets]
        1 = \"rgba32float\"
        [lighting]
        shader = \"light.wgsl\"
        [lighting.textures]
        ids = \"target 3\"
        [attributes]
        world_position = \"position\"";

    #[test]
    fn what_a_deferred_scene_leaves_out_is_told_from_names() {
        let folder = Folder::new("inferred");
        let (_, scene) = folder.scene(MATERIAL, LIGHTING, TOML).unwrap();
        let said: Vec<(&str, &str)> = scene
            .inferences
            .iter()
            .map(|i| (i.table, i.line_to_add.as_str()))
            .collect();
        for expected in [
            ("targets", "0 = \"rgba8unorm-srgb\""),
            ("targets", "3 = \"rgba16uint\""),
            ("lighting.textures", "gbuffer_base_color = \"target 0\""),
            ("lighting.textures", "gbuffer1 = \"target 1\""),
            ("lighting.textures", "depth_texture = \"target depth\""),
            (
                "lighting.uniforms",
                "\"camera.inverse_view_projection\" = \"inverse-view-projection\"",
            ),
            (
                "lighting.uniforms",
                "\"camera.screen_size\" = \"resolution\"",
            ),
        ] {
            assert!(said.contains(&expected), "{expected:?} in {said:?}");
        }
        let last = scene.inputs.last().unwrap();
        assert_eq!((last.name.as_str(), last.hash.len()), ("light.wgsl", 71));
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
        // The lines that it prints are a scene with nothing left to tell.
        let tables: BTreeSet<&str> = scene.inferences.iter().map(|i| i.table).collect();
        let lines = |table: &str| -> Vec<&str> {
            let own = scene.inferences.iter().filter(|i| i.table == table);
            own.map(|i| i.line_to_add.as_str()).collect()
        };
        let text: String = tables
            .iter()
            .map(|table| format!("[{table}]\n{}\n", lines(table).join("\n")))
            .collect();
        let text = text
            .replace(
                "[lighting.textures]",
                "[lighting]\nshader = \"light.wgsl\"\n[lighting.textures]\nids = \"target 3\"",
            )
            .replace("[targets]", "[targets]\n1 = \"rgba32float\"")
            + "[attributes]\nworld_position = \"position\"\n";
        let (_, said) = folder.scene(MATERIAL, LIGHTING, &text).unwrap();
        assert!(said.inferences.is_empty(), "{:?}", said.inferences);
    }

    #[test]
    fn world_positions_out_of_the_depth_are_those_of_the_material() {
        let folder = Folder::new("depth");
        let (source, scene) = folder.scene(MATERIAL, LIGHTING, TOML).unwrap();
        let vertex = &scene.vertex_stage.as_ref().unwrap().module;
        let vertex = Program::compile(vertex, 0, &[]).unwrap();
        let material = Program::compile(&source.module, source.fragment_entry().0, &[]).unwrap();
        let stored = srgb_steps(0.2);
        for (offset, grid) in [([0.0, 0.0], 1), ([0.4, -0.3], 1), ([0.0, 0.0], 4)] {
            let mut frame = scene.frames(3.0).remove(1);
            (frame.offset, frame.grid) = (offset, grid);
            let coverage = rasterize(&vertex, &material, &frame);
            let lit = scene.lit(&frame, &coverage).unwrap();
            let mut shading = Shading::default();
            lit.shade_into(&material, &coverage, &frame.bindings, &mut shading);
            assert!(coverage.fragments > 100);
            for (colour, pixel) in shading.colours.iter().zip(coverage.pixels()) {
                // The silhouette's depths are steep.
                assert!(colour[0] < 2e-3, "{offset:?} {grid}: off by {}", colour[0]);
                assert!((colour[1] - stored).abs() < 1e-6);
                let x = pixel % coverage.width;
                assert_eq!(colour[2], (x / grid) as f32);
                assert_eq!(colour[3], x as f32 + 0.5);
            }
        }
    }

    fn srgb_steps(linear: f32) -> f32 {
        Format::of_name("rgba8unorm-srgb")
            .unwrap()
            .store([linear; 4])[0]
    }

    #[test]
    fn an_output_that_nobody_reads_is_warned_of() {
        let folder = Folder::new("unread");
        let without = TOML.replace("ids = \"target 3\"", "ids = \"dynamic\"");
        let (_, scene) = folder.scene(MATERIAL, LIGHTING, &without).unwrap();
        let text: String = scene.warnings.iter().map(ToString::to_string).collect();
        assert!(
            text.contains("`id`, location 3, is read by no texture of `light.wgsl`"),
            "{text}"
        );
        assert!(
            text.contains("say `3 = \"unread\"` under [targets]"),
            "{text}"
        );
        let said = without.replace("[targets]", "[targets]\n3 = \"unread\"");
        let (_, scene) = folder.scene(MATERIAL, LIGHTING, &said).unwrap();
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    }

    #[test]
    fn what_is_wrong_with_a_deferred_scene_is_located() {
        let folder = Folder::new("wrong");
        let table = "[lighting]\nshader = \"light.wgsl\"\n";
        let read = "@group(0) @binding(0) var gbuffer_world: texture_2d<f32>;
            @fragment fn light(@builtin(position) at: vec4f) -> @location(0) vec4f {
                return textureLoad(gbuffer_world, vec2i(at.xy), 0);
            }";
        for (lighting, toml, message, note) in [
            (read, "", "`fs` returns 3 colours, and nothing says what is seen of them", "[lighting]\nshader"),
            (read, "[targets]\n0 = \"rgba8unorm\"", "formats are for a scene with `[lighting]` only", "leave it out"),
            (read, "[lighting]", "`[lighting]` names no shader", "add `shader = "),
            (read, "[lighting]\nshader = \"ligth.wgsl\"", "there is no lighting shader file", "there is a `light.wgsl`"),
            (read, &format!("{table}[targets]\n7 = \"rgba8unorm\""), "there is no target `7`", "`0`, `1` and `3`"),
            (read, &format!("{table}[targets]\n0 = \"rgba8unrom\""), "there is no format `rgba8unrom`", "did you mean `rgba8unorm`"),
            (read, &format!("{table}[targets]\n3 = \"rgba32uint\""), "there is no format `rgba32uint`", "rgba16uint"),
            (read, &format!("{table}[targets]\n3 = \"rgba8unorm\""), "`rgba8unorm` does not hold what the material returns at location 3", "unsigned integers"),
            (read, &format!("{table}[targets]\n1 = \"unread\""), "target 1 is read by `gbuffer_world`", "rgba16float"),
            (read, &format!("{table}[lighting.textures]\ngbuffer_world = \"target 3\""), "`gbuffer_world` cannot hold target 3, a rgba16uint", "texture_2d<u32>"),
            (read, &format!("{table}[lighting.textures]\ngbuffer_world = \"target 5\""), "the material has no target `5`", "`depth`"),
            (read, &format!("{table}[lighting.textures]\ngbuffer_wrld = \"target 1\""), "there is no texture `gbuffer_wrld`", "`gbuffer_world`"),
            (read, &format!("{table}[lighting.textures]\ngbuffer_world = \"dynamic\""), "the lighting shader reads nothing that the material writes", "gbuffer_world = \"target 0\""),
            ("@fragment fn light() -> @location(0) vec4f { return vec4f(1.0); }", table, "the lighting shader reads nothing that the material writes", "declare a texture"),
            ("@group(0) @binding(0) var<uniform> strange: vec4f;
              @group(0) @binding(1) var gbuffer_world: texture_2d<f32>;
              @fragment fn light() -> @location(0) vec4f { return strange + textureLoad(gbuffer_world, vec2i(), 0); }",
             table, "what `strange` holds is not known", "[lighting.uniforms]\n\"strange\""),
            ("@group(0) @binding(1) var gbuffer_world: texture_2d<f32>;
              @fragment fn light(@location(0) ray: vec3f) -> @location(0) vec4f { return vec4f(ray, 1.0) + textureLoad(gbuffer_world, vec2i(), 0); }",
             table, "nothing feeds `ray` of the lighting shader", "vec2f"),
            ("@group(0) @binding(1) var gbuffer_world: texture_2d<f32>;
              @vertex fn vs(@location(0) p: vec3f) -> @builtin(position) vec4f { return vec4f(p, 1.0); }
              @fragment fn light() -> @location(0) vec4f { return textureLoad(gbuffer_world, vec2i(), 0); }",
             table, "the lighting shader's vertex stage reads `p` from a mesh", "lodc supplies one"),
        ] {
            let error = folder.scene(MATERIAL, lighting, toml).unwrap_err();
            assert!(error.message.contains(message), "{error}");
            assert!(error.notes.join("\n").contains(note), "{error}");
            assert!(!error.labels.is_empty(), "{error}");
        }
    }
}
