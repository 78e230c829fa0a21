//! The scene: the views, distances, lights, uniforms, textures and mesh that errors are measured over.
//!
//! ```text
//! TOML --file--> SceneFile --resolve, against the shader--> Scene --frames--> [Frame]
//! ```
//!
//! What the file leaves out is told from names and types; each such inference is kept, to be printed.
//! What nothing tells is an error that names the lines to add.

mod attributes;
mod both;
mod buffers;
pub mod camera;
mod file;

mod images;
pub mod init;
mod layout;
mod lighting;
mod materials;
mod model;
pub mod objects;
mod semantic;
mod settings;
mod shader;
mod textures;

pub(crate) use buffers::Freedom;
pub use buffers::{Draw, Uniform, Variation};
pub use images::{Files, ImageAnswer, ImageSource};
pub use lighting::SceneLighting;
pub(crate) use model::Model;
pub use semantic::Semantic;
pub use settings::{Output, ToneMapping};
pub use shader::Reading;
use textures::SceneSampler;
pub use textures::SceneTexture;

use crate::eval::draw::{Blend, DrawState, Lit, state_of};
use crate::eval::generated::Store;
use crate::eval::machine::Bindings;
use crate::eval::parameters::ParameterStage;
use crate::eval::raster::{Attribute, Coverage, Frame};
use crate::eval::refusal;
use crate::eval::texture::{Sampler, Wrap};
use crate::front::{Source, VertexStage, hash, inputs, read_text};
use crate::{Diagnostic, Result};
use buffers::{Buffer, Said};
use camera::{Around, Pose, Shot, Sphere};
use chance::{child, unit};
use file::Toml;
use glam::{DMat4, DVec3};
pub(crate) use lodc_machine::chance;
pub use lodc_mesh as mesh;
use lodc_passes::Goal;
use lodc_passes::autolod::{self, BoundReading};
use mesh::Mesh;
use naga::{Binding, Span};
use objects::Object;
use settings::Settings;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Everything that pictures of a shader are made of, resolved against that shader.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The scene file's name as the user gave it; `None` without one.
    pub name: Option<String>,
    /// What is drawn.
    pub object: Object,
    /// Its triangles, in object space.
    pub mesh: Arc<Mesh>,
    /// The files that a model was read from, but for its images, as the scene names them.
    pub model_files: Vec<String>,
    /// Object to world.
    pub model: DMat4,
    /// The object's bounding sphere in world space.
    pub sphere: Sphere,
    /// Width and height of a picture in pixels.
    pub resolution: [u32; 2],
    /// The vertical field of view in degrees.
    pub fov: f64,
    /// What everything random comes from.
    pub seed: u64,
    /// The error that is allowed at the farthest distance, in display-referred values 0..1.
    pub e_max: f64,
    /// The exponent of the bound.
    pub q: f64,
    /// The distances that levels are made for, nearest first, from the eye to the sphere's centre.
    pub distances: Vec<f64>,
    /// The nearest distance, where autoLOD is 0.
    pub nearest: f64,
    /// The farthest distance, where the error may be `e_max`.
    pub farthest: f64,
    /// How errors are held against the bound.
    pub reading: BoundReading,
    /// What levels are to use less of.
    pub goal: Goal,
    /// What the host does for levels.
    pub host: Host,
    /// How many offsets within a pixel errors are measured at.
    pub offsets: usize,
    /// How many pixels a degree has for whoever looks at a picture, for FLIP.
    pub pixels_per_degree: f64,
    /// What the shader returns.
    pub output: Output,
    /// How each of the mesh's draws gets into the picture (see [`Scene::state`]); none when all are opaque.
    pub states: Arc<[DrawState]>,
    /// Unit vectors from the sphere's centre to the eye.
    pub views: Vec<DVec3>,
    /// Where views come from that decide nothing.
    around: Around,
    /// Every scalar, vector and matrix in the shader's buffers that has a value, in the order of declaration.
    pub uniforms: Vec<Uniform>,
    /// The shader's textures.
    pub textures: Vec<SceneTexture>,
    /// The vertex stage that lodc supplies, when the file has none.
    pub vertex_stage: Option<VertexStage>,
    /// What lights the material's outputs, in a deferred scene.
    pub lighting: Option<SceneLighting>,
    /// What was told from names and types.
    pub inferences: Vec<Inference>,
    /// What should be known besides.
    pub warnings: Vec<Diagnostic>,
    /// The files that were read, the shader first.
    pub inputs: Vec<InputFile>,
    attributes: BTreeMap<u32, Attribute>,
    buffers: Vec<Buffer>,
    samplers: Vec<SceneSampler>,
    /// The bindings that are the same in every picture.
    constant: Bindings,
    /// The textures that were made of its own.
    pub(crate) baked: Store,
    /// What fills the uniforms that the shader fills itself, in this order.
    filled: Vec<Arc<ParameterStage>>,
    samples: usize,
}

/// What a host does for levels beyond drawing them: a level asks for it only where it is allowed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Host {
    /// It fills the parameter block once a draw, and binds it.
    pub parameters: bool,
    /// It binds the textures that are made for levels.
    pub textures: bool,
    /// How many bytes those of a level may have together, with their MIP levels.
    pub most_texture_bytes: Option<u64>,
}

