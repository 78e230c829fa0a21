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
mod primitive;

use super::bytes::{self, Place};
use super::{EXPORT, ImageSource, Model, Tables, add_input, refused};
use crate::scene::hash;
use crate::scene::materials::Material;
use crate::scene::mesh::read::MOST_TRIANGLES;
use crate::scene::mesh::{Draw, Mesh};
use crate::{Diagnostic, Result};
use glam::DMat4;
use primitive::Part;
use serde_json::Value;
use std::collections::BTreeSet;
use std::sync::Arc;

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

/// Reads a model of a file that has been read: `inputs` has it already.
///
/// # Errors
/// When the file or one of its buffers is damaged, when the model has no triangles, or too many.
pub(super) fn read(place: &Place, file: &[u8], mut inputs: Vec<(String, String)>) -> Result<Model> {
    let name = place.name.as_str();
    let (json, chunk) = split(name, file)?;
    let mut json: Value = serde_json::from_slice(json)
        .map_err(|error| refused(name, format!("its JSON is broken: {error}")).with_note(EXPORT))?;
    check_extensions(name, &mut json)?;
    let list = |key: &str| match json.get(key) {
        Some(Value::Array(all)) => all.clone(),
        _ => Vec::new(),
    };
    let tables = Tables {
        materials: list("materials"),
        textures: list("textures"),
        samplers: list("samplers"),
    };
    let images = list("images");
    give_sources(&mut json);
    let document = document(name, json)?;
    let (buffers, files) = read_buffers(&document, place, chunk, &mut inputs)?;
    let images = images
        .iter()
        .map(|image| image_source(image, &document, place, &buffers, &files))
        .collect();
    let mut reading = Reading {
        name,
        buffers: &buffers,
        triangles: 0,
        vertices: 0,
        draws: Vec::new(),
        skipped: BTreeSet::new(),
        repaired: 0,
    };
    for (node, transform) in nodes(&document, name)? {
        reading.node(&node, transform, &tables)?;
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
    let Merged {
        mesh,
        of_draws,
        materials,
        bare,
    } = merge(reading.draws);
    if mesh.indices.is_empty() {
        return Err(refused(name, "it has no triangles".to_owned())
            .with_note("its default scene must have a mesh of triangles"));
    }
    for material in &materials {
        warnings.extend(about(name, material));
    }
    Ok(Model {
        mesh,
        materials,
        bare,
        inputs,
        warnings,
        images,
        tables,
        of_draws,
    })
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

/// A primitive whose positions are in no accessor: the `gltf` crate looks for their bounds before it looks whether they
/// are there, and panics.
fn lost_positions(json: &Value) -> Option<String> {
    fn list<'v>(value: &'v Value, key: &str) -> &'v [Value] {
        value
            .get(key)
            .and_then(Value::as_array)
            .map_or(&[], Vec::as_slice)
    }
    let count = list(json, "accessors").len() as u64;
    for (m, mesh) in list(json, "meshes").iter().enumerate() {
        for (p, primitive) in list(mesh, "primitives").iter().enumerate() {
            let index = primitive
                .pointer("/attributes/POSITION")
                .and_then(Value::as_u64);
            if index.is_some_and(|index| index >= count) {
                return Some(format!(
                    "the positions of mesh {m}, primitive {p} are in no accessor"
                ));
            }
        }
    }
    None
}

fn document(name: &str, json: Value) -> Result<gltf::Document> {
    let broken =
        |why: String| refused(name, format!("it is no valid glTF 2.0: {why}")).with_note(EXPORT);
    if let Some(why) = lost_positions(&json) {
        return Err(broken(why));
    }
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
) -> Result<(Vec<accessor::Bytes>, Vec<String>)> {
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
                    let place = place.beside(&bytes::decoded(uri)).map_err(|why| {
                        refused(name, format!("buffer {i}: {why}")).with_note(
                            "put the file there, or export the model as GLB, which holds everything",
                        )
                    })?;
                    let bytes = place.read("buffer")?;
                    add_input(inputs, &place.name, hash(&bytes));
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
        buffers.push(Arc::new(bytes));
        files.push(file);
    }
    Ok((buffers, files))
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
    vertices: usize,
    draws: Vec<(Option<usize>, Material, Vec<Part>)>,
    /// What is not drawn, or not as the file means it.
    skipped: BTreeSet<String>,
    repaired: usize,
}

impl Reading<'_> {
    fn node(&mut self, node: &gltf::Node, transform: DMat4, tables: &Tables) -> Result<()> {
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
                self.draws.push((index, tables.material(index), Vec::new()));
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
            self.vertices += part.positions.len();
            if self.vertices > accessor::MOST_ENTRIES {
                return Err(refused(
                    self.name,
                    format!("it has more than {} vertices", accessor::MOST_ENTRIES),
                )
                .with_note("export fewer objects, or a coarser one"));
            }
            self.repaired += part.repaired;
            parts.push(part);
        }
        Ok(())
    }
}

/// All primitives, those of a material together.
#[derive(Default)]
struct Merged {
    mesh: Mesh,
    /// Of each draw the place of its material in the file, and the material.
    of_draws: Vec<Option<usize>>,
    materials: Vec<Material>,
    /// The draws that lack tangents.
    bare: Vec<usize>,
}

fn merge(draws: Vec<(Option<usize>, Material, Vec<Part>)>) -> Merged {
    let mut merged = Merged::default();
    let mesh = &mut merged.mesh;
    let all = || draws.iter().flat_map(|(_, _, parts)| parts);
    let second = all().any(|part| !part.second_uvs.is_empty());
    for (index, material, parts) in &draws {
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
            merged.bare.push(merged.materials.len());
        }
        merged.of_draws.push(*index);
        merged.materials.push(material.clone());
        mesh.draws.push(Draw {
            vertices: vertices..mesh.positions.len(),
            triangles: triangles..mesh.indices.len() / 3,
        });
    }
    merged
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

/// Where an image is.
fn image_source(
    json: &Value,
    document: &gltf::Document,
    place: &Place,
    buffers: &accessor::Buffers,
    files: &[String],
) -> ImageSource {
    if let Some(uri) = json.get("uri").and_then(Value::as_str) {
        return match bytes::of_data_uri(uri) {
            None => ImageSource::beside(place, &bytes::decoded(uri)),
            Some(Ok(bytes)) => ImageSource::Embedded {
                file: place.name.clone(),
                range: 0..bytes.len(),
                buffer: Arc::new(bytes),
            },
            Some(Err(why)) => ImageSource::Lost(why),
        };
    }
    let view = json.get("bufferView").and_then(Value::as_u64);
    let view = view.and_then(|index| document.views().nth(usize::try_from(index).ok()?));
    let found = view.and_then(|view| {
        let buffer = view.buffer().index();
        let range = view.offset()..view.offset().checked_add(view.length())?;
        let bytes = buffers.get(buffer)?;
        bytes.get(range.clone())?;
        Some(ImageSource::Embedded {
            file: files.get(buffer)?.clone(),
            buffer: Arc::clone(bytes),
            range,
        })
    });
    match found {
        Some(found) => found,
        None => ImageSource::Lost("its bytes are not there".to_owned()),
    }
}
