//! Textures and samplers: images from files and from the object's materials, placeholders for what has none, wrap
//! modes.

use super::Inference;
use super::Model;
use super::file::{Entries, Node, Toml, suggest};
use super::images::{ImageAnswer, ImageSource};
use super::materials::{Factor, Role};
use super::model::{MOST_BYTES, add_input};
use crate::eval::generated;
use crate::eval::image::{Image, Space, decode};
use crate::eval::machine::Resource;
use crate::eval::texture::{Comparison, Dimension, Sampler, Texture, Wrap};
use crate::front::names::{listed, words};
use crate::front::{Source, hash, similar_file};
use crate::{Diagnostic, Result};
use lodc_passes::facts::Fit;
use naga::{Expression, GlobalVariable, Handle, ImageClass, ImageDimension, ScalarKind, TypeInner};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use toml::Spanned;

/// A texture of the shader and its image.
#[derive(Clone, Debug)]
pub struct SceneTexture {
    /// The variable's name.
    pub name: String,
    /// Its group.
    pub group: u32,
    /// Its binding.
    pub binding: u32,
    /// Its image, or one for each draw of the object when they differ; of a dynamic texture a placeholder.
    pub images: Vec<Arc<Texture>>,
    /// Nobody knows its image: it is never averaged, baked or removed.
    pub dynamic: bool,
    /// Of a map of normals, which the scene or its name says that it is, the variance of its slopes at each MIP level
    /// (see [`Texture::slopes`]); empty for any other texture, and where images differ.
    pub slopes: Vec<[f32; 2]>,
    /// Sums of functions of its coordinates that are near its image (see [`Texture::fits`]); empty where images differ.
    pub fits: Vec<Fit>,
    /// The files of its image, as the scene names them.
    pub files: Vec<String>,
}

impl SceneTexture {
    /// Bytes of its images with their MIP levels, at 4 bytes a texel.
    pub fn bytes(&self) -> u64 {
        let mut distinct: Vec<&Arc<Texture>> = Vec::new();
        for image in &self.images {
            if !distinct.iter().any(|known| Arc::ptr_eq(known, image)) {
                distinct.push(image);
            }
        }
        let levels = distinct.into_iter().flat_map(|image| image.levels());
        levels.map(|level| 4 * level.texels.len() as u64).sum()
    }

    /// What is bound.
    pub(super) fn resource(&self) -> Resource {
        per_draw(self.images.iter().cloned().map(Resource::Texture).collect())
    }
}

/// A sampler of the shader.
#[derive(Clone, Debug)]
pub(super) struct SceneSampler {
    pub(super) name: String,
    /// Whether the object's materials say how it samples.
    pub(super) of_model: bool,
    pub(super) group: u32,
    pub(super) binding: u32,
    /// One, or one for each draw of the object when they differ.
    pub(super) samplers: Vec<Arc<Sampler>>,
}

impl SceneSampler {
    /// What is bound.
    pub(super) fn resource(&self) -> Resource {
        let samplers = self.samplers.iter().cloned().map(Resource::Sampler);
        per_draw(samplers.collect())
    }
}

/// One resource as it is, several as one for each draw.
fn per_draw(all: Vec<Resource>) -> Resource {
    match <[Resource; 1]>::try_from(all) {
        Ok([one]) => one,
        Err(several) => Resource::PerDraw(several.into()),
    }
}

/// The most texels that the images of a scene may have together: 2 GiB, and a third more for their MIP levels.
const MOST_TEXELS: u64 = 1 << 27;

/// What is made of `[textures]` and `[samplers]`.
#[derive(Debug, Default)]
pub(super) struct Images {
    pub(super) textures: Vec<SceneTexture>,
    pub(super) samplers: Vec<SceneSampler>,
    pub(super) inferences: Vec<Inference>,
    pub(super) warnings: Vec<Diagnostic>,
    /// Every file that was read and the hash of its bytes.
    pub(super) inputs: Vec<(String, String)>,
    /// Texels that were read so far.
    texels: u64,
    /// Images of the model, by their index and whether they are colours.
    decoded: BTreeMap<(usize, bool), (Arc<Texture>, String)>,
    /// Textures of one texel, by its bits.
    constants: BTreeMap<[u32; 4], Arc<Texture>>,
    /// The textures that take their images from the model.
    roles: BTreeMap<String, &'static Role>,
}

/// What a texture variable can hold.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Kind {
    dimension: Dimension,
    arrayed: bool,
    class: ImageClass,
    one_dimension: bool,
}

impl Kind {
    fn of(ty: &TypeInner) -> Option<Self> {
        let TypeInner::Image {
            dim,
            arrayed,
            class,
        } = *ty
        else {
            return None;
        };
        Some(Self {
            dimension: match dim {
                ImageDimension::D1 | ImageDimension::D2 => Dimension::D2,
                ImageDimension::D3 => Dimension::D3,
                ImageDimension::Cube => Dimension::Cube,
            },
            arrayed,
            class,
            one_dimension: dim == ImageDimension::D1,
        })
    }

    /// Whether it is a plain picture: one image of colours or numbers.
    fn is_plain(self) -> bool {
        self.dimension == Dimension::D2
            && !self.arrayed
            && !self.one_dimension
            && matches!(
                self.class,
                ImageClass::Sampled {
                    kind: ScalarKind::Float,
                    multi: false
                }
            )
    }

    /// Its WGSL type.
    fn name(self) -> String {
        let shape = match (self.dimension, self.one_dimension) {
            (_, true) => "1d",
            (Dimension::D2, _) => "2d",
            (Dimension::D3, _) => "3d",
            (Dimension::Cube, _) => "cube",
        };
        let array = if self.arrayed { "_array" } else { "" };
        match self.class {
            ImageClass::Depth { multi } => {
                format!(
                    "texture_depth_{}{shape}{array}",
                    if multi { "multisampled_" } else { "" }
                )
            }
            ImageClass::Sampled { kind, multi } => {
                let scalar = match kind {
                    ScalarKind::Sint => "i32",
                    ScalarKind::Uint => "u32",
                    _ => "f32",
                };
                let multi = if multi { "multisampled_" } else { "" };
                format!("texture_{multi}{shape}{array}<{scalar}>")
            }
            ImageClass::External => "texture_external".to_owned(),
            ImageClass::Storage { .. } => format!("texture_storage_{shape}{array}"),
        }
    }

    /// A value that a person could put in its place.
    fn example(self) -> String {
        match self.wants().0 {
            "file" => "\"...png\"".to_owned(),
            key => format!("{{ {key} = [\"...png\"] }}"),
        }
    }

