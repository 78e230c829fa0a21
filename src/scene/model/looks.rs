//! What a model looks like, for the file that its levels are written to: its materials as they are, images embedded.
//!
//! Texture coordinates of a [`Model`] have been moved already, by the transform of the first texture of each draw's
//! material, and its first set is the one that this texture is read with. So textures that are read the same way need
//! no transform any more, and those of others are changed by what is left.

use super::{EXPORT, ImageSource, MOST_BYTES, Model};
use crate::scene::materials::{UvPlace, uv_place};
use crate::{Diagnostic, Result};
use lodc_mesh::write::{Looks, Picture};
use serde_json::{Map, Value, json};
use std::collections::BTreeSet;

const TRANSFORM: &str = "KHR_texture_transform";

impl Model {
    /// Its materials, with the bytes of all images.
    ///
    /// # Errors
    /// When an image cannot be read.
    pub(crate) fn looks(&self) -> Result<Looks> {
        let mut materials = self.tables.materials.clone();
        for (index, material) in self.of_draws.iter().zip(&self.materials) {
            let json = index.and_then(|index| materials.get_mut(index));
            if let Some(json) = json {
                move_textures(json, &material.place());
            }
        }
        let mut extensions = BTreeSet::new();
        let mut texts = |values: &[Value]| -> Vec<String> {
            for value in values {
                extensions_of(value, &mut extensions);
            }
            values.iter().map(Value::to_string).collect()
        };
        let mut total = 0;
        let mut images = Vec::new();
        for (index, image) in self.images.iter().enumerate() {
            let picture = picture(index, image)?;
            total += picture.bytes.len() as u64;
            if total > MOST_BYTES {
                return Err(Diagnostic::error(format!(
                    "the images of the model have more than {} MiB together",
                    MOST_BYTES >> 20
                ))
                .with_note("export it with smaller ones"));
            }
            images.push(picture);
        }
        Ok(Looks {
            of_draws: self.of_draws.clone(),
            materials: texts(&materials),
            textures: texts(&self.tables.textures),
            samplers: texts(&self.tables.samplers),
            images,
            extensions: extensions.into_iter().collect(),
        })
    }
}

fn picture(index: usize, image: &ImageSource) -> Result<Picture> {
    let (name, bytes) = match image {
        ImageSource::File(place) => {
            let name = std::path::Path::new(&place.name).file_stem();
            let name = name.map(|name| name.to_string_lossy().into_owned());
            (name.unwrap_or_default(), place.read("image")?)
        }
        ImageSource::Embedded { buffer, range, .. } => {
            let bytes = buffer.get(range.clone()).unwrap_or_default();
            (format!("image {index}"), bytes.to_vec())
        }
        ImageSource::Lost(why) => {
            return Err(Diagnostic::error(format!(
                "cannot read image {index} of the model: {why}"
            ))
            .with_note(EXPORT));
        }
    };
    let kinds: [(&[u8], &str); 4] = [
        (b"\x89PNG", "image/png"),
        (b"\xff\xd8\xff", "image/jpeg"),
        (b"\xabKTX 20", "image/ktx2"),
        (b"DDS ", "image/vnd-ms.dds"),
    ];
    let known = kinds.iter().find(|(start, _)| bytes.starts_with(start));
    let webp = bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"WEBP");
    let kind = match (known, webp) {
        (Some((_, kind)), _) => *kind,
        (None, true) => "image/webp",
        (None, false) => {
            return Err(Diagnostic::error(format!(
                "cannot embed image {index} of the model, `{name}`: it is of no known format"
            ))
            .with_note("convert it to PNG or JPEG"));
        }
    };
    Ok(Picture {
        name,
        kind: kind.to_owned(),
        bytes,
    })
}

/// All extensions that a value has somewhere.
fn extensions_of(value: &Value, found: &mut BTreeSet<String>) {
    match value {
        Value::Object(members) => {
            if let Some(Value::Object(extensions)) = members.get("extensions") {
                found.extend(extensions.keys().cloned());
            }
            // What is in extras is nobody's business.
            for (_, value) in members.iter().filter(|(key, _)| *key != "extras") {
                extensions_of(value, found);
            }
        }
        Value::Array(all) => all.iter().for_each(|value| extensions_of(value, found)),
        _ => {}
    }
}