/// A file that a result depends on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InputFile {
    /// As the user, or the scene file, names it.
    pub name: String,
    /// `blake3:` and 64 hexadecimal digits, over its bytes.
    pub hash: String,
}

/// Pictures that decide nothing while levels are searched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Split {
    /// They may withdraw a level.
    Validation = 1,
    /// They are reported, and nothing else.
    Test = 2,
}

/// What the seeds of pictures for a mesh are made with, beside those of [`Split`].
#[cfg(feature = "mesh")]
const ALL_AROUND: u64 = 3;

/// The most pictures at one distance: what a search can look at, in memory that does not grow with the scene.
pub const MOST_FRAMES: usize = 256;

/// Something that was left out of the scene, and told from a name and a type.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Inference {
    /// What it is about: `camera.view_proj`.
    pub what: String,
    /// What it was taken for: `view-projection`.
    pub as_: String,
    /// The table of the scene file that could say so: `uniforms`.
    pub table: &'static str,
    /// The line in that table: `"camera.view_proj" = "view-projection"`.
    pub line_to_add: String,
    /// Why, for a person.
    pub reason: String,
}

impl Inference {
    /// `value` is as the scene file would write it.
    fn new(table: &'static str, what: &str, value: &str) -> Self {
        let bare = what
            .bytes()
            .all(|b| b.is_ascii_alphanumeric() || b == b'_' || b == b'-');
        let quote = if bare && !what.is_empty() { "" } else { "\"" };
        let plain = value.strip_prefix('"').and_then(|v| v.strip_suffix('"'));
        Self {
            what: what.to_owned(),
            as_: plain.unwrap_or(value).to_owned(),
            table,
            line_to_add: format!("{quote}{what}{quote} = {value}"),
            reason: String::new(),
        }
    }

    fn because(mut self, reason: impl Into<String>) -> Self {
        self.reason = reason.into();
        self
    }
}

/// Something that was left out of the scene and that nothing tells.
#[derive(Clone, Debug)]
struct Missing {
    table: &'static str,
    line: String,
    what: String,
    type_name: String,
    span: Span,
}

/// What a scene is resolved with beside its file.
#[derive(Clone, Copy, Default)]
struct Instead<'a> {
    /// A shader of which the file may speak too: what it says of that alone is passed over.
    other: Option<&'a Source>,
    /// The object.
    object: Option<&'a str>,
}

impl Scene {
    /// Bytes of the textures at these groups and bindings, with their MIP levels, at 4 bytes a texel.
    pub fn texture_bytes(&self, bindings: &BTreeSet<(u32, u32)>) -> u64 {
        let bound = |texture: &&SceneTexture| bindings.contains(&(texture.group, texture.binding));
        self.textures
            .iter()
            .filter(bound)
            .map(SceneTexture::bytes)
            .sum()
    }

    /// Reads the scene of a shader: the file at `path`, or else the one beside the shader with its name
    /// and the extension `toml`, or else nothing but inferences.
    ///
    /// # Errors
    /// When the file cannot be read, and as [`Scene::resolve`].
    pub fn read(source: &Source, path: Option<&Path>) -> Result<Self> {
        Self::read_with(source, path, &Files)
    }

    /// As [`Scene::read`], with images from somewhere.
    ///
    /// # Errors
    /// As [`Scene::read`], and when that says so.
    pub fn read_with(
        source: &Source,
        path: Option<&Path>,
        images: &dyn ImageSource,
    ) -> Result<Self> {
        match Self::path(source, path) {
            Some(path) => {
                let text = read_text(&path, "scene")?;
                Self::resolve_with(source, Some((&path, &text)), images)
            }
            None => Self::resolve_with(source, None, images),
        }
    }

    /// As [`Scene::read`], with another object in place of the one that the file names: as the file would name it, in its
    /// folder. What it says of distances stays.
    ///
    /// # Errors
    /// As [`Scene::read`], and when the object cannot be read.
    pub fn read_on(source: &Source, path: Option<&Path>, object: &str) -> Result<Self> {
        let path = Self::path(source, path);
        let text = path.as_ref().map(|path| read_text(path, "scene"));
        let text = text.transpose()?;
        let instead = Instead {
            object: Some(object),
            ..Instead::default()
        };
        let file = path.as_deref().zip(text.as_deref());
        Self::resolve_instead(source, file, instead, &Files)
    }

    /// The scene file that is meant: the one at `path`, or else the one beside the shader, if there is one.
    fn path(source: &Source, path: Option<&Path>) -> Option<PathBuf> {
        let beside = || Some(source.path.as_ref()?.with_extension("toml")).filter(|p| p.exists());
        path.map(PathBuf::from).or_else(beside)
    }

    /// Fills a scene in against a shader. `file` is the scene file's path, which paths in it are relative to,
    /// and its text.
    ///
    /// # Errors
    /// When the text is no scene, does not fit the shader, or names images that cannot be read; and when
    /// something is neither given nor to be inferred, naming all such things and the lines to add.
    pub fn resolve(source: &Source, file: Option<(&Path, &str)>) -> Result<Self> {
        Self::resolve_with(source, file, &Files)
    }