    /// The key under which a scene names its images, and how many there are.
    fn wants(self) -> (&'static str, &'static str) {
        match (self.dimension, self.arrayed) {
            (Dimension::D2, false) => ("file", "one image"),
            (Dimension::D2, true) => ("layers", "a list of images, one for each layer"),
            (Dimension::D3, _) => ("layers", "a list of images, one for each slice"),
            (Dimension::Cube, false) => ("faces", "six images: +x, -x, +y, -y, +z, -z"),
            (Dimension::Cube, true) => {
                ("faces", "six images for each layer: +x, -x, +y, -y, +z, -z")
            }
        }
    }
}

/// Where images are looked for, and what they are drawn with when there are none.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place<'p> {
    /// The scene file's folder.
    pub(super) folder: &'p Path,
    /// What gives images.
    pub(super) source: &'p dyn ImageSource,
    /// The scene's seed.
    pub(super) seed: u64,
    /// The model that is drawn, if it is one.
    pub(super) model: Option<&'p Model>,
    /// The keywords of the material factors that the shader multiplies by itself.
    pub(super) factors: &'p BTreeSet<&'static str>,
}

/// Reads every texture that the scene names, makes placeholders for the rest, and sets up the samplers.
pub(super) fn resolve(
    source: &Source,
    toml: Toml,
    textures: &Entries,
    samplers: &Entries,
    place: Place,
) -> Result<Images> {
    let module = &source.module;
    let of_kind = |wanted: fn(&TypeInner) -> bool| {
        let all = module.global_variables.iter();
        all.filter(move |(_, v)| wanted(&module.types[v.ty].inner))
    };
    let images = || of_kind(|ty| matches!(ty, TypeInner::Image { .. }));
    let known = |all: &mut dyn Iterator<Item = (Handle<GlobalVariable>, &GlobalVariable)>| {
        all.filter_map(|(_, v)| v.name.clone())
            .collect::<BTreeSet<_>>()
    };
    let names = known(&mut images());
    if let Some((key, _)) = textures
        .0
        .iter()
        .find(|(k, _)| !names.contains(k.get_ref()))
    {
        return Err(toml.unknown("texture", key, names.iter().map(String::as_str)));
    }
    let mut found = Images::default();
    let mut wraps = BTreeMap::new();
    for (handle, variable) in images() {
        let (Some(binding), Some(name)) = (&variable.binding, &variable.name) else {
            continue;
        };
        let Some(kind) = Kind::of(&module.types[variable.ty].inner) else {
            continue;
        };
        if matches!(kind.class, ImageClass::Storage { .. }) {
            continue;
        }
        let entry = textures.get(name);
        let of_model = place.model.is_some() && kind.is_plain() && Role::infer(name).is_some();
        let is_asked = entry.is_none() && !of_model && is_used(source, handle);
        let answer = match is_asked {
            true => place.source.texture(name)?,
            false => ImageAnswer::Unknown,
        };
        let made = match is_asked && answer == ImageAnswer::Unknown {
            true => generated_file(source, name),
            false => None,
        };
        if let Some((file, bytes)) = made {
            let file = file.display().to_string();
            found.inputs.push((file.clone(), hash(&bytes)));
            let texture = generated::read(&file, &bytes)?;
            if texture.dimension() != kind.dimension || (texture.layers() > 1 && !kind.arrayed) {
                return Err(Diagnostic::error(format!(
                    "`{file}` is no image for the texture `{name}`"
                ))
                .with_note("make it again: run lodc on the shader that it belongs to"));
            }
            found.textures.push(SceneTexture {
                name: name.clone(),
                group: binding.group,
                binding: binding.binding,
                images: vec![Arc::new(texture)],
                dynamic: false,
                slopes: Vec::new(),
                fits: Vec::new(),
                files: Vec::new(),
            });
            continue;
        }
        let dynamic = match entry.map(|e| e.get_ref()) {
            Some(Node::Text(text)) => text == "dynamic",
            Some(_) => false,
            None if !is_used(source, handle) => continue,
            None if of_model => false,
            None if matches!(answer, ImageAnswer::Pixels(_)) => false,
            None if answer == ImageAnswer::Dynamic => true,
            None => {
                found
                    .warnings
                    .push(*no_image(source, handle, name, kind, toml.name));
                true
            }
        };
        let read = Reader {
            toml,
            place,
            name,
            kind,
        };
        let role = match entry {
            Some(entry) => read.role(entry)?.map(|(role, _)| role),
            None => None,
        };
        let normals = !dynamic && kind.is_plain() && Role::is_normals(role, name);
        let given = match answer {
            ImageAnswer::Pixels(texture) => Some(read.given(texture)?),
            ImageAnswer::Dynamic | ImageAnswer::Unknown => None,
        };
        let (images, files) = match (entry, Role::infer(name), place.model) {
            _ if given.is_some() => (given.into_iter().map(Arc::new).collect(), Vec::new()),
            (Some(entry), ..) if !dynamic => match read.said_role(entry)? {
                Some((role, space, model)) => read.of_model(role, space, model, &mut found)?,
                None => {
                    let (texture, files) = read.texture(entry, &mut found, &mut wraps)?;
                    (vec![Arc::new(texture)], files)
                }
            },
            (None, Some(role), Some(model)) if !dynamic => {
                let said = read.of_model(role, role.space, model, &mut found)?;
                let line = format!("{{ role = \"{}\" }}", role.keyword);
                let mut inference = Inference::new("textures", name, &line);
                inference.as_ = read.describe(role, model);
                let reason = format!("of the model's materials: {}", inference.as_);
                found.inferences.push(inference.because(reason));
                said
            }
            _ => {
                let seed = place.seed ^ hash_of(name);
                let placeholder = Texture::placeholder(seed, kind.dimension, 1);
                (vec![Arc::new(placeholder)], Vec::new())
            }
        };
        let slopes = match &images[..] {
            [image] if normals => image.slopes(),
            _ => Vec::new(),
        };
        let fits = match &images[..] {
            [image] if !dynamic => image.fits(),
            _ => Vec::new(),
        };
        found.textures.push(SceneTexture {
            name: name.clone(),
            group: binding.group,
            binding: binding.binding,
            images,
            dynamic,
            slopes,
            fits,
            files,
        });
    }
    let all = || of_kind(|ty| matches!(ty, TypeInner::Sampler { .. }));
    let names = known(&mut all());
    if let Some((key, _)) = samplers
        .0
        .iter()
        .find(|(k, _)| !names.contains(k.get_ref()))
    {
        return Err(toml.unknown("sampler", key, names.iter().map(String::as_str)));
    }
    let pairs = pairs(source);
    for (handle, variable) in all() {
        let (Some(binding), Some(name)) = (&variable.binding, &variable.name) else {
            continue;
        };
        let mut sampler = Sampler::default();
        let said = match samplers.get(name) {
            Some(entry) => read_sampler(toml, name, entry, &mut sampler)?,
            None => false,
        };
        let mut sampled = Vec::new();
        if !said {
            let with = || pairs.iter().filter(|(_, s)| *s == handle).map(|(t, _)| *t);
            let wrap = shared_wrap(source, toml, name, with(), &wraps)?;
            sampler.wrap = [wrap; 3];
            let named = with().filter_map(|t| module.global_variables[t].name.as_deref());
            let named: Vec<&str> = named.collect();
            if let Some(model) = place.model
                && !named.iter().any(|name| wraps.contains_key(*name))
            {
                sampled = model_samplers(model, &named, &found.roles, &sampler);
            }
        }
        let of_model = !sampled.is_empty();
        if sampled.windows(2).all(|w| w[0] == w[1]) {
            sampled.truncate(1);
        }
        if sampled.is_empty() {
            sampled.push(sampler);
        }
        found.samplers.push(SceneSampler {
            name: name.clone(),
            of_model,
            group: binding.group,
            binding: binding.binding,
            samplers: sampled.into_iter().map(Arc::new).collect(),
        });
    }
    Ok(found)
}