/// Changes all textures of a material for coordinates that are where `place` has moved them.
fn move_textures(value: &mut Value, place: &UvPlace) {
    let Value::Object(members) = value else {
        return;
    };
    for (key, value) in members {
        match value {
            Value::Object(info) if key.ends_with("Texture") && info.contains_key("index") => {
                move_texture(info, place);
            }
            _ if key != "extras" => move_textures(value, place),
            _ => {}
        }
    }
}

fn move_texture(info: &mut Map<String, Value>, place: &UvPlace) {
    let own = uv_place(info);
    let rest = if own.set != place.set {
        // The other set, which nothing has been done to.
        Some(UvPlace { set: 1, ..own })
    } else if own == *place || place.rotation != 0.0 || place.scale.contains(&0.0) {
        // What was turned before it is stretched otherwise has no transform: the first texture's is taken for all.
        None
    } else {
        let scale = [0, 1].map(|i| own.scale[i] / place.scale[i]);
        let turned = UvPlace {
            scale,
            offset: [0.0; 2],
            ..own
        };
        let [u, v] = turned.apply(place.offset.map(|x| x as f32)).map(f64::from);
        Some(UvPlace {
            set: 0,
            offset: [own.offset[0] - u, own.offset[1] - v],
            ..turned
        })
    };
    info.remove("texCoord");
    let mut extensions = match info.remove("extensions") {
        Some(Value::Object(extensions)) => extensions,
        _ => Map::new(),
    };
    extensions.remove(TRANSFORM);
    if let Some(rest) = rest {
        let UvPlace {
            offset,
            rotation,
            scale,
            set,
        } = rest;
        if set != 0 {
            info.insert("texCoord".to_owned(), set.into());
        }
        if (UvPlace { set: 0, ..rest }) != UvPlace::default() {
            let transform = json!({ "offset": offset, "rotation": rotation, "scale": scale });
            extensions.insert(TRANSFORM.to_owned(), transform);
        }
    }
    if !extensions.is_empty() {
        info.insert("extensions".to_owned(), extensions.into());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn textures_are_read_where_they_were_read_before() {
        let info = |set: u32, transform: Value| json!({ "index": 0, "texCoord": set, "extensions": { TRANSFORM: transform, "X": {} } });
        let first = info(1, json!({ "scale": [2, 4], "offset": [0.5, 0.25] }));
        let mut material = json!({
            "name": "a",
            "pbrMetallicRoughness": { "baseColorTexture": first },
            "normalTexture": info(1, json!({ "scale": [4, 4], "rotation": 0.5 })),
            "extensions": { "KHR_materials_sheen": { "sheenColorTexture": { "index": 1 } } },
            "emissiveTexture": info(1, json!({ "scale": [2, 4], "offset": [0.5, 0.25] })),
        });
        let before = |path: &str, uv| {
            let info = material.pointer(path).unwrap().as_object().unwrap();
            uv_place(info).apply(uv)
        };
        let uv = [0.75, 0.5];
        let moved = before("/pbrMetallicRoughness/baseColorTexture", uv);
        let normal = before("/normalTexture", uv);
        let place = uv_place(first.as_object().unwrap());
        move_textures(&mut material, &place);
        let after = |path: &str| uv_place(material.pointer(path).unwrap().as_object().unwrap());
        assert_eq!(
            material["pbrMetallicRoughness"]["baseColorTexture"],
            json!({ "index": 0, "extensions": { "X": {} } })
        );
        assert_eq!(after("/emissiveTexture"), UvPlace::default());
        let again = after("/normalTexture");
        assert_eq!(again.set, 0);
        for (x, y) in again.apply(moved).into_iter().zip(normal) {
            assert!((x - y).abs() < 1e-6, "{again:?}");
        }
        // The first set is the second now.
        let sheen = after("/extensions/KHR_materials_sheen/sheenColorTexture");
        assert_eq!(sheen.set, 1);
        let mut found = BTreeSet::new();
        extensions_of(&material, &mut found);
        let found: Vec<&String> = found.iter().collect();
        assert_eq!(found, ["KHR_materials_sheen", TRANSFORM, "X"]);
    }
}
