//! Models from OBJ and PLY files: their materials as glTF would say them.

use super::bytes::{MOST_BYTES, Place};
use super::{EXPORT, ImageSource, Model, Tables, add_input, refused};
use crate::scene::hash;
use crate::scene::mesh::read;
use crate::{Diagnostic, Result};
use serde_json::{Map, Value, json};

/// Reads an OBJ file that has been read as bytes: `inputs` has it already.
///
/// # Errors
/// When it is damaged, or has no faces.
pub(super) fn obj(place: &Place, file: &[u8], mut inputs: Vec<(String, String)>) -> Result<Model> {
    let mut total = 0;
    let mut library = |name: &str| {
        let place = place.beside(name).ok()?;
        let bytes = place.read("library of materials").ok()?;
        // A file may name many.
        total += bytes.len() as u64;
        if total > MOST_BYTES {
            return None;
        }
        add_input(&mut inputs, &place.name, hash(&bytes));
        Some(bytes)
    };
    let read = read::obj(file, &mut library);
    model(place, read, inputs)
}

/// Reads a PLY file, as [`obj`].
///
/// # Errors
/// When it is damaged, or has no faces.
pub(super) fn ply(place: &Place, file: &[u8], inputs: Vec<(String, String)>) -> Result<Model> {
    model(place, read::ply(file), inputs)
}

fn model(
    place: &Place,
    read: std::result::Result<read::Model, String>,
    inputs: Vec<(String, String)>,
) -> Result<Model> {
    let name = &place.name;
    let read = read.map_err(|why| refused(name, why).with_note(EXPORT))?;
    let mut made = Made {
        place,
        tables: Tables::default(),
        images: Vec::new(),
    };
    for material in &read.materials {
        let json = made.material(material);
        made.tables.materials.push(json);
    }
    let Made { tables, images, .. } = made;
    let of_draws: Vec<Option<usize>> = (0..tables.materials.len()).map(Some).collect();
    let mut mesh = read.mesh;
    mesh.tangents = vec![[0.0; 4]; mesh.positions.len()];
    let says = |what: &String| *Diagnostic::warning(format!("the model `{name}` {what}"));
    Ok(Model {
        bare: (0..of_draws.len()).collect(),
        materials: of_draws.iter().map(|i| tables.material(*i)).collect(),
        mesh,
        inputs,
        warnings: read.warnings.iter().map(says).collect(),
        images,
        tables,
        of_draws,
    })
}

/// Tables in the making.
struct Made<'m> {
    place: &'m Place,
    tables: Tables,
    images: Vec<ImageSource>,
}

impl Made<'_> {
    fn material(&mut self, material: &read::Material) -> Value {
        let mut surface = json!({
            "baseColorFactor": material.base_colour,
            "metallicFactor": material.metallic,
            "roughnessFactor": material.roughness,
        });
        let mut json = Map::new();
        let name = match material.name.as_str() {
            "" => "the default material",
            name => name,
        };
        json.insert("name".to_owned(), name.into());
        if let (Some(image), Value::Object(surface)) = (&material.base_image, &mut surface) {
            surface.insert("baseColorTexture".to_owned(), self.texture(image));
        }
        json.insert("pbrMetallicRoughness".to_owned(), surface);
        for (key, image) in [
            ("normalTexture", &material.normal_image),
            ("emissiveTexture", &material.emissive_image),
        ] {
            if let Some(image) = image {
                json.insert(key.to_owned(), self.texture(image));
            }
        }
        json.insert("emissiveFactor".to_owned(), json!(material.emission));
        if material.base_colour[3] < 1.0 {
            json.insert("alphaMode".to_owned(), "BLEND".into());
        }
        json.into()
    }

    /// A texture of a file beside the model: each use has an entry of its own.
    fn texture(&mut self, path: &str) -> Value {
        let image = self.images.len();
        self.images.push(ImageSource::beside(self.place, path));
        self.tables.textures.push(json!({ "source": image }));
        json!({ "index": image })
    }
}