    /// As [`Scene::resolve`], with images from somewhere.
    ///
    /// # Errors
    /// As [`Scene::resolve`], and when that says so.
    pub fn resolve_with(
        source: &Source,
        file: Option<(&Path, &str)>,
        images: &dyn ImageSource,
    ) -> Result<Self> {
        Self::resolve_instead(source, file, Instead::default(), images)
    }

    /// As [`Scene::resolve`], with something instead of what the file says.
    fn resolve_instead(
        source: &Source,
        file: Option<(&Path, &str)>,
        instead: Instead<'_>,
        images: &dyn ImageSource,
    ) -> Result<Self> {
        Self::attempt(source, file, instead, images)?.map_err(|missing| {
            let name = Self::file_name(source, file);
            let place = match file {
                Some(_) => format!("`{name}`"),
                None => format!("a scene file, `{name}`"),
            };
            buffers::missing_error(source, &place, &missing)
        })
    }

    /// What the scene file is called in messages, or would be.
    fn file_name(source: &Source, file: Option<(&Path, &str)>) -> String {
        match file {
            Some((path, _)) => path.display().to_string(),
            None => {
                let beside = Path::new(&source.name).with_extension("toml");
                beside.display().to_string()
            }
        }
    }

    /// The same, with what is neither given nor to be inferred as a list.
    fn attempt(
        source: &Source,
        file: Option<(&Path, &str)>,
        instead: Instead<'_>,
        images: &dyn ImageSource,
    ) -> Result<std::result::Result<Self, Vec<Missing>>> {
        let name = Self::file_name(source, file);
        let text = file.map_or("", |(_, text)| text);
        let toml = Toml { name: &name, text };
        let mut file_values = toml.parse()?;
        if let Some(other) = instead.other {
            both::pass_over(&mut file_values, source, other);
        }
        if let Some(object) = instead.object {
            file_values.object = Some(toml::Spanned::new(0..0, object.to_owned()));
        }
        let folder = match file {
            Some((path, _)) => path.parent(),
            None => source.path.as_deref().and_then(Path::parent),
        };
        let folder = folder.unwrap_or(Path::new(""));
        let mut settings = Settings::read(toml, &file_values, default_object(source), folder)?;
        let mut said = Said::default();
        let materials = settings.file.as_ref().map(|model| &model.materials[..]);
        let mut buffers = buffers::resolve(
            source,
            toml,
            &file_values.uniforms,
            &file_values.storage,
            materials.unwrap_or_default(),
            &mut said,
        )?;
        let place = textures::Place {
            folder,
            source: images,
            seed: settings.seed,
            model: settings.file.as_ref(),
            factors: &said.factors,
        };
        let images = textures::resolve(
            source,
            toml,
            &file_values.textures,
            &file_values.samplers,
            place,
        )?;
        let mut found = lighting::Found::default();
        let lighting = lighting::resolve(
            source,
            toml,
            file_values.lighting.as_ref(),
            &file_values.targets,
            // The object's materials are not the lighting's.
            textures::Place {
                model: None,
                ..place
            },
            &mut found,
        )?;
        if lighting.is_some() {
            found
                .warnings
                .extend(opaque(toml, &file_values, &mut settings)?);
        }
        let mut inferences = said.inferences;
        let fed = attributes::resolve(
            source,
            toml,
            &file_values.attributes,
            &settings,
            &mut inferences,
        )?;
        if !said.missing.is_empty() {
            return Ok(Err(said.missing));
        }
        inferences.extend(images.inferences);
        inferences.extend(found.inferences);
        let uniforms = buffers.iter().flat_map(Buffer::uniforms).collect();
        if let Some(stage) = &fed.stage {
            buffers.extend(Buffer::of_semantics(&stage.module));
        }
        let mut inputs = vec![InputFile {
            name: source.name.clone(),
            hash: hash(source.text.as_bytes()),
        }];
        if file.is_some() {
            inputs.push(InputFile {
                name: name.clone(),
                hash: hash(text.as_bytes()),
            });
        }
        inputs.extend(source.others.iter().map(|file| InputFile {
            name: file.name.clone(),
            hash: hash(file.text.as_bytes()),
        }));
        let of_model = settings.file.as_ref().map(|model| model.inputs.clone());
        let of_model = of_model.unwrap_or_default();
        let model_files = of_model.iter().map(|(name, _)| name.clone()).collect();
        let files = of_model.into_iter().chain(images.inputs);
        for (name, hash) in files {
            if !inputs.iter().any(|input| input.name == name) {
                inputs.push(InputFile { name, hash });
            }
        }
        inputs.extend(found.inputs);
        let lit = lighting.as_ref().map_or(1, SceneLighting::samples);
        let samples = buffers.iter().map(Buffer::samples).max().unwrap_or(1);
        if let Some(model) = &settings.file
            && !model.bare.is_empty()
            && fed.attributes.values().any(|attribute| {
                matches!(
                    attribute,
                    Attribute::Tangent | Attribute::Bitangent | Attribute::BitangentSign
                )
            })
        {
            settings.mesh = model::tangents::generate(&settings.mesh, &model.bare);
        }
        let mut scene = Self {
            name: file.map(|_| name.clone()),
            object: settings.object,
            mesh: Arc::new(settings.mesh),
            model_files,
            model: settings.model,
            sphere: settings.sphere,
            resolution: settings.resolution,
            fov: settings.fov,
            seed: settings.seed,
            e_max: settings.e_max,
            q: settings.q,
            distances: settings.distances,
            nearest: settings.nearest,
            farthest: settings.farthest,
            reading: settings.reading,
            goal: settings.goal,
            host: settings.host,
            offsets: settings.offsets,
            pixels_per_degree: settings.pixels_per_degree,
            output: settings.output,
            states: settings.states,
            views: settings.views,
            around: settings.around,
            uniforms,
            textures: images.textures,
            samplers: images.samplers,
            vertex_stage: fed.stage,
            inferences,
            warnings: [settings.warnings, images.warnings, found.warnings].concat(),
            inputs,
            attributes: fed.attributes,
            samples: samples.max(lit),
            lighting,
            constant: Bindings::new(),
            baked: Store::default(),
            buffers,
            filled: filled(source)?,
        };
        if scene.uniform_samples() < scene.samples {
            scene.warnings.push(*Diagnostic::warning(format!(
                "the uniforms have {} samples, of which {} are drawn, evenly spaced",
                scene.samples,
                scene.uniform_samples()
            ))
            .with_note(format!(
                "errors are measured over at most {MOST_FRAMES} pictures at each distance, and there are {} views",
                scene.views.len()
            )));
        }
        let pose = scene.pose(DVec3::Z, scene.nearest);
        for texture in &scene.textures {
            scene
                .constant
                .insert((texture.group, texture.binding), texture.resource());
        }
        for sampler in &scene.samplers {
            scene
                .constant
                .insert((sampler.group, sampler.binding), sampler.resource());
        }
        for buffer in scene.buffers.iter().filter(|b| b.is_constant()) {
            let resource = buffer.resource(&pose, &scene.sphere, Draw::Listed(0));
            scene.constant.insert(buffer.slot(), resource);
        }
        Ok(Ok(scene))
    }

