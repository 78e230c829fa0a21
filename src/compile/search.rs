//! Compiling with a search: read, normalise, resolve the scene, search, emit, lock, report.

use super::clock::{Timings, untimed};
#[cfg(feature = "mesh")]
use super::joint;
use super::{Files, Request, normal_form, relative, textures};
use crate::emit::{self, EmitLevel, Form, Lock, LockedGenerated, Output, figure};
use crate::eval::draw::shade;
use crate::eval::machine::MAX_ROUNDS;
use crate::eval::program::{Program, Refused};
use crate::eval::programs::Stand;
use crate::eval::raster::rasterize;
use crate::eval::refusal;
use crate::front::Source;
use crate::report::{Input, Origin, Report, TransitionReport};
use crate::scene::{Reading, Scene};
use crate::search::{
    self, Found, Level, Progress, SampleSet, Samples, coordinates_per_pixel, texels_per_pixel,
};
use crate::time::clock::{Clock, worst_ratio};
use crate::{Diagnostic, Result};
use lodc_passes::texture_collapse::MOST_TEXTURES;
use lodc_passes::{Candidate, Recipe, Shader, Stage};
use naga::Expression;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// What compiling gives.
#[derive(Debug)]
pub struct Compiled {
    /// The shader, the lock and the report, to be written.
    pub files: Files,
    /// The report.
    pub report: Report,
    /// What is emitted.
    pub output: Output,
    /// How many timings there were, where times were to be measured.
    pub timings: Option<Timings>,
    /// What should be known, located.
    pub warnings: Vec<Box<Diagnostic>>,
}

/// Squares of 2 x 2 pixels that are drawn to see whether the shader's loops end.
const TRIED: usize = 64;

/// Everything that a search stands on.
pub(super) struct Ready {
    /// The request, with what the scene says of how the shader is read.
    pub(super) request: Request,
    pub(super) source: Source,
    pub(super) scene: Scene,
    /// The scene file, when there is one.
    pub(super) scene_file: Option<PathBuf>,
    pub(super) base: Shader,
}

/// A shader that has been read, before the scene is held against it.
pub(super) struct Read {
    /// The request, with what the scene says of how the shader is read.
    pub(super) request: Request,
    pub(super) source: Source,
    /// The scene file, when there is one.
    pub(super) scene_file: Option<PathBuf>,
    pub(super) base: Shader,
}

impl Read {
    /// Reads the shader with its scene, or the scene beside it.
    pub(super) fn new(request: &Request) -> Result<Self> {
        let beside = request.shader.with_extension("toml");
        let scene = request.scene.clone();
        let scene = scene.or_else(|| beside.is_file().then_some(beside));
        Self::of(as_scene_says(request, scene.as_deref())?, scene)
    }

    /// Reads a shader as the scene file of another one says. A vertex file is for shaders that have no vertex stage: what
    /// was emitted from several files has its own.
    pub(super) fn beside(request: &Request, scene_file: Option<PathBuf>) -> Result<Self> {
        let request = as_scene_says(request, scene_file.as_deref())?;
        let mut alone = request.clone();
        if alone.stages.vertex_file.take().is_some() {
            alone.stages.vertex = None;
            let read = Self::of(alone, scene_file.clone())?;
            if read.source.vertex.is_some() {
                return Ok(read);
            }
        }
        Self::of(request, scene_file)
    }

    fn of(request: Request, scene_file: Option<PathBuf>) -> Result<Self> {
        let source = Source::read_with(&request.shader, &request.stages, &request.modules)?;
        // What the evaluator cannot run is said before the scene asks for values of it.
        let base = normal_form(&source)?.with_passes(request.passes.clone());
        fragment_program(&base).map_err(|refused| refusal(&refused, &source))?;
        Ok(Self {
            request,
            source,
            scene_file,
            base,
        })
    }

