//! Models from glTF and GLB files: all primitives of the default scene in one mesh, with a draw for each material.
//!
//! ```text
//! file --bytes--> JSON and buffers --accessor--> primitives, moved by their nodes --> Mesh, a Material for each draw
//! ```
//!
//! Node transforms are put into the vertices, so that the model matrix of a scene means the whole object. Images are
//! decoded when a shader wants them, not before. What a file may not do (huge counts, indices out of range, positions
//! that are no numbers) is an error that names the primitive; what lodc does not draw (skins, morph targets, lines)
//! is a warning.

mod accessor;
mod bytes;
mod primitive;
pub(super) mod tangents;

use super::materials::Material;
use super::mesh::{Draw, Mesh};
use crate::eval::image::{Image, Space, decode};
use crate::{Diagnostic, Result};
pub(super) use bytes::MOST_BYTES;
use bytes::Place;
use glam::DMat4;
use primitive::Part;
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::Path;

/// The most triangles that a model may have. A frame keeps some 600 bytes for each that is in view.
pub(super) const MOST_TRIANGLES: usize = 2_000_000;

/// The most bytes of JSON, which takes several times as much when it is read.
const MOST_JSON: usize = 128 << 20;

/// Extensions that a file may require: those that lodc knows, and those that change nothing that it draws.
const KNOWN_EXTENSIONS: [&str; 6] = [
    "KHR_texture_transform",
    "KHR_mesh_quantization",
    "KHR_lights_punctual",
    "KHR_texture_basisu",
    "EXT_texture_webp",
    "MSFT_texture_dds",
];

/// A model as a scene needs it.
#[derive(Clone, Debug)]
pub(super) struct Model {
    /// Its triangles, a draw for each material.
    pub(super) mesh: Mesh,
    /// The material of each draw, in their order.
    pub(super) materials: Vec<Material>,
    /// The draws whose file has no tangents.
    pub(super) bare: Vec<usize>,
    /// Every file that was read, as the scene names it, and the hash of its bytes.
    pub(super) inputs: Vec<(String, String)>,
    /// What should be known.
    pub(super) warnings: Vec<Diagnostic>,
    images: Vec<ImageSource>,
}

/// Where an image is.
#[derive(Clone, Debug)]
enum ImageSource {
    File(Place),
    /// In the bytes of a file of the model, named from the scene.
    Embedded {
        file: String,
        bytes: Vec<u8>,
    },
    /// Nowhere that can be read, and why.
    Lost(String),
}

/// An image of a model, decoded.
#[derive(Debug)]
pub(super) struct Decoded {
    /// The file that it is in, as the scene names it.
    pub(super) file: String,
    /// The hash of that file's bytes, when it was not read before.
    pub(super) hash: Option<String>,
    pub(super) image: Image,
}

impl Model {
    /// Whether a scene's object is the name of a model's file.
    pub(super) fn is_named(object: &str) -> bool {
        let lower = object.to_lowercase();
        lower.ends_with(".gltf") || lower.ends_with(".glb")
    }