    /// The pictures at a distance from the eye to the sphere's centre, in a fixed order: for each view, for each
    /// sample of the uniforms. They are drawn at pixel centres, one sample a pixel; the caller may change
    /// `offset` and `grid`.
    pub fn frames(&self, distance: f64) -> Vec<Frame> {
        let drawn = self.uniform_samples();
        self.views
            .iter()
            .flat_map(|view| {
                (0..drawn).map(move |i| {
                    let sample = i * self.samples / drawn;
                    self.frame(*view, distance, Draw::Listed(sample))
                })
            })
            .collect()
    }

    /// Pictures at a distance that the search does not see, `count` of them, independent of each other: each has a
    /// view of its own and uniforms of its own, from the same ranges as the scene's, by chance; each is drawn at an
    /// offset of its own. The same always for a seed and a split.
    ///
    /// Where the scene spreads its views over a part of the sphere, a view is any direction of that part; where it
    /// lists directions, one of them, turned by up to [`camera::TURN`] radians. A uniform with a range takes
    /// any value of it; one with a list takes one of the list, the same place in all lists; a light's direction is
    /// one of the scene's, turned likewise; the time is any of its range.
    pub fn held_out(&self, distance: f64, split: Split, count: usize) -> Vec<Frame> {
        let seed = child(self.seed, split as u64);
        (0..count as u64)
            .map(|i| {
                let seed = child(seed, i);
                let view = self.around.view(&self.views, child(seed, 0));
                let mut frame = self.frame(view, distance, Draw::Chance(child(seed, 1)));
                frame.offset = [2, 3].map(|i| (unit(child(seed, i)) - 0.5) as f32);
                frame
            })
            .collect()
    }

    /// The pictures that a mesh is simplified by, at a distance: of the scene's own views where it lists them, else of `count`
    /// at least, spread in the same way; of each one sample of the uniforms, in turn, and an offset of its own.
    #[cfg(feature = "mesh")]
    pub(crate) fn all_around(&self, distance: f64, count: usize) -> Vec<Frame> {
        let views = match self.around {
            Around::Cap(axis, angle) if self.views.len() < count && self.views.len() > 1 => {
                camera::spread(count, axis, angle)
            }
            Around::Cap(..) | Around::Listed => self.views.clone(),
        };
        let drawn = self.uniform_samples();
        let pictures = views.into_iter().enumerate().map(|(i, view)| {
            let sample = i % drawn * self.samples / drawn;
            let seed = child(child(self.seed, ALL_AROUND), i as u64);
            let offset = [0, 1].map(|axis| (unit(child(seed, axis)) - 0.5) as f32);
            Frame {
                offset,
                ..self.frame(view, distance, Draw::Listed(sample))
            }
        });
        pictures.take(MOST_FRAMES).collect()
    }