    /// With the scene as it is for this shader.
    pub(super) fn ready(self, mut scene: Scene) -> Ready {
        scene.reading = self.request.bound.unwrap_or(scene.reading);
        scene.goal = self.request.goal.unwrap_or(scene.goal);
        scene.host.parameters |= self.request.parameters;
        scene.host.textures |= self.request.textures;
        if let Some(mib) = self.request.max_texture_memory {
            scene.host.most_texture_bytes = Some(u64::from(mib) << 20);
        }
        Ready {
            request: self.request,
            source: self.source,
            scene,
            scene_file: self.scene_file,
            base: self.base,
        }
    }
}

/// A request, with what the scene file says of how its shader is read.
fn as_scene_says(request: &Request, scene_file: Option<&Path>) -> Result<Request> {
    let mut request = request.clone();
    // A shader that is not there is the better message.
    if let Some(file) = scene_file.filter(|_| request.shader.exists()) {
        let reading = Reading::read(file)?;
        let stages = &mut request.stages;
        stages.vertex_file = stages.vertex_file.take().or(reading.vertex_file);
        let mut modules = reading.modules;
        modules.folders.append(&mut request.modules.folders);
        modules.definitions.append(&mut request.modules.definitions);
        request.modules = modules;
    }
    Ok(request)
}

impl Ready {
    pub(super) fn read(request: &Request) -> Result<Self> {
        let read = Read::new(request)?;
        let scene = Scene::read(&read.source, read.scene_file.as_deref())?;
        Ok(read.ready(scene))
    }

    /// The vertex program: of the source, or the one that lodc supplies.
    pub(super) fn vertex(&self) -> Result<Program> {
        vertex_program(&self.scene, &self.base).map_err(|refused| refusal(&refused, &self.source))
    }

    /// The fragment program.
    pub(super) fn fragment(&self) -> Result<Program> {
        fragment_program(&self.base).map_err(|refused| refusal(&refused, &self.source))
    }

    /// What a search measures with.
    pub(super) fn stand<'a>(&'a self, vertex: &'a Program) -> Stand<'a> {
        Stand {
            base: &self.base,
            vertex,
            scene: &self.scene,
        }
    }
}

/// The fragment program of a shader.
fn fragment_program(base: &Shader) -> std::result::Result<Program, Refused> {
    Program::compile(base.module(), base.index(Stage::Fragment).unwrap_or(0), &[])
}

/// The vertex program of a shader in its scene: its own, or the one that lodc supplies.
pub(super) fn vertex_program(
    scene: &Scene,
    base: &Shader,
) -> std::result::Result<Program, Refused> {
    match (&scene.vertex_stage, base.index(Stage::Vertex)) {
        (Some(stage), _) => Program::compile(&stage.module, 0, &[]),
        (None, index) => Program::compile(base.module(), index.unwrap_or(0), &[]),
    }
}

impl Ready {
    /// Draws some of the first frame, since a loop that does not end would be run for every pixel of all frames.
    pub(super) fn ends(&self, vertex: &Program) -> Result<()> {
        let fragment = self.fragment()?;
        let Some(frame) = self.scene.frames(self.scene.nearest).into_iter().next() else {
            return Ok(());
        };
        let coverage = rasterize(vertex, &fragment, &frame);
        let squares = coverage.squares();
        let apart = squares.len().div_ceil(TRIED).max(1);
        let tried: BTreeSet<_> = squares.into_iter().step_by(apart).collect();
        let some = coverage.part(|square| tried.contains(&square));
        let profile = shade(&fragment, &some, &frame.bindings).profile;
        match profile.endless {
            None => Ok(()),
            Some(span) => Err(self
                .source
                .error(
                    format!("the loops of a pixel go on for more than {MAX_ROUNDS} rounds"),
                    span,
                    "stopped here",
                )
                .with_note("let it end earlier, such as `for (var i = 0; i < 64; i++)`, or give a uniform that it depends on another value in the scene")),
        }
    }
}