/// The file of a texture that was made for the levels of a shader that lodc has written, and what is in it: in the folder
/// `rock.lod` beside `rock.lod.wgsl` and `rock.snapshot.wgsl`.
fn generated_file(source: &Source, name: &str) -> Option<(PathBuf, Vec<u8>)> {
    let path = source
        .path
        .as_ref()
        .filter(|_| name.starts_with("loctx_"))?;
    let file = path.file_name()?.to_string_lossy();
    let mut ends = [".lod", ".snapshot"]
        .iter()
        .filter_map(|end| file.find(end));
    let stem = &file[..ends.next()?];
    let folder = path.with_file_name(format!("{stem}.lod"));
    generated::EXTENSIONS.iter().find_map(|extension| {
        let file = folder.join(format!("{name}.{extension}"));
        let bytes = std::fs::read(&file).ok()?;
        Some((file, bytes))
    })
}

/// How the materials of a model's draws sample the textures that a sampler is used with: as the first of them that
/// comes from the material says. Nothing when none does.
fn model_samplers(
    model: &Model,
    textures: &[&str],
    roles: &BTreeMap<String, &'static Role>,
    other: &Sampler,
) -> Vec<Sampler> {
    let roles: Vec<&Role> = textures
        .iter()
        .filter_map(|t| roles.get(*t).copied())
        .collect();
    if roles.is_empty() {
        return Vec::new();
    }
    let of = |maps: &BTreeMap<&'static str, super::materials::Map>| {
        let found = roles.iter().find_map(|role| maps.get(role.keyword));
        let said = found.map_or(*other, |map| map.sampler);
        Sampler {
            comparison: other.comparison,
            ..said
        }
    };
    model.materials.iter().map(|m| of(&m.maps)).collect()
}

/// Whether a chosen entry point may use a variable.
fn is_used(source: &Source, handle: Handle<GlobalVariable>) -> bool {
    let entries = [
        Some(source.fragment_entry().0),
        source.vertex_entry().map(|(i, _)| i),
    ];
    let mut used = entries.into_iter().flatten();
    used.any(|i| !source.info.get_entry_point(i)[handle].is_empty())
}

/// The textures and samplers that are used together, in a fixed order.
fn pairs(source: &Source) -> BTreeSet<(Handle<GlobalVariable>, Handle<GlobalVariable>)> {
    let entries = [
        Some(source.fragment_entry().0),
        source.vertex_entry().map(|(i, _)| i),
    ];
    entries
        .into_iter()
        .flatten()
        .flat_map(|i| source.info.get_entry_point(i).sampling_set.iter())
        .map(|key| (key.image, key.sampler))
        .collect()
}

/// The wrap mode that a sampler takes from its textures.
fn shared_wrap(
    source: &Source,
    toml: Toml,
    sampler: &str,
    textures: impl Iterator<Item = Handle<GlobalVariable>>,
    wraps: &BTreeMap<String, (Wrap, Range<usize>)>,
) -> Result<Wrap> {
    let mut first: Option<(&str, Wrap, Option<Range<usize>>)> = None;
    for texture in textures {
        let Some(name) = source.module.global_variables[texture].name.as_deref() else {
            continue;
        };
        let (wrap, span) = match wraps.get(name) {
            Some((wrap, span)) => (*wrap, Some(span.clone())),
            None => (Wrap::default(), None),
        };
        match &first {
            None => first = Some((name, wrap, span)),
            Some((other, its, its_span)) if *its != wrap => {
                let at = span.or_else(|| its_span.clone()).unwrap_or(0..0);
                return Err(toml
                    .error(
                        format!("`{other}` and `{name}` are sampled with `{sampler}` and want different wrap modes"),
                        at,
                        "",
                    )
                    .with_note(format!(
                        "a sampler has one wrap mode: say which under [samplers], `{sampler} = {{ wrap = \"repeat\" }}`"
                    )));
            }
            Some(_) => {}
        }
    }
    Ok(first.map_or_else(Wrap::default, |(_, wrap, _)| wrap))
}

fn wrap_of(toml: Toml, value: &Spanned<Node>) -> Result<Wrap> {
    choice(
        toml,
        "wrap mode",
        value,
        &[
            ("repeat", Wrap::Repeat),
            ("clamp", Wrap::ClampToEdge),
            ("mirror", Wrap::MirrorRepeat),
        ],
    )
}

/// One of a few words.
fn choice<T: Copy>(
    toml: Toml,
    what: &str,
    value: &Spanned<Node>,
    words: &[(&str, T)],
) -> Result<T> {
    let known: Vec<&str> = words.iter().map(|(word, _)| *word).collect();
    match value.get_ref() {
        Node::Text(text) => match words.iter().find(|(word, _)| word == text) {
            Some((_, meant)) => Ok(*meant),
            None => {
                let error = toml.error(format!("there is no {what} `{text}`"), value.span(), "");
                Err(suggest(error, text, &known))
            }
        },
        other => Err(toml
            .error(
                format!("a {what} is a text"),
                value.span(),
                format!("this is {}", other.what()),
            )
            .with_note(format!("it is {}", listed(known).replace(" and ", " or ")))),
    }
}