    /// The picture of the same view, of the same values of the uniforms, in this scene.
    pub(crate) fn again(&self, frame: &Frame) -> Frame {
        let Shot {
            direction,
            distance,
            draw,
        } = frame.shot;
        Frame {
            offset: frame.offset,
            grid: frame.grid,
            ..self.frame(direction, distance, draw)
        }
    }

    /// The picture from a direction, a unit vector from the sphere's centre to the eye, at a distance from there, with these values of
    /// the sampled uniforms. It is drawn at pixel centres, one sample a pixel.
    pub fn frame(&self, direction: DVec3, distance: f64, draw: Draw) -> Frame {
        let pose = self.pose(direction, distance);
        let mut bindings = self.constant.clone();
        for buffer in self.buffers.iter().filter(|b| !b.is_constant()) {
            let resource = buffer.resource(&pose, &self.sphere, draw);
            bindings.insert(buffer.slot(), resource);
        }
        for stage in &self.filled {
            stage.bind(&mut bindings, self.mesh.draws().len());
        }
        Frame {
            mesh: self.mesh.clone(),
            attributes: self.attributes.clone(),
            bindings,
            width: self.resolution[0],
            height: self.resolution[1],
            offset: [0.0, 0.0],
            grid: 1,
            states: self.states.clone(),
            shot: Shot {
                direction,
                distance,
                draw,
            },
            baked: self.baked.clone(),
        }
    }

    /// What may be put into the buffers' parts of floats, where they are not always the same.
    pub(crate) fn freedoms(&self) -> Vec<Freedom> {
        self.buffers.iter().flat_map(Buffer::freedoms).collect()
    }

    /// Fills what is computed from other buffers anew, after those have changed.
    pub(crate) fn refill(&self, bindings: &mut Bindings, draws: usize) {
        for stage in &self.filled {
            stage.bind(bindings, draws);
        }
    }

    /// The eye of a frame in world space.
    pub(crate) fn eye(&self, frame: &Frame) -> DVec3 {
        self.pose(frame.shot.direction, frame.shot.distance).eye
    }

    /// The samplers that repeat along both axes in every draw, by their names.
    pub(crate) fn repeating(&self) -> BTreeSet<String> {
        let repeats = |sampler: &Arc<Sampler>| sampler.wrap[..2] == [Wrap::Repeat; 2];
        let all = self.samplers.iter();
        all.filter(|sampler| sampler.samplers.iter().all(repeats))
            .map(|sampler| sampler.name.clone())
            .collect()
    }

    /// The resources that are the same in every picture.
    pub(crate) fn constant(&self) -> &Bindings {
        &self.constant
    }

    /// What lights a frame of this scene in a deferred scene: made for the coverage that its fragments are of.
    pub fn lit(&self, frame: &Frame, coverage: &Coverage) -> Option<Lit> {
        let lighting = self.lighting.as_ref()?;
        Some(Lit::new(
            &lighting.lighting,
            self.lighting_frame(frame)?,
            coverage,
        ))
    }

    /// The frame of the pass that lights a frame of this scene, in a deferred scene: its pixels are the frame's
    /// fine pixels.
    pub fn lighting_frame(&self, frame: &Frame) -> Option<Frame> {
        let lighting = self.lighting.as_ref()?;
        let pose = self.pose(frame.shot.direction, frame.shot.distance);
        Some(lighting.frame(frame, &pose, &self.sphere))
    }

    fn pose(&self, direction: DVec3, distance: f64) -> Pose {
        Pose::new(
            self.model,
            self.sphere,
            direction,
            distance,
            self.fov,
            self.resolution,
        )
    }

    /// How many samples of the uniforms are drawn for each view: each sampled uniform takes its i-th value in the i-th,
    /// and comes round. Of more than [`MOST_FRAMES`] pictures in all, evenly spaced ones.
    pub fn uniform_samples(&self) -> usize {
        self.samples
            .min((MOST_FRAMES / self.views.len().max(1)).max(1))
    }

    /// Whether any draw of the mesh is blended.
    pub fn blends(&self) -> bool {
        self.states.iter().any(|state| state.blend != Blend::Opaque)
    }

    /// How a draw of the mesh gets into the picture.
    pub fn state(&self, draw: usize) -> DrawState {
        state_of(&self.states, draw)
    }

    /// What autoLOD is computed from at a distance.
    pub fn view(&self, distance: f64) -> autolod::View {
        autolod::View {
            s_max: autolod::s_max(&self.model.as_mat4().to_cols_array_2d()),
            distance,
            radius: self.sphere.radius,
            // Not the camera's near plane, which moves with the object: the nearest that it can be.
            z_near: camera::z_near(0.0, self.sphere.radius),
            height: f64::from(self.resolution[1]),
            fov: self.fov,
        }
    }

    /// Pixels per object unit at the nearest distance: where autoLOD is 0.
    pub fn rho0(&self) -> f64 {
        autolod::rho(&self.view(self.nearest))
    }

    /// autoLOD at a distance.
    pub fn auto_lod(&self, distance: f64) -> f64 {
        autolod::auto_lod(self.rho0(), autolod::rho(&self.view(distance)))
    }