    /// Reads a model. `name` is the path as the scene says it, relative to `folder`.
    ///
    /// # Errors
    /// When a file cannot be read or is damaged, when the model has no triangles, or too many.
    pub(super) fn read(name: &str, folder: &Path) -> Result<Self> {
        let place = Place {
            name: name.to_owned(),
            path: folder.join(name),
        };
        let file = place.read("model")?;
        let mut inputs = vec![(name.to_owned(), super::hash(&file))];
        let (json, chunk) = split(name, &file)?;
        let mut json: Value = serde_json::from_slice(json).map_err(|error| {
            refused(name, format!("its JSON is broken: {error}")).with_note(EXPORT)
        })?;
        check_extensions(name, &mut json)?;
        give_sources(&mut json);
        let list = |key: &str| match json.get(key) {
            Some(Value::Array(all)) => all.clone(),
            _ => Vec::new(),
        };
        let (materials, textures) = (list("materials"), list("textures"));
        let (samplers, images) = (list("samplers"), list("images"));
        let document = document(name, json)?;
        let (buffers, files) = read_buffers(&document, &place, chunk, &mut inputs)?;
        let images = images
            .iter()
            .map(|image| ImageSource::of(image, &document, &place, &buffers, &files))
            .collect();

        let material = |index: Option<usize>| {
            let json = index.and_then(|i| materials.get(i));
            let name = json.and_then(|m| m.get("name")).and_then(Value::as_str);
            let name = match (name, index) {
                (Some(name), _) => name.to_owned(),
                (None, Some(index)) => format!("material {index}"),
                (None, None) => "the default material".to_owned(),
            };
            Material::read(name, json.unwrap_or(&Value::Null), &textures, &samplers)
        };
        let mut reading = Reading {
            name,
            buffers: &buffers,
            triangles: 0,
            draws: Vec::new(),
            skipped: BTreeSet::new(),
            repaired: 0,
        };
        for (node, transform) in nodes(&document, name)? {
            reading.node(&node, transform, &material)?;
        }
        let mut warnings: Vec<Diagnostic> = Vec::new();
        for what in &reading.skipped {
            warnings.push(*Diagnostic::warning(format!("the model `{name}` {what}")));
        }
        if reading.repaired > 0 {
            warnings.push(*Diagnostic::warning(format!(
                "{} normals of the model `{name}` have no direction, and stand upright on their triangles instead",
                reading.repaired
            )));
        }
        let (mesh, materials, bare) = merge(reading.draws);
        if mesh.indices.is_empty() {
            return Err(refused(name, "it has no triangles".to_owned())
                .with_note("its default scene must have a mesh of triangles"));
        }
        for material in &materials {
            warnings.extend(about(name, material));
        }
        Ok(Self {
            mesh,
            materials,
            bare,
            inputs,
            warnings,
            images,
        })
    }

    /// Reads and decodes one of its images.
    ///
    /// # Errors
    /// When it cannot be read, or is neither PNG nor JPEG.
    pub(super) fn image(&self, index: usize, space: Space) -> Result<Decoded> {
        match self.images.get(index) {
            Some(ImageSource::File(place)) => {
                let bytes = place.read("image")?;
                Ok(Decoded {
                    image: decode(&place.name, &bytes, space)?,
                    hash: Some(super::hash(&bytes)),
                    file: place.name.clone(),
                })
            }
            Some(ImageSource::Embedded { file, bytes }) => Ok(Decoded {
                image: decode(&format!("{file}, image {index}"), bytes, space)?,
                hash: None,
                file: file.clone(),
            }),
            Some(ImageSource::Lost(why)) => Err(Diagnostic::error(format!(
                "cannot read image {index} of the model: {why}"
            ))
            .with_note(EXPORT)),
            None => Err(Diagnostic::error(format!(
                "the model has no image {index}, which one of its textures names"
            ))
            .with_note(EXPORT)),
        }
    }
}

const EXPORT: &str = "export the model again, as glTF 2.0 or GLB";

fn refused(name: &str, why: String) -> Box<Diagnostic> {
    Diagnostic::error(format!("cannot read the model `{name}`: {why}"))
}

/// The JSON of a file, and a GLB's chunk of bytes.
fn split<'b>(name: &str, file: &'b [u8]) -> Result<(&'b [u8], Option<&'b [u8]>)> {
    let (json, chunk) = match file.strip_prefix(b"glTF") {
        None => (file, None),
        Some(rest) => glb(rest).ok_or_else(|| {
            refused(name, "its GLB container is cut off or damaged".to_owned()).with_note(EXPORT)
        })?,
    };
    if json.len() > MOST_JSON {
        return Err(refused(
            name,
            format!(
                "its JSON has {} MiB, and at most {} are read",
                json.len() >> 20,
                MOST_JSON >> 20
            ),
        )
        .with_note("export it as GLB, which keeps buffers apart from the JSON"));
    }
    Ok((json, chunk))
}