/// Reads an entry of `[samplers]`; tells whether it says how to wrap.
fn read_sampler(
    toml: Toml,
    name: &str,
    entry: &Spanned<Node>,
    sampler: &mut Sampler,
) -> Result<bool> {
    let Node::Table(keys) = entry.get_ref() else {
        return Err(toml
            .error(
                format!("the sampler `{name}` wants a table"),
                entry.span(),
                format!("this is {}", entry.get_ref().what()),
            )
            .with_note(format!(
                "write `{name} = {{ wrap = \"repeat\", filter = \"linear\" }}`"
            )));
    };
    let mut wraps = false;
    for (key, value) in &keys.0 {
        match key.get_ref().as_str() {
            "wrap" => {
                sampler.wrap = [wrap_of(toml, value)?; 3];
                wraps = true;
            }
            "filter" => {
                let linear = choice(
                    toml,
                    "filter",
                    value,
                    &[("linear", true), ("nearest", false)],
                )?;
                sampler.linear_magnification = linear;
                sampler.linear_minification = linear;
                sampler.linear_mip = linear;
            }
            "compare" => {
                sampler.comparison = choice(
                    toml,
                    "comparison",
                    value,
                    &[
                        ("never", Comparison::Never),
                        ("less", Comparison::Less),
                        ("equal", Comparison::Equal),
                        ("less-equal", Comparison::LessEqual),
                        ("greater", Comparison::Greater),
                        ("not-equal", Comparison::NotEqual),
                        ("greater-equal", Comparison::GreaterEqual),
                        ("always", Comparison::Always),
                    ],
                )?;
            }
            other => {
                let error = toml.error(format!("unknown key `{other}`"), key.span(), "");
                return Err(suggest(error, other, &["wrap", "filter", "compare"]));
            }
        }
    }
    Ok(wraps)
}

/// The colour spaces that a scene can name.
const SPACES: [(&str, Space); 2] = [("srgb", Space::Srgb), ("linear", Space::Linear)];

/// A texture of one texel.
fn constant_texture(texel: [f32; 4]) -> Arc<Texture> {
    let image = Image {
        width: 1,
        height: 1,
        texels: vec![texel],
    };
    // One texel makes a texture always.
    Arc::new(
        Texture::new(Dimension::D2, vec![image])
            .unwrap_or_else(|_| Texture::placeholder(0, Dimension::D2, 1)),
    )
}

impl Images {
    /// Counts an image's texels.
    fn count(&mut self, file: &str, image: &Image) -> Result<()> {
        self.texels += image.texels.len() as u64;
        match self.texels <= MOST_TEXELS {
            true => Ok(()),
            false => Err(Diagnostic::error(format!(
                "with `{file}` the images of the scene have more than {MOST_TEXELS} texels together"
            ))
            .with_note("make some of them smaller: levels of detail are for distances at which it is not seen")),
        }
    }
}

/// Reads one entry of `[textures]`.
struct Reader<'r> {
    toml: Toml<'r>,
    place: Place<'r>,
    name: &'r str,
    kind: Kind,
}