/// Compiles a material shader: searches its levels, and makes the files that hold them.
///
/// # Errors
/// When an input cannot be read or is wrong, at its place.
pub fn compile(request: &Request, progress: &(dyn Fn(Progress) + Sync)) -> Result<Compiled> {
    let ready = Ready::read(request)?;
    let vertex = ready.vertex()?;
    ready.ends(&vertex)?;
    let inputs: Vec<PathBuf> = ready.inputs(request).collect();
    // What cannot be written should be known before a search that takes a minute.
    let emission = request.emission(Output {
        per_pixel: match request.per_pixel {
            true => Some(ready.coordinates_per_pixel()?),
            false => None,
        },
        ..Output::default()
    });
    #[cfg(feature = "mesh")]
    ready.may_join(request)?;
    let trial = request.emitted((&ready.source, &ready.base), &[], emission)?;
    request.spare(&trial, &inputs)?;
    emit::writable(&trial)?;

    let stand = ready.stand(&vertex);
    let kept = ready.kept(request)?;
    let (mut watch, untimed) = match ready.watch(request)? {
        Ok(watch) => (watch, None),
        Err(error) => (None, Some(untimed(&error))),
    };
    let clock = watch.as_mut().map(|watch| watch as &mut dyn Clock);
    let old = old_recipes(request)?;
    let wanted = (request.exact, &kept);
    let mut found = search::find_from(&stand, wanted, &old, clock, progress)
        .map_err(|refused| refusal(&refused, &ready.source))?;
    #[cfg(feature = "mesh")]
    let joint = {
        let clock = watch.as_mut().map(|watch| watch as &mut dyn Clock);
        ready.join(request, &vertex, &found, &kept, clock)?
    };
    #[cfg(feature = "mesh")]
    if let Some(joint) = &joint {
        found.levels = joint.levels.iter().map(|of| of.level.clone()).collect();
        found.timed += joint.timed as usize;
    }
    let says: Vec<String> = found.levels.iter().map(|level| ready.says(level)).collect();
    // What is emitted: with meshes, levels that have new ones alone are not.
    #[cfg(feature = "mesh")]
    let of_shaders = joint.as_ref().map(|_| joint::of_shaders(&found));
    #[cfg(not(feature = "mesh"))]
    let of_shaders: Option<Found> = None;
    let emitted = of_shaders.as_ref().unwrap_or(&found);
    let levels: Vec<EmitLevel> = (emitted.written())
        .map(|(_, level)| emit_level(level, &ready.says(level)))
        .collect();

    let mut files = request.emitted((&ready.source, &ready.base), &levels, emission)?;
    let transitions = ready.transitions(&vertex, emitted, &levels, emission, watch.as_mut())?;
    let mut of_time: Vec<Box<Diagnostic>> = untimed.into_iter().collect();
    if let Some(watch) = &mut watch {
        // A branch by a uniform is timed on one mesh.
        #[cfg(feature = "mesh")]
        let is_joint = joint.is_some();
        #[cfg(not(feature = "mesh"))]
        let is_joint = false;
        if !is_joint {
            watch.branches(&ready.base, &mut found.levels, &levels);
        }
        of_time.extend(watch.warnings(&found.levels));
        let recording = watch.recording();
        files.extend(recording.map(|(file, text)| (file, text.into_bytes())));
    }
    let textures = emit::generated_textures(&ready.source, &levels, emission.form)?;
    let made = textures::make(&ready.scene, &textures)?;
    let generated: Vec<LockedGenerated> = made.iter().map(|made| made.locked.clone()).collect();
    files.extend(request.texture_files(made));
    #[cfg_attr(not(feature = "mesh"), allow(unused_mut))]
    let mut lock = Lock {
        generated: generated.clone(),
        ..ready.lock(
            (request, emission),
            of_shaders.as_ref().unwrap_or(&found),
            &levels,
            &transitions,
        )
    };
    #[cfg(feature = "mesh")]
    let meshes = match &joint {
        Some(joint) => ready.meshes(request, joint)?,
        None => joint::Meshes::default(),
    };
    #[cfg(feature = "mesh")]
    {
        files.extend(meshes.files);
        lock.meshes = meshes.locked;
        lock.mesh = meshes.levels;
    }
    files.push((request.lock(), lock.to_toml().into_bytes()));
    let mut origin = Origin {
        generated,
        ..ready.origin(request)
    };
    let reached = ready.has_nothing_to_save(&found);
    origin
        .warnings
        .extend(reached.iter().map(|w| w.message.clone()));
    let visible = to_be_visible(&ready.base, found.levels.iter().map(|level| &level.shader));
    let many = too_many(&ready.base, textures.len(), emission);
    let limit = limits_nothing(&ready.scene);
    of_time.extend(ready.unstable(&found));
    let visible = visible.into_iter().chain(many).chain(of_time);
    let visible: Vec<Box<Diagnostic>> = visible.chain(limit).collect();
    origin
        .warnings
        .extend(visible.iter().map(|w| w.message.clone()));
    origin.transitions = transitions;
    #[cfg(feature = "mesh")]
    {
        origin.meshes = meshes.of_levels;
        origin.shown = meshes.shown;
        origin.joint = meshes.report;
    }
    let report = Report::new(&found, &ready.base, &ready.source, &says, origin);
    files.push((request.beside("lod.json"), report.json().into_bytes()));
    request.spare(&files, &inputs)?;
    Ok(Compiled {
        files,
        report,
        output: emission,
        timings: watch.map(|watch| watch.counts),
        warnings: ready
            .scene
            .warnings
            .iter()
            .cloned()
            .map(Box::new)
            .chain(visible)
            .chain(reached)
            .collect(),
    })
}