/// What a GLB of version 2 holds behind its first word.
fn glb(rest: &[u8]) -> Option<(&[u8], Option<&[u8]>)> {
    let word = |bytes: &[u8], at: usize| {
        let word = bytes.get(at..at.checked_add(4)?)?;
        Some(u32::from_le_bytes(word.try_into().ok()?) as usize)
    };
    let chunk = |bytes: &'_ [u8], at: usize| -> Option<(std::ops::Range<usize>, usize)> {
        let start = at.checked_add(8)?;
        let end = start.checked_add(word(bytes, at)?)?;
        Some((start..end, word(bytes, at + 4)?))
    };
    if word(rest, 0)? != 2 {
        return None;
    }
    let (json, kind) = chunk(rest, 8)?;
    // "JSON", "BIN\0".
    if kind != 0x4e4f_534a {
        return None;
    }
    let binary = match chunk(rest, json.end) {
        Some((range, 0x004e_4942)) => Some(rest.get(range)?),
        _ => None,
    };
    Some((rest.get(json)?, binary))
}

/// Refuses what the file requires and lodc does not read. What it requires is no question after this.
fn check_extensions(name: &str, json: &mut Value) -> Result<()> {
    let Some(object) = json.as_object_mut() else {
        return Err(refused(name, "its JSON is no object".to_owned()).with_note(EXPORT));
    };
    let required = object.remove("extensionsRequired");
    let required = required.as_ref().and_then(Value::as_array);
    for extension in required.into_iter().flatten().filter_map(Value::as_str) {
        if KNOWN_EXTENSIONS.contains(&extension) || extension.starts_with("KHR_materials_") {
            continue;
        }
        let compressed = extension.contains("draco") || extension.contains("meshopt");
        return Err(
            refused(name, format!("it requires the extension `{extension}`")).with_note(
                match compressed {
                    true => {
                        "export it without mesh compression, or let a tool take it off: `gltf-transform copy in.glb out.glb`"
                    }
                    false => "export it without that extension",
                },
            ),
        );
    }
    Ok(())
}

/// Textures whose image is named by an extension alone get a source, which the tables of the `gltf` crate need: the
/// image's own bytes then say which format it is.
fn give_sources(json: &mut Value) {
    let textures = json.get_mut("textures").and_then(Value::as_array_mut);
    for texture in textures.into_iter().flatten() {
        if texture.get("source").is_some() {
            continue;
        }
        let extensions = texture.get("extensions").and_then(Value::as_object);
        let mut sources = extensions.into_iter().flat_map(|all| all.values());
        let source = sources.find_map(|extension| extension.get("source").cloned());
        if let (Some(source), Some(texture)) = (source, texture.as_object_mut()) {
            texture.insert("source".to_owned(), source);
        }
    }
}

fn document(name: &str, json: Value) -> Result<gltf::Document> {
    let broken =
        |why: String| refused(name, format!("it is no valid glTF 2.0: {why}")).with_note(EXPORT);
    let root: gltf::json::Root =
        serde_json::from_value(json).map_err(|error| broken(error.to_string()))?;
    gltf::Document::from_json(root).map_err(|error| match error {
        gltf::Error::Validation(errors) => broken(match errors.first() {
            Some((path, error)) => format!("{path}: {}", error.to_string().to_lowercase()),
            None => "it does not pass validation".to_owned(),
        }),
        other => broken(other.to_string()),
    })
}

/// The bytes of every buffer, and the file that each is in.
fn read_buffers(
    document: &gltf::Document,
    place: &Place,
    chunk: Option<&[u8]>,
    inputs: &mut Vec<(String, String)>,
) -> Result<(Vec<Vec<u8>>, Vec<String>)> {
    let name = &place.name;
    let mut buffers = Vec::new();
    let mut files = Vec::new();
    let mut total = 0;
    for (i, buffer) in document.buffers().enumerate() {
        let lost = |why: String| refused(name, format!("buffer {i}: {why}")).with_note(EXPORT);
        let (bytes, file) = match buffer.source() {
            gltf::buffer::Source::Bin => match chunk {
                Some(chunk) => (chunk.to_vec(), name.clone()),
                None => return Err(lost("the file has no chunk of bytes".to_owned())),
            },
            gltf::buffer::Source::Uri(uri) => match bytes::of_data_uri(uri) {
                Some(bytes) => (bytes.map_err(lost)?, name.clone()),
                None => {
                    let place = place.beside(uri);
                    let bytes = place.read("buffer")?;
                    add_input(inputs, &place.name, super::hash(&bytes));
                    (bytes, place.name)
                }
            },
        };
        total += bytes.len() as u64;
        if total > bytes::MOST_BYTES {
            return Err(lost("together they are too large".to_owned()));
        }
        if bytes.len() < buffer.length() {
            return Err(lost(format!(
                "it has {} bytes instead of {}",
                bytes.len(),
                buffer.length()
            )));
        }
        buffers.push(bytes);
        files.push(file);
    }
    Ok((buffers, files))
}