impl<'r> Reader<'r> {
    /// The role that a table says, with or without an image of its own, and where it says so.
    fn role(&self, entry: &Spanned<Node>) -> Result<Option<(&'static Role, Range<usize>)>> {
        let Node::Table(keys) = entry.get_ref() else {
            return Ok(None);
        };
        let Some(said) = keys.get("role") else {
            return Ok(None);
        };
        let known: Vec<(&str, &'static Role)> = Role::keywords()
            .filter_map(|keyword| Some((keyword, Role::of_keyword(keyword)?)))
            .collect();
        let role = match said.get_ref() {
            Node::Text(text) if Role::of_keyword(text).is_some() => Role::of_keyword(text),
            _ => None,
        };
        let role = match role {
            Some(role) => role,
            None => choice(self.toml, "role", said, &known)?,
        };
        Ok(Some((role, said.span())))
    }

    /// What `{ role = "..." }` says of an image of the model's: the role, the colour space and the model.
    fn said_role(
        &self,
        entry: &Spanned<Node>,
    ) -> Result<Option<(&'static Role, Space, &'r Model)>> {
        let toml = self.toml;
        let Node::Table(keys) = entry.get_ref() else {
            return Ok(None);
        };
        let own = ["file", "faces", "layers"];
        if own.iter().any(|key| keys.get(key).is_some()) {
            return Ok(None);
        }
        let Some((role, span)) = self.role(entry)? else {
            return Ok(None);
        };
        let mut space = role.space;
        for (key, value) in &keys.0 {
            match key.get_ref().as_str() {
                "role" => {}
                "space" => space = choice(toml, "colour space", value, &SPACES)?,
                other => {
                    let error = toml.error(format!("unknown key `{other}`"), key.span(), "");
                    return Err(suggest(error, other, &["role", "space"]));
                }
            }
        }
        if !self.kind.is_plain() {
            return Err(toml
                .error(
                    format!("`{}` is a {}", self.name, self.kind.name()),
                    span.clone(),
                    "a material's textures are of the type texture_2d<f32>",
                )
                .with_note("give its images, or write `\"dynamic\"`"));
        }
        match self.place.model {
            Some(model) => Ok(Some((role, space, model))),
            None => Err(toml
                .error(
                    format!(
                        "`{}` is to be a texture of a material, and the object has none",
                        self.name
                    ),
                    span,
                    "",
                )
                .with_note("name a model, `object = \"model.glb\"`, or give a file")),
        }
    }

    /// The images of a role in the materials of all draws, one when all are the same; and the files they are in.
    fn of_model(
        &self,
        role: &'static Role,
        space: Space,
        model: &Model,
        found: &mut Images,
    ) -> Result<(Vec<Arc<Texture>>, Vec<String>)> {
        found.roles.insert(self.name.to_owned(), role);
        let mut images: Vec<Arc<Texture>> = Vec::new();
        let mut files: Vec<String> = Vec::new();
        for material in &model.materials {
            let Some(map) = material.maps.get(role.keyword) else {
                let texel = self.stand_in(role, material);
                let constant = found.constants.entry(texel.map(f32::to_bits));
                images.push(constant.or_insert_with(|| constant_texture(texel)).clone());
                continue;
            };
            let key = (map.image, space == Space::Srgb);
            let (texture, file) = match found.decoded.get(&key) {
                Some(known) => known.clone(),
                None => {
                    let decoded = model.image(map.image, space)?;
                    if let Some(hash) = decoded.hash {
                        add_input(&mut found.inputs, &decoded.file, hash);
                    }
                    found.count(&decoded.file, &decoded.image)?;
                    let texture = Texture::new(Dimension::D2, vec![decoded.image])?;
                    let known = (Arc::new(texture.with_mip_chain()), decoded.file);
                    found.decoded.insert(key, known.clone());
                    known
                }
            };
            images.push(texture);
            if !files.contains(&file) {
                files.push(file);
            }
        }
        if images.windows(2).all(|w| Arc::ptr_eq(&w[0], &w[1])) {
            images.truncate(1);
        }
        Ok((images, files))
    }

    /// The texel that stands for a texture that a material has not: the one that changes nothing, times the factor
    /// that the shader has no place for.
    fn stand_in(&self, role: &Role, material: &super::materials::Material) -> [f32; 4] {
        let mut texel = role.neutral;
        let factor = role.factor.filter(|f| !self.place.factors.contains(f));
        if let Some(factor) = factor.and_then(Factor::of_keyword) {
            for (to, number) in texel.iter_mut().zip(material.factor(factor)) {
                *to *= number as f32;
            }
        }
        texel
    }

    /// What a texture was taken for: the role, and what stands for it where it is missing.
    fn describe(&self, role: &Role, model: &Model) -> String {
        let mut missing: BTreeMap<String, Vec<&str>> = BTreeMap::new();
        for material in &model.materials {
            if !material.maps.contains_key(role.keyword) {
                let colour = colour_name(self.stand_in(role, material));
                missing.entry(colour).or_default().push(&material.name);
            }
        }
        let all = |names: &Vec<&str>| names.len() == model.materials.len();
        let said: Vec<String> = missing
            .iter()
            .map(|(colour, names)| match all(names) {
                true => format!("{colour}: no material has it"),
                false => format!("{colour} for {}", listed(names.iter().copied())),
            })
            .collect();
        match said.is_empty() {
            true => role.keyword.to_owned(),
            false => format!("{} ({})", role.keyword, said.join("; ")),
        }
    }

    fn texture(
        &self,
        entry: &Spanned<Node>,
        found: &mut Images,
        wraps: &mut BTreeMap<String, (Wrap, Range<usize>)>,
    ) -> Result<(Texture, Vec<String>)> {
        let (toml, name) = (self.toml, self.name);
        let (key, what) = self.kind.wants();
        let wrong = |span: Range<usize>, remark: &str| {
            toml.error(format!("`{name}` is a {}", self.kind.name()), span, remark)
                .with_note(format!(
                    "give {what}: `{name} = {{ {key} = ... }}`, or `{name} = \"dynamic\"`"
                ))
        };
        if matches!(
            self.kind.class,
            ImageClass::Sampled { multi: true, .. }
                | ImageClass::Depth { multi: true }
                | ImageClass::External
        ) {
            return Err(toml
                .error(
                    format!(
                        "`{name}` is a {}, which has no image file",
                        self.kind.name()
                    ),
                    entry.span(),
                    "",
                )
                .with_note(format!("write `{name} = \"dynamic\"`")));
        }
        let mut files: Vec<(&str, Range<usize>)> = Vec::new();
        let mut space = None;
        let mut role = None;
        match entry.get_ref() {
            Node::Text(file) if key == "file" => files.push((file, entry.span())),
            Node::Text(_) => return Err(wrong(entry.span(), "this is one image")),
            Node::Table(keys) => {
                for (k, value) in &keys.0 {
                    match k.get_ref().as_str() {
                        given @ ("file" | "faces" | "layers") if given != key => {
                            return Err(wrong(k.span(), "not of this texture"));
                        }
                        "file" => match value.get_ref() {
                            Node::Text(file) => files.push((file, value.span())),
                            _ => return Err(wrong(value.span(), "this is no file name")),
                        },
                        "faces" | "layers" => {
                            let Node::List(list) = value.get_ref() else {
                                return Err(wrong(value.span(), "this is no list"));
                            };
                            for item in list {
                                match item.get_ref() {
                                    Node::Text(file) => files.push((file, item.span())),
                                    _ => return Err(wrong(item.span(), "this is no file name")),
                                }
                            }
                            let six = if self.kind.arrayed {
                                list.len() % 6 == 0
                            } else {
                                list.len() == 6
                            };
                            if list.is_empty() || (key == "faces" && !six) {
                                return Err(wrong(
                                    value.span(),
                                    &format!("these are {}", list.len()),
                                ));
                            }
                        }
                        "space" => {
                            space = Some(choice(toml, "colour space", value, &SPACES)?);
                        }
                        "wrap" => {
                            let wrap = wrap_of(toml, value)?;
                            wraps.insert(name.to_owned(), (wrap, value.span()));
                        }
                        "role" => role = self.role(entry)?.map(|(role, _)| role),
                        other => {
                            let error = toml.error(format!("unknown key `{other}`"), k.span(), "");
                            return Err(suggest(
                                error,
                                other,
                                &["file", "faces", "layers", "space", "wrap", "role"],
                            ));
                        }
                    }
                }
                if files.is_empty() {
                    return Err(wrong(entry.span(), "no image is named"));
                }
            }
            other => return Err(wrong(entry.span(), &format!("this is {}", other.what()))),
        }
        let space = space.or(role.map(|role| role.space));
        let space = self.space(space, &files, &mut found.inferences);
        let images = files
            .iter()
            .map(|(file, span)| self.image(file, span.clone(), space, found))
            .collect::<Result<Vec<_>>>()?;
        if self.kind.one_dimension && images.iter().any(|i| i.height != 1) {
            return Err(wrong(entry.span(), "this image is higher than one texel"));
        }
        let texture = Texture::new(self.kind.dimension, images).map_err(|misfit| {
            Box::<Diagnostic>::from(misfit)
                .with_source(toml.name, toml.text)
                .with_label(entry.span(), "")
        })?;
        // Integers have no means, and so no MIP levels.
        let texture = if space == Space::Integer {
            texture
        } else {
            texture.with_mip_chain()
        };
        Ok((
            texture,
            files.into_iter().map(|(f, _)| f.to_owned()).collect(),
        ))
    }

    /// The colour space: said, or told from the name.
    fn space(
        &self,
        said: Option<Space>,
        files: &[(&str, Range<usize>)],
        inferences: &mut Vec<Inference>,
    ) -> Space {
        match self.kind.class {
            ImageClass::Sampled {
                kind: ScalarKind::Sint | ScalarKind::Uint,
                ..
            } => return Space::Integer,
            ImageClass::Depth { .. } => return Space::Linear,
            _ => {}
        }
        if let Some(said) = said {
            return said;
        }
        let (space, word) = match is_colour(self.name) {
            true => (Space::Srgb, "srgb"),
            false => (Space::Linear, "linear"),
        };
        let key = self.kind.wants().0;
        let quoted: Vec<String> = files.iter().map(|(f, _)| format!("\"{f}\"")).collect();
        let named = match key {
            "file" => quoted.concat(),
            _ => format!("[{}]", quoted.join(", ")),
        };
        let mut inference = Inference::new(
            "textures",
            self.name,
            &format!("{{ {key} = {named}, space = \"{word}\" }}"),
        );
        inference.as_ = word.to_owned();
        inferences.push(inference);
        space
    }

    /// A texture as the image source gave it, with MIP levels.
    fn given(&self, texture: Texture) -> Result<Texture> {
        if texture.dimension() != self.kind.dimension {
            return Err(Diagnostic::error(format!(
                "the image that was given for `{}` is none of a {}",
                self.name,
                self.kind.name()
            ))
            .with_note(
                "the image source answers with a texture of that dimension, or that it is dynamic",
            ));
        }
        Ok(match texture.level_count() {
            1 => texture.with_mip_chain(),
            _ => texture,
        })
    }

    fn image(
        &self,
        file: &str,
        span: Range<usize>,
        space: Space,
        found: &mut Images,
    ) -> Result<Image> {
        let toml = self.toml;
        let path = self.place.folder.join(file);
        let data = std::fs::metadata(&path).ok().filter(|data| !data.is_dir());
        if data.is_some_and(|data| !data.is_file() || data.len() > MOST_BYTES) {
            return Err(toml
                .error(
                    format!(
                        "the image `{file}` of `{}` is no plain file of at most {} MiB",
                        self.name,
                        MOST_BYTES >> 20
                    ),
                    span,
                    "",
                )
                .with_note("name a PNG or JPEG file"));
        }
        let bytes = self.place.source.file(&path).map_err(|error| {
            if path.is_dir() {
                return toml
                    .error(
                        format!("the image `{file}` of `{}` is a folder", self.name),
                        span.clone(),
                        "",
                    )
                    .with_note("name a PNG or JPEG file in it");
            }
            if error.kind() != std::io::ErrorKind::NotFound {
                return toml.error(
                    format!("cannot read the image `{file}`: {error}"),
                    span.clone(),
                    "",
                );
            }
            let missing = toml.error(
                format!("there is no image `{file}` for `{}`", self.name),
                span.clone(),
                "relative to this file",
            );
            let missing = match similar_file(&path) {
                Some(near) => missing.with_note(format!("there is a `{near}` in that folder")),
                None => missing,
            };
            missing.with_note(format!(
                "write `{} = \"dynamic\"` if its image is not known",
                self.name
            ))
        })?;
        add_input(&mut found.inputs, file, super::hash(&bytes));
        let image =
            decode(file, &bytes, space).and_then(|image| found.count(file, &image).map(|()| image));
        image.map_err(|error| error.with_source(toml.name, toml.text).with_label(span, ""))
    }
}

/// A texel for a person.
fn colour_name(texel: [f32; 4]) -> String {
    match texel {
        [1.0, 1.0, 1.0, _] => "white".to_owned(),
        [0.0, 0.0, 0.0, _] => "black".to_owned(),
        [0.5, 0.5, 1.0, _] => "flat".to_owned(),
        [r, g, b, _] => format!("{r}, {g}, {b}"),
    }
}

/// Whether a texture's name says that it holds colours for the eye.
pub(super) fn is_colour(name: &str) -> bool {
    let words = words(name);
    let any = |list: &[&str]| words.iter().any(|w| list.contains(&w.as_str()));
    let colour = any(&[
        "albedo",
        "color",
        "colour",
        "basecolor",
        "basecolour",
        "diffuse",
        "emissive",
        "emission",
    ]);
    colour
        && !any(&[
            "lut",
            "normal",
            "normals",
            "mask",
            "height",
            "roughness",
            "ramp",
            "noise",
        ])
}

/// The warning for a texture that no scene names.
fn no_image(
    source: &Source,
    handle: Handle<GlobalVariable>,
    name: &str,
    kind: Kind,
    file: &str,
) -> Box<Diagnostic> {
    let value = kind.example();
    let remark = match sampled_in(source, handle) {
        Some(at) => format!("sampled in {at}"),
        None => "without an image".to_owned(),
    };
    let warning = Diagnostic::warning(format!(
        "texture `{name}` has no image, so it is dynamic: never averaged, baked or removed"
    ));
    source
        .locate(warning, source.variable(handle), remark)
        .with_note(format!(
            "add `{name} = {value}` under [textures] in {file},\nor `{name} = \"dynamic\"` to say so without a warning"
        ))
}

/// The first line in which a texture is read by its own name, with its file's name when that is not the shader's own.
fn sampled_in(source: &Source, texture: Handle<GlobalVariable>) -> Option<String> {
    let module = &source.module;
    let functions = module.functions.iter().map(|(_, f)| f);
    let all = functions.chain(module.entry_points.iter().map(|e| &e.function));
    let places = all.flat_map(|function| {
        function.expressions.iter().filter_map(|(handle, expression)| {
            let image = match expression {
                Expression::ImageSample { image, .. } | Expression::ImageLoad { image, .. } => *image,
                _ => return None,
            };
            let own = matches!(function.expressions[image], Expression::GlobalVariable(g) if g == texture);
            source.place(function.expressions.get_span(handle)).filter(|_| own)
        })
    });
    let first = places.min_by_key(|place| (place.file.start, place.range.start))?;
    let file = Path::new(first.file.name)
        .file_name()
        .filter(|_| !first.is_in_main());
    Some(match file {
        Some(file) => format!("{}:{}", file.display(), first.line()),
        None => format!("line {}", first.line()),
    })
}

/// The line that gives a texture its image, and its type.
pub(super) fn to_fill_in(source: &Source, name: &str) -> Option<(String, String)> {
    let module = &source.module;
    let mut all = module.global_variables.iter();
    let (_, variable) = all.find(|(_, v)| v.name.as_deref() == Some(name))?;
    let kind = Kind::of(&module.types[variable.ty].inner)?;
    let line = Inference::new("textures", name, &kind.example()).line_to_add;
    Some((line, kind.name()))
}

/// A number from a name, the same always (FNV-1a).
fn hash_of(name: &str) -> u64 {
    name.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    })
}