/// The recipes of the lock that is to be renewed.
fn old_recipes(request: &Request) -> Result<Vec<Recipe>> {
    if !request.update {
        return Ok(Vec::new());
    }
    let (lock, _) = Lock::read(&request.lock())?;
    Ok(lock.levels.into_iter().map(|level| level.recipe).collect())
}

/// Says which bindings levels read in the vertex stage that the original reads in the fragment stage alone: a host may
/// have laid them out for that one only.
fn to_be_visible<'a>(
    base: &Shader,
    levels: impl Iterator<Item = &'a Shader>,
) -> Option<Box<Diagnostic>> {
    let read = |shader: &Shader| -> BTreeSet<String> {
        let function = shader.function(Stage::Vertex);
        let values = function.into_iter().flat_map(|f| f.expressions.iter());
        values
            .filter_map(|(_, expression)| match expression {
                Expression::GlobalVariable(global) => {
                    let variable = &shader.module().global_variables[*global];
                    variable.name.clone().filter(|_| variable.binding.is_some())
                }
                _ => None,
            })
            .collect()
    };
    let before = read(base);
    let names: BTreeSet<String> = levels
        .flat_map(read)
        .filter(|name| !before.contains(name))
        .collect();
    let names: Vec<String> = names.into_iter().map(|name| format!("`{name}`")).collect();
    (!names.is_empty()).then(|| {
        Diagnostic::warning(format!("the vertex stage of levels reads {} too", names.join(", ")))
            .with_note("a bind group layout that shows them to the fragment stage alone has to show them to the vertex stage as well")
    })
}

/// Warns where the original's textures and those that were made for levels are more than a device has to bind at once.
fn too_many(base: &Shader, made: usize, emission: Output) -> Option<Box<Diagnostic>> {
    let all = base.sampled_textures() + made;
    let at_once = emission.form != Form::Files && made > 0;
    (at_once && all > MOST_TEXTURES).then(|| {
        Diagnostic::warning(format!(
            "all levels together sample {all} textures, and WebGPU's default limit is {MOST_TEXTURES}"
        ))
        .with_note("ask the device for more, or write one file a level: `--form files`")
    })
}