    /// The error that is allowed at a distance (see [`autolod::bound`]).
    pub fn bound(&self, distance: f64) -> f64 {
        autolod::bound(distance, self.nearest, self.farthest, self.e_max, self.q)
    }
}

/// What a deferred scene draws is opaque: its targets hold one surface. Says so when a model's materials are not.
fn opaque(
    toml: Toml,
    file: &file::SceneFile,
    settings: &mut Settings,
) -> Result<Option<Diagnostic>> {
    let blended = settings.states.iter();
    let blended = blended.filter(|state| state.blend != Blend::Opaque).count();
    if blended == 0 {
        return Ok(None);
    }
    let why = "the targets of a deferred scene hold one surface a pixel: blended ones are drawn forward, in a scene without `[lighting]`";
    if let Some(said) = &file.blend {
        let message = "a deferred scene is opaque";
        return Err(toml.error(message, said.span(), "").with_note(why));
    }
    settings.states = Arc::default();
    let message = match blended {
        1 => "a blended material of the model is drawn opaque".to_owned(),
        n => format!("{n} blended materials of the model are drawn opaque"),
    };
    Ok(Some(*Diagnostic::warning(message).with_note(why)))
}

/// What fills the uniforms that a shader fills itself.
pub(crate) fn filled(source: &Source) -> Result<Vec<Arc<ParameterStage>>> {
    let mut stages = Vec::new();
    for filled in source.filled() {
        let stage = ParameterStage::of_text(&source.module, &filled);
        stages.extend(
            stage
                .map_err(|refused| refusal(&refused, source))?
                .map(Arc::new),
        );
    }
    Ok(stages)
}