#[cfg(test)]
mod tests {
    use super::super::file::SceneFile;
    use super::*;
    use crate::eval::image::encode_png;
    use std::path::PathBuf;

    const TEXT: &str = "
        @group(0) @binding(0) var albedo: texture_2d<f32>;
        @group(0) @binding(1) var detail: texture_2d<f32>;
        @group(0) @binding(2) var sky: texture_cube<f32>;
        @group(0) @binding(3) var layers: texture_2d_array<f32>;
        @group(0) @binding(4) var ids: texture_2d<u32>;
        @group(0) @binding(5) var idle: texture_2d<f32>;
        @group(0) @binding(6) var shadow: texture_depth_2d;
        @group(1) @binding(0) var smooth_sampler: sampler;
        @group(1) @binding(1) var other_sampler: sampler;
        @group(1) @binding(2) var shadow_sampler: sampler_comparison;
        @fragment fn fs(@location(0) uv: vec2f) -> @location(0) vec4f {
            let a = textureSample(albedo, smooth_sampler, uv) + textureSample(detail, smooth_sampler, uv);
            let b = textureSample(sky, other_sampler, vec3f(uv, 1.0)) + textureSample(layers, other_sampler, uv, 0);
            return a + b + vec4f(textureLoad(ids, vec2i(0), 0))
                + textureSampleCompare(shadow, shadow_sampler, uv, 0.5);
        }";