/// Warns where the memory of made textures is limited, and none are made.
fn limits_nothing(scene: &Scene) -> Option<Box<Diagnostic>> {
    let host = scene.host;
    (host.most_texture_bytes.is_some() && !host.textures).then(|| {
        Diagnostic::warning(
            "the memory of textures that are made for levels is limited, but none may be made",
        )
        .with_note(
            "allow them with `--host textures`, or `host = { textures = true }` in the scene; else leave the limit out",
        )
    })
}

/// A level's figures as the lock and the shader's header hold them.
fn emit_level(level: &Level, says: &str) -> EmitLevel {
    EmitLevel {
        autolod: level.autolod as f32,
        shader: level.shader.clone(),
        distance: figure(level.distance),
        error: figure(level.error.rmse),
        cost: figure(level.cost),
        time: worst_ratio(&level.timed).map(figure),
        says: says.to_owned(),
    }
}

impl Ready {
    /// Warns of levels that fail where the original holds, which only happens where that is allowed.
    #[allow(clippy::vec_box, reason = "as diagnostics are handed around")]
    fn unstable(&self, found: &Found) -> Vec<Box<Diagnostic>> {
        let levels = found.levels.iter().flat_map(|level| {
            let all = level.unstable.iter();
            all.map(|blamed| (level.autolod, blamed))
        });
        let warned = levels.map(|(autolod, blamed)| {
            let warning = blamed.diagnostic(&self.base, &self.source);
            warning.with_note(format!(
                "THE LEVEL FROM AUTOLOD {autolod} ON IS UNSTABLE, and the original is not: leave `--allow-unstable` out"
            ))
        });
        warned.collect()
    }

    /// How far the mesh's texture coordinates go from pixel to pixel at the nearest distance, where autoLOD is 0.
    fn coordinates_per_pixel(&self) -> Result<f32> {
        let scale = coordinates_per_pixel(&self.scene, self.scene.nearest);
        scale.map(|scale| figure(scale) as f32).ok_or_else(|| {
            Diagnostic::error(
                "the object has no texture coordinates, by which each pixel could choose its level",
            )
            .with_note("draw another object, or leave `--per-pixel` out")
        })
    }

    /// Says that the original uses nothing of what levels are to use less of.
    fn has_nothing_to_save(&self, found: &Found) -> Option<Box<Diagnostic>> {
        let goal = self.scene.goal;
        let [original, _] = &found.exact.used;
        goal.is_reached(original).then(|| {
            Diagnostic::warning(format!(
                "with the goal `{goal}` there is nothing to save: the original uses none of it"
            ))
            .with_note("leave `--goal` out: levels then save time")
        })
    }

    fn says(&self, level: &Level) -> String {
        match level.recipe.0.is_empty() {
            true if level.is_original => "the original".to_owned(),
            true => "the same picture, without what the scene does not need".to_owned(),
            false => emit::says(&level.recipe, &self.source.fragment),
        }
    }

    /// Every file that was read.
    pub(super) fn inputs<'a>(&'a self, request: &'a Request) -> impl Iterator<Item = PathBuf> + 'a {
        let textures = self
            .scene
            .textures
            .iter()
            .flat_map(|texture| self.files(&texture.files));
        let model = self.files(&self.scene.model_files);
        let others = self.source.others.iter();
        let lighting = self.scene.lighting.as_ref();
        [request.shader.clone()]
            .into_iter()
            .chain(others.filter_map(|file| file.path.clone()))
            .chain(self.scene_file.clone())
            .chain(lighting.map(|lighting| self.beside_scene(&lighting.file)))
            .chain(model)
            .chain(textures)
    }

    /// The hash of a file as it was when the scene read it: that is what was measured, whatever the file holds by now.
    fn hash_of(&self, name: &str) -> String {
        let read = self.scene.inputs.iter().find(|input| input.name == name);
        read.map_or_else(String::new, |input| input.hash.clone())
    }

    /// Files that the scene names from its own folder.
    fn files<'a>(&'a self, names: &'a [String]) -> impl Iterator<Item = PathBuf> + 'a {
        names.iter().map(|file| self.beside_scene(file))
    }