/// Adds a file once.
pub(super) fn add_input(inputs: &mut Vec<(String, String)>, name: &str, hash: String) {
    if !inputs.iter().any(|(known, _)| known == name) {
        inputs.push((name.to_owned(), hash));
    }
}

impl ImageSource {
    fn of(
        json: &Value,
        document: &gltf::Document,
        place: &Place,
        buffers: &accessor::Buffers,
        files: &[String],
    ) -> Self {
        if let Some(uri) = json.get("uri").and_then(Value::as_str) {
            return match bytes::of_data_uri(uri) {
                None => Self::File(place.beside(uri)),
                Some(Ok(bytes)) => Self::Embedded {
                    file: place.name.clone(),
                    bytes,
                },
                Some(Err(why)) => Self::Lost(why),
            };
        }
        let view = json.get("bufferView").and_then(Value::as_u64);
        let view = view.and_then(|index| document.views().nth(usize::try_from(index).ok()?));
        let found = view.and_then(|view| {
            let buffer = view.buffer().index();
            let end = view.offset().checked_add(view.length())?;
            let bytes = buffers.get(buffer)?.get(view.offset()..end)?;
            Some((files.get(buffer)?.clone(), bytes.to_vec()))
        });
        match found {
            Some((file, bytes)) => Self::Embedded { file, bytes },
            None => Self::Lost("its bytes are not there".to_owned()),
        }
    }
}

/// The nodes of the default scene that have a mesh, each with its way to world space, in the order of the file's tree.
/// Without a default scene it is the first; without any, all nodes that are nobody's children.
fn nodes<'d>(document: &'d gltf::Document, name: &str) -> Result<Vec<(gltf::Node<'d>, DMat4)>> {
    let scene = document.default_scene().or(document.scenes().next());
    let roots: Vec<gltf::Node> = match scene {
        Some(scene) => scene.nodes().collect(),
        None => {
            let children: BTreeSet<usize> = document
                .nodes()
                .flat_map(|node| node.children().map(|child| child.index()))
                .collect();
            let nodes = document.nodes();
            nodes.filter(|n| !children.contains(&n.index())).collect()
        }
    };
    let mut found = Vec::new();
    let mut seen = BTreeSet::new();
    let mut stack: Vec<(gltf::Node, DMat4)> = roots
        .into_iter()
        .rev()
        .map(|node| (node, DMat4::IDENTITY))
        .collect();
    while let Some((node, parent)) = stack.pop() {
        if !seen.insert(node.index()) {
            return Err(refused(
                name,
                format!("node {} has two parents, or is its own", node.index()),
            )
            .with_note(EXPORT));
        }
        let local = node.transform().matrix();
        let local = DMat4::from_cols_array_2d(&local.map(|column| column.map(f64::from)));
        let transform = parent * local;
        let children: Vec<gltf::Node> = node.children().collect();
        stack.extend(children.into_iter().rev().map(|child| (child, transform)));
        if node.mesh().is_some() {
            found.push((node, transform));
        }
    }
    Ok(found)
}

/// What was read so far: the primitives of each material.
struct Reading<'r> {
    name: &'r str,
    buffers: &'r accessor::Buffers,
    triangles: usize,
    draws: Vec<(Option<usize>, Material, Vec<Part>)>,
    /// What is not drawn, or not as the file means it.
    skipped: BTreeSet<String>,
    repaired: usize,
}