    /// A folder with small images, removed at the end.
    struct Folder(PathBuf);

    impl Folder {
        fn new(name: &str) -> Self {
            let path =
                std::env::temp_dir().join(format!("lodc-textures-{name}-{}", std::process::id()));
            std::fs::create_dir_all(&path).unwrap();
            let write = |name: &str, width: u32, height: u32| {
                let pixels = vec![[128, 64, 32, 255]; (width * height) as usize];
                std::fs::write(path.join(name), encode_png(width, height, &pixels).unwrap())
                    .unwrap();
            };
            write("a.png", 4, 4);
            write("wide.png", 8, 4);
            std::fs::write(path.join("text.png"), "no image").unwrap();
            Self(path)
        }

        fn resolve(&self, text: &str) -> Result<Images> {
            let source = Source::parse("a.wgsl", TEXT).unwrap();
            let toml = Toml {
                name: "a.toml",
                text,
            };
            let file: SceneFile = toml.parse().unwrap();
            let place = Place {
                folder: &self.0,
                source: &crate::scene::Files,
                seed: 1,
                model: None,
                factors: &BTreeSet::new(),
            };
            resolve(&source, toml, &file.textures, &file.samplers, place)
        }
    }

    impl Drop for Folder {
        fn drop(&mut self) {
            let _ = std::fs::remove_dir_all(&self.0);
        }
    }

    const GOOD: &str = r#"[textures]
        albedo = "a.png"
        detail = { file = "a.png", space = "linear" }
        sky = { faces = ["a.png", "a.png", "a.png", "a.png", "a.png", "a.png"], wrap = "mirror" }
        layers = { layers = ["a.png", "a.png"], space = "linear", wrap = "mirror" }
        ids = "a.png"
        shadow = "dynamic"
        [samplers]
        shadow_sampler = { filter = "nearest", compare = "greater" }
        "#;

    #[test]
    fn images_are_read_in_their_colour_space() {
        let images = Folder::new("read").resolve(GOOD).unwrap();
        assert!(images.warnings.is_empty());
        let texture = |name: &str| images.textures.iter().find(|t| t.name == name).unwrap();
        let first = |name: &str| texture(name).images[0].levels()[0].texels[0];
        assert!((first("albedo")[0] - 0.2159).abs() < 1e-3);
        assert!((first("detail")[0] - 128.0 / 255.0).abs() < 1e-6);
        assert_eq!(first("ids"), [128.0, 64.0, 32.0, 255.0]);
        assert_eq!(texture("sky").images[0].dimension(), Dimension::Cube);
        assert_eq!(texture("layers").images[0].layers(), 2);
        assert_eq!(texture("albedo").images[0].level_count(), 3);
        assert_eq!(texture("ids").images[0].level_count(), 1);
        assert!(texture("shadow").dynamic && !texture("albedo").dynamic);
        assert_eq!(texture("layers").files, ["a.png", "a.png"]);
        // What nothing reads is not there.
        assert_eq!(images.textures.len(), 6);
        let told: Vec<_> = images
            .inferences
            .iter()
            .map(|i| (i.what.as_str(), i.as_.as_str()))
            .collect();
        assert_eq!(told, [("albedo", "srgb"), ("sky", "linear")]);
        assert_eq!(
            images.inferences[0].line_to_add,
            "albedo = { file = \"a.png\", space = \"srgb\" }"
        );
        assert_eq!(images.inputs.len(), 1);
        assert!(images.inputs[0].1.starts_with("blake3:"));
    }

    #[test]
    fn samplers_take_the_wrap_of_their_textures() {
        let images = Folder::new("wrap").resolve(GOOD).unwrap();
        let wraps: Vec<_> = images
            .samplers
            .iter()
            .map(|s| s.samplers[0].wrap[0])
            .collect();
        assert_eq!(wraps, [Wrap::Repeat, Wrap::MirrorRepeat, Wrap::Repeat]);
        let shadow = &images.samplers[2].samplers[0];
        assert!(!shadow.linear_magnification && shadow.comparison == Comparison::Greater);
        let text = GOOD.replace(
            "[samplers]",
            "[samplers]\nother_sampler = { wrap = \"clamp\" }",
        );
        let images = Folder::new("wrap2").resolve(&text).unwrap();
        assert_eq!(images.samplers[1].samplers[0].wrap[0], Wrap::ClampToEdge);
    }

    #[test]
    fn a_texture_that_nobody_names_is_dynamic_with_a_warning() {
        let images = Folder::new("dynamic").resolve("").unwrap();
        assert_eq!(images.warnings.len(), 6);
        let text = images.warnings[0].to_string();
        assert!(text.starts_with("warning: texture `albedo` has no image, so it is dynamic: never averaged, baked or removed"), "{text}");
        assert!(text.contains("a.wgsl:2:35"), "{text}");
        assert!(text.contains("^^^^^^ sampled in line 13"), "{text}");
        assert!(
            text.contains("`albedo = \"dynamic\"` to say so without a warning"),
            "{text}"
        );
        assert!(images.textures.iter().all(|t| t.dynamic));
        // Placeholders differ, and are the same on every run.
        assert_ne!(images.textures[0].images, images.textures[1].images);
        let again = Folder::new("dynamic2").resolve("").unwrap();
        assert_eq!(images.textures[0].images, again.textures[0].images);
    }

    /// Knows of two textures, by heart.
    #[derive(Debug)]
    struct Memory;

    impl ImageSource for Memory {
        fn texture(&self, name: &str) -> Result<ImageAnswer> {
            let texel = Image {
                width: 1,
                height: 1,
                texels: vec![[0.5, 0.25, 0.0, 1.0]],
            };
            Ok(match name {
                "known" | "round" => match Texture::new(Dimension::D2, vec![texel]) {
                    Ok(texture) => ImageAnswer::Pixels(texture),
                    Err(_) => ImageAnswer::Unknown,
                },
                "moving" => ImageAnswer::Dynamic,
                _ => ImageAnswer::Unknown,
            })
        }

        fn file(&self, _: &Path) -> std::io::Result<Vec<u8>> {
            Err(std::io::ErrorKind::NotFound.into())
        }
    }