    /// The path of a file that the scene names.
    pub(super) fn beside_scene(&self, file: &str) -> PathBuf {
        let scene = self.scene_file.as_ref().and_then(|scene| scene.parent());
        scene.unwrap_or(Path::new("")).join(file)
    }

    fn origin(&self, request: &Request) -> Origin {
        Origin {
            command: request.command.clone(),
            seed: self.scene.seed,
            pixels_per_degree: self.scene.pixels_per_degree,
            bound: self.scene.reading.name(),
            goal: self.scene.goal,
            inputs: self.read_files(),
            triangles: self.scene.mesh.indices.len() / 3,
            warnings: self
                .scene
                .warnings
                .iter()
                .map(|w| w.message.clone())
                .collect(),
            inferences: self.inferred(),
            ..Origin::default()
        }
    }

    /// What was read, for a report.
    pub(super) fn read_files(&self) -> Vec<Input> {
        let inputs = self.scene.inputs.iter();
        inputs
            .map(|input| Input {
                file: input.name.clone(),
                hash: input.hash.clone(),
            })
            .collect()
    }

    /// What was inferred, for a report.
    pub(super) fn inferred(&self) -> Vec<String> {
        let inferences = self.scene.inferences.iter();
        inferences
            .map(|inference| format!("{} = {}", inference.what, inference.as_))
            .collect()
    }

    fn lock(
        &self,
        (request, emission): (&Request, Output),
        found: &Found,
        levels: &[EmitLevel],
        transitions: &[Option<TransitionReport>],
    ) -> Lock {
        let path = request.lock();
        let folder = path.parent().unwrap_or(Path::new(""));
        let averaged: BTreeSet<String> = found
            .levels
            .iter()
            .map(|level| &level.recipe)
            .chain([&found.exact.recipe])
            .flat_map(|recipe| averaged(&self.base, recipe))
            .chain((found.levels.iter()).flat_map(|level| collapsed(&self.base, &level.shader)))
            .collect();
        Lock {
            source: emit::LockedSource {
                file: relative(folder, &request.shader),
                normal_form: self.base.fingerprint().to_string(),
                vertex: match &self.request.stages.vertex_file {
                    // In a file of its own it may have had another name.
                    Some(_) => self.request.stages.vertex.clone(),
                    None => self.source.vertex.clone(),
                },
                vertex_file: self
                    .request
                    .stages
                    .vertex_file
                    .as_ref()
                    .map(|file| relative(folder, file)),
                fragment: self.source.fragment.clone(),
            },
            modules: emit::LockedModules {
                folders: self
                    .request
                    .modules
                    .folders
                    .iter()
                    .map(|searched| relative(folder, searched))
                    .collect(),
                definitions: self.request.modules.definitions.clone(),
            },
            scene: self.scene_file.as_ref().map(|file| emit::LockedFile {
                file: relative(folder, file),
                hash: self.hash_of(&file.display().to_string()),
            }),
            lighting: self
                .scene
                .lighting
                .as_ref()
                .map(|lighting| emit::LockedFile {
                    file: relative(folder, &self.beside_scene(&lighting.file)),
                    hash: self.hash_of(&lighting.file),
                }),
            textures: self
                .scene
                .textures
                .iter()
                .filter(|texture| averaged.contains(&texture.name))
                .flat_map(|texture| {
                    let places = self.files(&texture.files).zip(&texture.files);
                    places.map(move |(file, name)| (texture, file, name))
                })
                .map(|(texture, file, name)| emit::LockedTexture {
                    name: texture.name.clone(),
                    file: relative(folder, &file),
                    hash: self.hash_of(name),
                    texels_per_pixel: texels_per_pixel(
                        &self.scene,
                        &texture.images,
                        self.scene.nearest,
                    )
                    .map(figure),
                })
                .collect(),
            generated: Vec::new(),
            meshes: None,
            mesh: Vec::new(),
            output: emission,
            bound: self.scene.reading,
            goal: self.scene.goal,
            seed: self.scene.seed,
            rho0: figure(found.rho0),
            timed_on: found.adapters.clone(),
            exact: match levels.is_empty() {
                true => Recipe::default(),
                false => found.exact.recipe.clone(),
            },
            levels: found
                .written()
                .zip(levels)
                .map(|((at, level), emitted)| emit::LockedLevel {
                    band_cost: transitions[at]
                        .as_ref()
                        .and_then(|transition| transition.cost),
                    autolod: emitted.autolod,
                    distance: emitted.distance,
                    error: emitted.error,
                    floor: figure(level.error.floor),
                    bound: figure(level.error.bound),
                    cost: emitted.cost,
                    time: emitted.time,
                    says: emitted.says.clone(),
                    recipe: level.recipe.clone(),
                })
                .collect(),
        }
    }
}