/// What is drawn when the scene names no object: a sphere, or, for a vertex stage that takes nothing from a
/// mesh, what it makes of the indices of six vertices.
fn default_object(source: &Source) -> Object {
    let reads = |entry: usize| {
        let inputs = inputs(source, entry);
        let mut bindings = inputs.into_iter().map(|input| input.binding);
        bindings.any(|binding| matches!(binding, Binding::Location { .. }))
    };
    match source.vertex_entry() {
        Some((entry, _)) if !reads(entry) => Object::Screen,
        _ => Object::Sphere,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eval::machine::Resource;
    use glam::Vec3;

    const TEXT: &str = "
        struct Camera { view_proj: mat4x4f, eye: vec3f, time: f32 }
        @group(0) @binding(0) var<uniform> camera: Camera;
        @group(0) @binding(1) var<uniform> tint: vec4f;
        @group(0) @binding(2) var picture: texture_2d<f32>;
        @group(0) @binding(3) var picture_sampler: sampler;
        struct V { @builtin(position) p: vec4f, @location(0) uv: vec2f }
        @vertex fn vs(@location(0) position: vec3f, @location(1) uv: vec2f) -> V {
            return V(camera.view_proj * vec4f(position, 1.0), uv);
        }
        @fragment fn fs(v: V) -> @location(0) vec4f {
            return tint * textureSample(picture, picture_sampler, v.uv) + vec4f(camera.eye, camera.time);
        }";

    const TOML: &str = "
        [uniforms]
        tint = [1, 1, 1, 1]
        [textures]
        picture = \"dynamic\"
        [views]
        count = 4
        ";

    fn scene(shader: &str, toml: &str) -> Result<Scene> {
        let source = Source::parse("a.wgsl", shader)?;
        Scene::resolve(&source, Some((Path::new("a.toml"), toml)))
    }

    fn bytes(frame: &Frame, slot: (u32, u32)) -> &Arc<Vec<u8>> {
        match &frame.bindings[&slot] {
            Resource::Buffer(bytes) => bytes,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn there_is_a_frame_for_each_view_and_sample() {
        let scene = scene(TEXT, TOML).unwrap();
        // Time is sampled three times.
        assert_eq!(scene.uniform_samples(), 3);
        let full = scene.frames(5.0);
        assert_eq!(full.len(), 12);
        for frame in &full {
            assert_eq!(frame.bindings.len(), 4);
            assert_eq!((frame.width, frame.height, frame.grid), (256, 256, 1));
            assert_eq!(
                frame.attributes,
                BTreeMap::from([(0, Attribute::Position), (1, Attribute::Uv)])
            );
            // What does not change is shared.
            assert!(Arc::ptr_eq(bytes(frame, (0, 1)), bytes(&full[0], (0, 1))));
            assert!(Arc::ptr_eq(&frame.mesh, &full[0].mesh));
        }
        // Samples of a view differ in the time, views in the camera.
        let (a, b, c) = (
            bytes(&full[0], (0, 0)),
            bytes(&full[1], (0, 0)),
            bytes(&full[3], (0, 0)),
        );
        assert_eq!(a[..76], b[..76]);
        assert_ne!(a[76..], b[76..]);
        assert_ne!(a[..64], c[..64]);
    }

    #[test]
    fn pictures_that_decide_nothing_are_others_from_the_same_ranges() {
        let toml = TOML.replace(
            "tint = [1, 1, 1, 1]",
            "tint = { from = [0, 0, 0, 1], to = [1, 1, 1, 1], count = 2 }",
        );
        let scene = scene(TEXT, &toml).unwrap();
        let number = |frame: &Frame, slot, at: usize| {
            let bytes = bytes(frame, slot);
            f32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
        };
        let test = scene.held_out(5.0, Split::Test, 8);
        let again = scene.held_out(5.0, Split::Test, 8);
        let other = scene.held_out(5.0, Split::Validation, 8);
        for (i, frame) in test.iter().enumerate() {
            let (tint, time) = (number(frame, (0, 1), 0), number(frame, (0, 0), 76));
            assert!((0.0..=1.0).contains(&tint) && (0.0..=12.3).contains(&time));
            assert!(frame.offset.iter().all(|o| (-0.5..=0.5).contains(o)));
            // The eye is at the distance that was asked for.
            let eye = [64, 68, 72].map(|at| number(frame, (0, 0), at));
            assert!((Vec3::from(eye).length() - 5.0).abs() < 1e-4, "{eye:?}");
            assert_eq!(bytes(frame, (0, 0)), bytes(&again[i], (0, 0)));
            assert_eq!(frame.offset, again[i].offset);
            for unlike in test[..i].iter().chain(&other).chain(&scene.frames(5.0)) {
                assert_ne!(bytes(frame, (0, 0)), bytes(unlike, (0, 0)));
                assert_ne!(tint, number(unlike, (0, 1), 0));
            }
        }
    }

    #[test]
    fn listed_values_stay_together_and_listed_views_are_turned_a_little() {
        let toml = "[uniforms]
            tint = { samples = [[1, 0, 0, 1], [0, 1, 0, 1]] }
            \"camera.time\" = { samples = [10, 20] }
            [textures]
            picture = \"dynamic\"
            [views]
            directions = [[0, 0, 1], [0, 1, 0]]";
        let scene = scene(TEXT, toml).unwrap();
        let number = |bytes: &[u8], at: usize| {
            f32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
        };
        let mut seen = [0; 2];
        for frame in scene.held_out(5.0, Split::Test, 16) {
            let (camera, tint) = (bytes(&frame, (0, 0)), bytes(&frame, (0, 1)));
            let second = number(tint, 0) == 0.0;
            assert_eq!(number(camera, 76), if second { 20.0 } else { 10.0 });
            seen[usize::from(second)] += 1;
            let eye = [64, 68, 72].map(|at| f64::from(number(camera, at)));
            let near = scene
                .views
                .iter()
                .map(|view| view.dot(DVec3::from(eye) / 5.0));
            let angle = near.fold(-1.0, f64::max).min(1.0).acos();
            assert!(angle <= camera::TURN + 1e-3 && angle > 0.0, "{angle}");
        }
        assert!(seen.iter().all(|n| *n > 2), "{seen:?}");
    }

    #[test]
    fn a_million_uniform_samples_are_a_few_pictures_and_a_warning() {
        let list = "[0,0,0,1],".repeat(999_999);
        let toml = TOML.replace(
            "tint = [1, 1, 1, 1]",
            &format!("tint = {{ samples = [{list}[1,1,1,1]] }}"),
        );
        let scene = scene(TEXT, &toml).unwrap();
        assert_eq!(scene.uniform_samples(), MOST_FRAMES / 4);
        assert_eq!(scene.frames(5.0).len(), MOST_FRAMES);
        assert_eq!(
            scene.warnings.last().map(|w| w.message.as_str()),
            Some("the uniforms have 1000000 samples, of which 64 are drawn, evenly spaced")
        );
    }

    #[test]
    fn auto_lod_is_zero_at_the_nearest_distance_and_rises() {
        let scene = scene(TEXT, TOML).unwrap();
        assert_eq!(scene.auto_lod(scene.nearest), 0.0);
        assert!((scene.auto_lod(3.0) - 1.0).abs() < 1e-6);
        let lods: Vec<f64> = scene.distances.iter().map(|d| scene.auto_lod(*d)).collect();
        assert!(lods.windows(2).all(|w| w[0] < w[1]), "{lods:?}");
        assert_eq!(scene.bound(scene.nearest), 0.0);
        assert_eq!(scene.bound(scene.farthest), 0.05);
    }

    #[test]
    fn what_is_inferred_is_told_and_writing_it_down_changes_nothing() {
        let told = scene(TEXT, TOML).unwrap();
        let lines: Vec<&str> = told
            .inferences
            .iter()
            .map(|i| i.line_to_add.as_str())
            .collect();
        assert_eq!(
            lines,
            [
                "\"camera.view_proj\" = \"view-projection\"",
                "\"camera.eye\" = \"camera-position\"",
                "\"camera.time\" = \"time\"",
                "position = \"position\"",
                "uv = \"uv\"",
            ]
        );
        let of = |table: &str| {
            let lines = told.inferences.iter().filter(|i| i.table == table);
            lines
                .map(|i| i.line_to_add.clone())
                .collect::<Vec<_>>()
                .join("\n")
        };
        let toml = TOML.replace(
            "[uniforms]",
            &format!(
                "[attributes]\n{}\n[uniforms]\n{}",
                of("attributes"),
                of("uniforms")
            ),
        );
        let said = scene(TEXT, &toml).unwrap();
        assert!(said.inferences.is_empty());
        let (a, b) = (told.frames(7.0), said.frames(7.0));
        for (a, b) in a.iter().zip(&b) {
            assert_eq!(bytes(a, (0, 0)), bytes(b, (0, 0)));
            assert_eq!(a.attributes, b.attributes);
        }
    }

    #[test]
    fn a_supplied_stage_is_bound_apart_from_the_file() {
        let shader = "@group(1) @binding(4) var<uniform> tint: vec4f;
            @fragment fn fs(@location(0) uv: vec2f) -> @location(0) vec4f { return tint * vec4f(uv, uv); }";
        let scene = scene(shader, "[uniforms]\ntint = [1, 1, 1, 1]").unwrap();
        let frames = scene.frames(5.0);
        assert_eq!(frames.len(), 6);
        assert_eq!(
            frames[0].bindings.keys().collect::<Vec<_>>(),
            [&(1, 4), &(1, 5)]
        );
        assert_eq!(bytes(&frames[0], (1, 5)).len(), 3 * 64 + 16);
        assert_ne!(bytes(&frames[0], (1, 5)), bytes(&frames[1], (1, 5)));
        // The stage is no part of the shader.
        assert!(scene.uniforms.iter().all(|u| u.path == "tint"));
    }

    #[test]
    fn what_nothing_tells_is_one_error_with_every_line() {
        let source = Source::parse("a.wgsl", TEXT).unwrap();
        let error = Scene::resolve(&source, None).unwrap_err();
        assert_eq!(error.message, "what `tint` holds is not known");
        let text = error.to_string();
        assert!(text.contains("a.wgsl:4:"), "{text}");
        assert!(
            text.contains("put a value into a scene file, `a.toml`:"),
            "{text}"
        );
        assert!(
            text.contains("[uniforms]\n    \"tint\" = [0.0, 0.0, 0.0, 0.0]"),
            "{text}"
        );
    }

    #[test]
    fn a_vertex_stage_without_attributes_gets_bare_vertices() {
        let shader = "@vertex fn vs(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
                return vec4f(vec2f(f32(i / 2), f32(i % 2)) * 4.0 - 1.0, 0.0, 1.0);
            }
            @fragment fn fs() -> @location(0) vec4f { return vec4f(); }";
        let bare = scene(shader, "").unwrap();
        assert_eq!((bare.object, bare.mesh.indices.len()), (Object::Screen, 6));
        assert_eq!(bare.frames(5.0).len(), 1);
        let named = scene(shader, "object = \"cube\"").unwrap();
        assert_eq!(named.object, Object::Cube);
    }

    #[test]
    fn every_input_is_hashed() {
        let scene = scene(TEXT, TOML).unwrap();
        let names: Vec<&str> = scene.inputs.iter().map(|i| i.name.as_str()).collect();
        assert_eq!(names, ["a.wgsl", "a.toml"]);
        assert_eq!(
            scene.inputs[1].hash,
            format!("blake3:{}", blake3::hash(TOML.as_bytes()).to_hex())
        );
    }

    #[test]
    fn damaged_files_are_errors_or_scenes_and_never_a_crash() {
        const PIECES: [&str; 24] = [
            "",
            "[",
            "]",
            "{",
            "}",
            "\"",
            "=",
            "0",
            "1e39",
            "nan",
            "-1",
            ".",
            "f32",
            "mat3x3f",
            "f16",
            "true",
            "99999999999",
            "\n",
            "samples",
            "from",
            "dynamic",
            "view",
            "[3]",
            "ü",
        ];
        let mut state = 1u64;
        let mut random = move |below: usize| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 33) as usize % below
        };
        let mut damage = |text: &str| {
            let mut text = text.to_owned();
            let mut at = random(text.len());
            let mut end = (at + random(8)).min(text.len());
            while !text.is_char_boundary(at) {
                at -= 1;
            }
            while !text.is_char_boundary(end) {
                end += 1;
            }
            text.replace_range(at..end, PIECES[random(PIECES.len())]);
            text
        };
        let mut scenes = 0;
        for round in 0..600 {
            let shader = if round % 3 == 0 {
                damage(TEXT)
            } else {
                TEXT.to_owned()
            };
            match scene(&shader, &damage(TOML)) {
                Ok(scene) => {
                    scene.frames(5.0);
                    scenes += 1;
                }
                Err(error) => assert!(!error.render(true).is_empty()),
            }
        }
        assert!(scenes > 10, "{scenes}");
    }

    #[test]
    fn the_shaders_of_the_repository_resolve_without_a_warning() {
        let shaders = crate::fixtures::complete();
        for path in &shaders {
            let source = Source::read(path).unwrap_or_else(|e| panic!("{e}"));
            let scene = Scene::read(&source, None).unwrap_or_else(|e| panic!("{e}"));
            assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
        }
        assert!(shaders.len() >= 26, "{}", shaders.len());
    }
}
