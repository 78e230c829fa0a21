//! Textures and samplers: images from files, placeholders for what has none, wrap modes.

use super::Inference;
use super::file::{Entries, Node, Toml, suggest};
use crate::eval::image::{Image, Space, decode};
use crate::eval::texture::{Comparison, Dimension, Sampler, Texture, Wrap};
use crate::front::names::{listed, words};
use crate::front::{Source, similar_file};
use crate::{Diagnostic, Result};
use naga::{Expression, GlobalVariable, Handle, ImageClass, ImageDimension, ScalarKind, TypeInner};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::Path;
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
    /// The image; of a dynamic texture a placeholder.
    pub texture: Arc<Texture>,
    /// Nobody knows its image: it is never averaged, baked or removed.
    pub dynamic: bool,
    /// The files of its image, as the scene names them.
    pub files: Vec<String>,
}

/// A sampler of the shader.
#[derive(Clone, Debug)]
pub(super) struct SceneSampler {
    pub(super) group: u32,
    pub(super) binding: u32,
    pub(super) sampler: Arc<Sampler>,
}

/// What is made of `[textures]` and `[samplers]`.
#[derive(Debug, Default)]
pub(super) struct Images {
    pub(super) textures: Vec<SceneTexture>,
    pub(super) samplers: Vec<SceneSampler>,
    pub(super) inferences: Vec<Inference>,
    pub(super) warnings: Vec<Diagnostic>,
    /// Every file that was read and the hash of its bytes.
    pub(super) inputs: Vec<(String, String)>,
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
    /// The scene's seed.
    pub(super) seed: u64,
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
        let dynamic = match entry.map(|e| e.get_ref()) {
            Some(Node::Text(text)) => text == "dynamic",
            Some(_) => false,
            None if !is_used(source, handle) => continue,
            None => {
                found
                    .warnings
                    .push(*no_image(source, handle, name, kind, toml.name));
                true
            }
        };
        let (texture, files) = match entry {
            Some(entry) if !dynamic => {
                let read = Reader {
                    toml,
                    place,
                    name,
                    kind,
                };
                let (texture, files) = read.texture(entry, &mut found, &mut wraps)?;
                (texture, files)
            }
            _ => {
                let seed = place.seed ^ hash_of(name);
                (Texture::placeholder(seed, kind.dimension, 1), Vec::new())
            }
        };
        found.textures.push(SceneTexture {
            name: name.clone(),
            group: binding.group,
            binding: binding.binding,
            texture: Arc::new(texture),
            dynamic,
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
        if !said {
            let with = pairs.iter().filter(|(_, s)| *s == handle).map(|(t, _)| *t);
            let wrap = shared_wrap(source, toml, name, with, &wraps)?;
            sampler.wrap = [wrap; 3];
        }
        found.samplers.push(SceneSampler {
            group: binding.group,
            binding: binding.binding,
            sampler: Arc::new(sampler),
        });
    }
    Ok(found)
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

/// Reads one entry of `[textures]`.
struct Reader<'r> {
    toml: Toml<'r>,
    place: Place<'r>,
    name: &'r str,
    kind: Kind,
}

impl Reader<'_> {
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
                            let spaces = [("srgb", Space::Srgb), ("linear", Space::Linear)];
                            space = Some(choice(toml, "colour space", value, &spaces)?);
                        }
                        "wrap" => {
                            let wrap = wrap_of(toml, value)?;
                            wraps.insert(name.to_owned(), (wrap, value.span()));
                        }
                        other => {
                            let error = toml.error(format!("unknown key `{other}`"), k.span(), "");
                            return Err(suggest(
                                error,
                                other,
                                &["file", "faces", "layers", "space", "wrap"],
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
        let space = self.space(space, &files, &mut found.inferences);
        let images = files
            .iter()
            .map(|(file, span)| self.image(file, span.clone(), space, &mut found.inputs))
            .collect::<Result<Vec<_>>>()?;
        if self.kind.one_dimension && images.iter().any(|i| i.height != 1) {
            return Err(wrong(entry.span(), "this image is higher than one texel"));
        }
        let at = |error: Box<Diagnostic>| {
            error
                .with_source(toml.name, toml.text)
                .with_label(entry.span(), "")
        };
        let texture = Texture::new(self.kind.dimension, images).map_err(at)?;
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

    fn image(
        &self,
        file: &str,
        span: Range<usize>,
        space: Space,
        inputs: &mut Vec<(String, String)>,
    ) -> Result<Image> {
        let toml = self.toml;
        let path = self.place.folder.join(file);
        let bytes = std::fs::read(&path).map_err(|error| {
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
        if !inputs.iter().any(|(name, _)| name == file) {
            inputs.push((file.to_owned(), super::hash(&bytes)));
        }
        decode(file, &bytes, space)
            .map_err(|error| error.with_source(toml.name, toml.text).with_label(span, ""))
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
    let (key, _) = kind.wants();
    let value = match key {
        "file" => "\"...png\"".to_owned(),
        key => format!("{{ {key} = [\"...png\"] }}"),
    };
    let remark = match sampled_in(source, handle) {
        Some(line) => format!("sampled in line {line}"),
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

/// The first line in which a texture is read by its own name.
fn sampled_in(source: &Source, texture: Handle<GlobalVariable>) -> Option<u32> {
    let module = &source.module;
    let functions = module.functions.iter().map(|(_, f)| f);
    let all = functions.chain(module.entry_points.iter().map(|e| &e.function));
    all.flat_map(|function| {
        function.expressions.iter().filter_map(|(handle, expression)| {
            let image = match expression {
                Expression::ImageSample { image, .. } | Expression::ImageLoad { image, .. } => *image,
                _ => return None,
            };
            let own = matches!(function.expressions[image], Expression::GlobalVariable(g) if g == texture);
            let place = source.place(function.expressions.get_span(handle)).filter(|_| own)?;
            Some(place.line())
        })
    })
    .min()
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
                seed: 1,
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
        let first = |name: &str| texture(name).texture.levels()[0].texels[0];
        assert!((first("albedo")[0] - 0.2159).abs() < 1e-3);
        assert!((first("detail")[0] - 128.0 / 255.0).abs() < 1e-6);
        assert_eq!(first("ids"), [128.0, 64.0, 32.0, 255.0]);
        assert_eq!(texture("sky").texture.dimension(), Dimension::Cube);
        assert_eq!(texture("layers").texture.layers(), 2);
        assert_eq!(texture("albedo").texture.level_count(), 3);
        assert_eq!(texture("ids").texture.level_count(), 1);
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
        let wraps: Vec<_> = images.samplers.iter().map(|s| s.sampler.wrap[0]).collect();
        assert_eq!(wraps, [Wrap::Repeat, Wrap::MirrorRepeat, Wrap::Repeat]);
        let shadow = &images.samplers[2].sampler;
        assert!(!shadow.linear_magnification && shadow.comparison == Comparison::Greater);
        let text = GOOD.replace(
            "[samplers]",
            "[samplers]\nother_sampler = { wrap = \"clamp\" }",
        );
        let images = Folder::new("wrap2").resolve(&text).unwrap();
        assert_eq!(images.samplers[1].sampler.wrap[0], Wrap::ClampToEdge);
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
        assert_ne!(images.textures[0].texture, images.textures[1].texture);
        let again = Folder::new("dynamic2").resolve("").unwrap();
        assert_eq!(images.textures[0].texture, again.textures[0].texture);
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
            seed: 1,
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
