//! Models as scenes name them: glTF, GLB, OBJ and PLY files as a mesh with a material for each draw.
//!
//! ```text
//! file --gltf, plain--> Mesh, a Material for each draw, places of images --tangents--> Mesh
//! Model --looks--> what a GLB of the same materials needs
//! ```
//!
//! Images are decoded when a shader wants them, not before.

mod bytes;
mod gltf;
mod looks;
mod plain;
pub(super) mod tangents;

use super::hash;
use super::materials::Material;
use super::mesh::Mesh;
use crate::eval::image::{Image, Space, decode};
use crate::{Diagnostic, Result};
pub(super) use bytes::MOST_BYTES;
use bytes::Place;
use serde_json::Value;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

/// A model as a scene needs it.
#[derive(Clone, Debug)]
pub(crate) struct Model {
    /// Its triangles, a draw for each material.
    pub(crate) mesh: Mesh,
    /// The material of each draw, in their order.
    pub(super) materials: Vec<Material>,
    /// The draws whose file has no tangents.
    pub(crate) bare: Vec<usize>,
    /// Every file that was read, as the scene names it, and the hash of its bytes.
    pub(super) inputs: Vec<(String, String)>,
    /// What should be known.
    pub(crate) warnings: Vec<Diagnostic>,
    images: Vec<ImageSource>,
    tables: Tables,
    /// The place of each draw's material in the table; nothing where it has the default one.
    of_draws: Vec<Option<usize>>,
}

/// The tables of a glTF file that say what surfaces look like; of other files, those that say the same.
#[derive(Clone, Debug, Default)]
struct Tables {
    materials: Vec<Value>,
    textures: Vec<Value>,
    samplers: Vec<Value>,
}

impl Tables {
    fn material(&self, index: Option<usize>) -> Material {
        let json = index.and_then(|i| self.materials.get(i));
        let name = json.and_then(|m| m.get("name")).and_then(Value::as_str);
        let name = match (name, index) {
            (Some(name), _) => name.to_owned(),
            (None, Some(index)) => format!("material {index}"),
            (None, None) => "the default material".to_owned(),
        };
        let json = json.unwrap_or(&Value::Null);
        Material::read(name, json, &self.textures, &self.samplers)
    }
}

/// Where an image is.
#[derive(Clone, Debug)]
enum ImageSource {
    File(Place),
    /// In the bytes of a file of the model, named from the scene. Any number of images may be in the same bytes.
    Embedded {
        file: String,
        buffer: Arc<Vec<u8>>,
        range: Range<usize>,
    },
    /// Nowhere that can be read, and why.
    Lost(String),
}

impl ImageSource {
    /// An image by its path from the model's folder.
    fn beside(place: &Place, path: &str) -> Self {
        match place.beside(path) {
            Ok(place) => Self::File(place),
            Err(why) => Self::Lost(why),
        }
    }
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

/// The formats of models.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Format {
    Gltf,
    Obj,
    Ply,
}

impl Format {
    fn of_name(name: &str) -> Option<Self> {
        let end = name.rsplit_once('.')?.1.to_lowercase();
        match end.as_str() {
            "gltf" | "glb" => Some(Self::Gltf),
            "obj" => Some(Self::Obj),
            "ply" => Some(Self::Ply),
            _ => None,
        }
    }
}

impl Model {
    /// Whether a scene's object is the name of a model's file.
    pub(super) fn is_named(object: &str) -> bool {
        Format::of_name(object).is_some()
    }

    /// What to do about something that is no model's name.
    pub(super) fn way_out(name: &str) -> String {
        let lower = name.to_lowercase();
        let others = [
            ".stl", ".fbx", ".off", ".dae", ".usd", ".usdz", ".blend", ".3ds", ".x3d",
        ];
        if let Some(inside) = lower
            .strip_suffix(".gz")
            .filter(|inside| Self::is_named(inside))
        {
            let unpacked = &name[..inside.len()];
            return format!("unpack it, with `gunzip`, and name `{unpacked}`");
        }
        match others.iter().any(|end| lower.ends_with(end)) {
            true => "models are glTF 2.0, OBJ or PLY: export it as .gltf or .glb".to_owned(),
            false => "a model is named by its file, .gltf, .glb, .obj or .ply".to_owned(),
        }
    }

    /// Reads a model. `name` is the path as the scene says it, relative to `folder`.
    ///
    /// # Errors
    /// When a file cannot be read or is damaged, when the model has no triangles, or too many.
    pub(crate) fn read(name: &str, folder: &Path) -> Result<Self> {
        let Some(format) = Format::of_name(name) else {
            return Err(
                Diagnostic::error(format!("`{name}` is no model")).with_note(Self::way_out(name))
            );
        };
        let place = Place {
            name: name.to_owned(),
            path: folder.join(name),
        };
        let file = place.read("model")?;
        let inputs = vec![(name.to_owned(), hash(&file))];
        match format {
            Format::Gltf => gltf::read(&place, &file, inputs),
            Format::Obj => plain::obj(&place, &file, inputs),
            Format::Ply => plain::ply(&place, &file, inputs),
        }
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
                    hash: Some(hash(&bytes)),
                    file: place.name.clone(),
                })
            }
            Some(ImageSource::Embedded {
                file,
                buffer,
                range,
            }) => Ok(Decoded {
                image: decode(
                    &format!("{file}, image {index}"),
                    buffer.get(range.clone()).unwrap_or_default(),
                    space,
                )?,
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

/// Adds a file once.
pub(super) fn add_input(inputs: &mut Vec<(String, String)>, name: &str, hash: String) {
    if !inputs.iter().any(|(known, _)| known == name) {
        inputs.push((name.to_owned(), hash));
    }
}