/// The textures of the author's that went into those that were made for a variant.
fn collapsed(base: &Shader, variant: &Shader) -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    for made in variant.made() {
        for read in &made.reads {
            let variables = base.module().global_variables.iter();
            let mut bound = variables.filter(|(_, variable)| {
                let at = variable.binding.map(|at| (at.group, at.binding));
                at == Some(read.binding)
            });
            names.extend(bound.next().and_then(|(_, variable)| variable.name.clone()));
        }
    }
    names
}

/// The textures whose reads a recipe replaces by a mean.
fn averaged<'a>(base: &'a Shader, recipe: &'a Recipe) -> impl Iterator<Item = String> + 'a {
    recipe
        .0
        .iter()
        .filter(|candidate| candidate.pass == "texture-removal")
        .filter_map(|candidate| {
            let (stage, mut value) = base.find(&candidate.site)?;
            let function = base.function(stage)?;
            loop {
                value = match function.expressions[value] {
                    Expression::GlobalVariable(global) => {
                        return base.module().global_variables[global].name.clone();
                    }
                    Expression::ImageSample { image, .. } | Expression::ImageLoad { image, .. } => {
                        image
                    }
                    Expression::Access { base, .. } | Expression::AccessIndex { base, .. } => base,
                    _ => return None,
                };
            }
        })
}

/// The steps of the greedy loop from the original to its end at the scene's farthest distance, where no bound ends it: how
/// far the goal of the request can be reached, and at what error.
///
/// # Errors
/// As [`compile`].
pub fn trajectory(request: &Request) -> Result<Vec<search::Step>> {
    let ready = Ready::read(request)?;
    let vertex = ready.vertex()?;
    ready.ends(&vertex)?;
    let stand = ready.stand(&vertex);
    let kept = ready.kept(request)?;
    // Why nothing is timed was said by the search.
    let mut watch = ready.watch(request)?.unwrap_or_default();
    let clock = watch.as_mut().map(|watch| watch as &mut dyn Clock);
    search::trajectory(&stand, &kept, ready.scene.farthest, clock)
        .map_err(|refused| refusal(&refused, &ready.source))
}

/// Every candidate of a shader at the scene's middle distance, with what it is worth: for `lodc inspect`.
///
/// # Errors
/// As [`compile`].
pub fn inspect(request: &Request) -> Result<String> {
    let ready = Ready::read(request)?;
    let vertex = ready.vertex()?;
    ready.ends(&vertex)?;
    let stand = ready.stand(&vertex);
    let distances = &ready.scene.distances;
    let distance = distances[distances.len() / 2];
    let set = SampleSet::new(&stand, distance, Samples::Search)
        .map_err(|refused| refusal(&refused, &ready.source))?;
    let facts = set.facts(&ready.base);
    let candidates: Vec<Candidate> = (ready.base.passes().asking(true, true))
        .flat_map(|pass| pass.candidates(&ready.base, &facts))
        .collect();
    let tried = search::try_each(&set, &ready.base, &candidates);
    Ok(crate::report::inspection(
        &ready.base,
        &ready.source,
        distance,
        &set.original(),
        &facts,
        &tried,
    ))
}