    #[test]
    fn images_come_from_a_source_by_name() {
        let textures = |more: &str| {
            let text = format!(
                "@group(0) @binding(0) var known: texture_2d<f32>;
                 @group(0) @binding(1) var moving: texture_2d<f32>;
                 @group(0) @binding(2) var other: texture_2d<f32>;
                 @group(0) @binding(3) var round: texture_cube<f32>;
                 @group(0) @binding(4) var s: sampler;
                 @fragment fn fs(@location(0) uv: vec2f) -> @location(0) vec4f {{
                     return textureSample(known, s, uv) + textureSample(moving, s, uv) + textureSample(other, s, uv){more};
                 }}"
            );
            let source = Source::parse("a.wgsl", &text).unwrap_or_else(|e| panic!("{e}"));
            crate::scene::Scene::resolve_with(&source, None, &Memory)
        };
        let scene = textures("").unwrap_or_else(|e| panic!("{e}"));
        let dynamic: Vec<(&str, bool)> = scene
            .textures
            .iter()
            .map(|texture| (texture.name.as_str(), texture.dynamic))
            .collect();
        assert_eq!(
            dynamic,
            [("known", false), ("moving", true), ("other", true)]
        );
        assert_eq!(
            scene.textures[0].images[0].levels()[0].texels,
            [[0.5, 0.25, 0.0, 1.0]]
        );
        let warned = |name: &str| scene.warnings.iter().any(|w| w.message.contains(name));
        assert!(warned("`other`") && !warned("`moving`"));
        let error = textures(" + textureSample(round, s, vec3f(uv, 1.0))").expect_err("it is flat");
        assert!(error.message.contains("given for `round`"), "{error}");
    }

    #[test]
    fn wrong_entries_are_located() {
        let folder = Folder::new("wrong");
        for (line, message, place) in [
            ("fur = \"a.png\"", "there is no texture `fur`", "fur"),
            (
                "albedo = \"b.png\"",
                "there is no image `b.png` for `albedo`",
                "\"b.png\"",
            ),
            (
                "albedo = \".\"",
                "the image `.` of `albedo` is a folder",
                "\".\"",
            ),
            (
                "albedo = \"text.png\"",
                "cannot read the image `text.png`",
                "\"text.png\"",
            ),
            ("albedo = 5", "`albedo` is a texture_2d<f32>", "5"),
            ("albedo = {}", "`albedo` is a texture_2d<f32>", "{}"),
            (
                "albedo = { faces = [\"a.png\"] }",
                "`albedo` is a texture_2d<f32>",
                "faces",
            ),
            (
                "sky = \"a.png\"",
                "`sky` is a texture_cube<f32>",
                "\"a.png\"",
            ),
            (
                "sky = { faces = [\"a.png\"] }",
                "`sky` is a texture_cube<f32>",
                "[\"a.png\"]",
            ),
            (
                "sky = { faces = [\"wide.png\",\"wide.png\",\"wide.png\",\"wide.png\",\"wide.png\",\"wide.png\"] }",
                "the faces of a cube texture must be square",
                "",
            ),
            (
                "layers = { layers = [] }",
                "`layers` is a texture_2d_array<f32>",
                "[]",
            ),
            (
                "layers = { layers = [\"a.png\", \"wide.png\"] }",
                "the images of a texture differ in size",
                "",
            ),
            (
                "layers = { layers = [1] }",
                "`layers` is a texture_2d_array<f32>",
                "1",
            ),
            (
                "albedo = { file = \"a.png\", wrap = \"tile\" }",
                "there is no wrap mode `tile`",
                "\"tile\"",
            ),
            (
                "albedo = { file = \"a.png\", space = 1 }",
                "a colour space is a text",
                "1",
            ),
            (
                "albedo = { file = \"a.png\", spice = \"srgb\" }",
                "unknown key `spice`",
                "spice",
            ),
            (
                "detail = { file = \"a.png\", wrap = \"clamp\" }",
                "`albedo` and `detail` are sampled with `smooth_sampler`",
                "\"clamp\"",
            ),
            (
                "[samplers]\nfur_sampler = {}",
                "there is no sampler `fur_sampler`",
                "fur_sampler",
            ),
            (
                "[samplers]\nsmooth_sampler = 1",
                "the sampler `smooth_sampler` wants a table",
                "1",
            ),
            (
                "[samplers]\nsmooth_sampler = { filter = \"cubic\" }",
                "there is no filter `cubic`",
                "\"cubic\"",
            ),
            (
                "[samplers]\nsmooth_sampler = { wrapp = \"clamp\" }",
                "unknown key `wrapp`",
                "wrapp",
            ),
        ] {
            let text = format!("[textures]\n{line}\n");
            let error = folder.resolve(&text).expect_err(line);
            assert!(error.message.starts_with(message), "{error}");
            let covered = &text[error.labels[0].0.clone()];
            assert!(place.is_empty() || covered == place, "{line}: {covered}");
        }
    }

    #[test]
    fn textures_without_image_files_are_dynamic_or_refused() {
        let text = "@group(0) @binding(0) var many: texture_multisampled_2d<f32>;
            @group(0) @binding(1) var line: texture_1d<f32>;
            @fragment fn fs() -> @location(0) vec4f { return textureLoad(many, vec2i(0), 0) + textureLoad(line, 0, 0); }";
        let folder = Folder::new("odd");
        let source = Source::parse("a.wgsl", text).unwrap();
        let place = Place {
            folder: &folder.0,
            source: &crate::scene::Files,
            seed: 1,
            model: None,
            factors: &BTreeSet::new(),
        };
        let images = |text: &str| {
            let toml = Toml {
                name: "a.toml",
                text,
            };
            let file: SceneFile = toml.parse().unwrap();
            resolve(&source, toml, &file.textures, &file.samplers, place)
        };
        assert!(images("[textures]\nmany = \"dynamic\"\nline = \"dynamic\"").is_ok());
        let error = images("[textures]\nmany = \"a.png\"").unwrap_err();
        assert_eq!(
            error.message,
            "`many` is a texture_multisampled_2d<f32>, which has no image file"
        );
        let error = images("[textures]\nmany = \"dynamic\"\nline = \"a.png\"").unwrap_err();
        assert_eq!(error.message, "`line` is a texture_1d<f32>");
        assert!(error.labels[0].1.contains("higher than one texel"));
    }

    #[test]
    fn a_misspelt_image_is_found() {
        let error = Folder::new("near")
            .resolve("[textures]\nalbedo = \"wid.png\"")
            .unwrap_err();
        assert!(
            error
                .notes
                .contains(&"there is a `wide.png` in that folder".to_owned()),
            "{error}"
        );
    }

    #[test]
    fn names_say_which_textures_are_colours() {
        for (name, colour) in [
            ("albedo_texture", true),
            ("baseColor", true),
            ("emissive_map", true),
            ("t_diffuse", true),
            ("diffuse_lut", false),
            ("normal_map", false),
            ("roughness", false),
            ("color_mask", false),
        ] {
            assert_eq!(is_colour(name), colour, "{name}");
        }
    }
}