impl Reading<'_> {
    fn node(
        &mut self,
        node: &gltf::Node,
        transform: DMat4,
        material: &dyn Fn(Option<usize>) -> Material,
    ) -> Result<()> {
        let Some(mesh) = node.mesh() else {
            return Ok(());
        };
        let mut transform = transform;
        if node.skin().is_some() {
            let what = "has a skin: it is drawn at rest, as if it had none";
            self.skipped.insert(what.to_owned());
            // Joints decide where a skinned mesh is, not its node.
            transform = DMat4::IDENTITY;
        }
        let what = mesh.name().map_or_else(
            || format!("mesh {}", mesh.index()),
            |name| format!("`{name}`"),
        );
        for primitive in mesh.primitives() {
            let what = match mesh.primitives().len() {
                1 => what.clone(),
                _ => format!("{what}, primitive {}", primitive.index()),
            };
            if primitive.morph_targets().len() > 0 {
                let what = "has morph targets: it is drawn without them";
                self.skipped.insert(what.to_owned());
            }
            let index = primitive.material().index();
            let known = self.draws.iter().position(|(i, ..)| *i == index);
            let known = known.unwrap_or_else(|| {
                self.draws.push((index, material(index), Vec::new()));
                self.draws.len() - 1
            });
            let Some((_, material, parts)) = self.draws.get_mut(known) else {
                continue;
            };
            let read = primitive::read(&primitive, material.place(), transform, self.buffers);
            let wrong =
                |why: String| refused(self.name, format!("{what}: {why}")).with_note(EXPORT);
            let Some(part) = read.map_err(wrong)? else {
                let what = "has points or lines, which are not drawn";
                self.skipped.insert(what.to_owned());
                continue;
            };
            self.triangles += part.triangles.len();
            if self.triangles > MOST_TRIANGLES {
                return Err(refused(
                    self.name,
                    format!("it has more than {MOST_TRIANGLES} triangles"),
                )
                .with_note("export fewer objects, or a coarser one"));
            }
            self.repaired += part.repaired;
            parts.push(part);
        }
        Ok(())
    }
}

/// One mesh of all primitives, those of a material together; the materials; and the draws that lack tangents.
fn merge(draws: Vec<(Option<usize>, Material, Vec<Part>)>) -> (Mesh, Vec<Material>, Vec<usize>) {
    let mut mesh = Mesh::default();
    let mut materials = Vec::new();
    let mut bare = Vec::new();
    let all = || draws.iter().flat_map(|(_, _, parts)| parts);
    let second = all().any(|part| !part.second_uvs.is_empty());
    for (_, material, parts) in &draws {
        let vertices = mesh.positions.len();
        let triangles = mesh.indices.len() / 3;
        let whole = parts.iter().all(|part| !part.tangents.is_empty());
        for part in parts {
            let first = mesh.positions.len() as u32;
            let count = part.positions.len();
            mesh.positions.extend_from_slice(&part.positions);
            mesh.normals.extend_from_slice(&part.normals);
            mesh.uvs.extend_from_slice(&part.uvs);
            mesh.colours.extend_from_slice(&part.colours);
            match whole {
                true => mesh.tangents.extend_from_slice(&part.tangents),
                false => mesh.tangents.extend(vec![[0.0; 4]; count]),
            }
            if second {
                mesh.second_uvs
                    .extend_from_slice(match part.second_uvs.is_empty() {
                        true => &part.uvs,
                        false => &part.second_uvs,
                    });
            }
            let corners = part.triangles.as_flattened().iter();
            mesh.indices.extend(corners.map(|corner| first + corner));
        }
        if mesh.indices.len() / 3 == triangles {
            continue;
        }
        if !whole {
            bare.push(materials.len());
        }
        materials.push(material.clone());
        mesh.draws.push(Draw {
            vertices: vertices..mesh.positions.len(),
            triangles: triangles..mesh.indices.len() / 3,
        });
    }
    (mesh, materials, bare)
}

/// What of a material is not drawn as it is meant.
fn about(name: &str, material: &Material) -> Vec<Diagnostic> {
    let mut warnings = Vec::new();
    let elsewhere = material.elsewhere();
    if !elsewhere.is_empty() {
        let warning = Diagnostic::warning(format!(
            "textures of the material `{}` of the model `{name}` are read with different texture coordinates",
            material.name
        ));
        warnings.push(*warning.with_note(format!(
            "`uv` are those of the first; the shader reads all with what it is fed: {}",
            crate::front::names::listed(elsewhere)
        )));
    }
    warnings
}
