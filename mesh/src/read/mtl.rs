//! Materials of OBJ files: those of their properties that have a place in glTF's model.

use super::Material;
use super::obj::{lines, short};

/// Adds the materials of a library. Lines that cannot be read are as if they were not there, and a warning.
pub(super) fn read(
    name: &str,
    bytes: &[u8],
    materials: &mut Vec<Material>,
    warnings: &mut Vec<String>,
) {
    let text = String::from_utf8_lossy(bytes);
    let mut broken = 0;
    // A library that is named twice adds nothing.
    let mut current: Option<Material> = None;
    for (_, line) in lines(&text) {
        let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((&line, ""));
        if keyword == "newmtl" {
            add(materials, current.take());
            current = Some(Material::named(rest.trim()));
            continue;
        }
        let Some(material) = &mut current else {
            continue;
        };
        if property(material, keyword, rest.trim()).is_none() {
            broken += 1;
        }
    }
    add(materials, current);
    if broken > 0 {
        warnings.push(format!(
            "has {broken} lines in `{}` that cannot be read",
            short(name)
        ));
    }
}

fn add(materials: &mut Vec<Material>, material: Option<Material>) {
    if let Some(material) = material
        && !materials.iter().any(|known| known.name == material.name)
    {
        materials.push(material);
    }
}

/// Sets a property; nothing when what stands there cannot be read. Others than these are left alone.
fn property(material: &mut Material, keyword: &str, rest: &str) -> Option<()> {
    match keyword {
        "Kd" => {
            let [r, g, b] = colour(rest)?;
            material.base_colour[..3].copy_from_slice(&[r, g, b]);
        }
        "Ke" => material.emission = colour(rest)?,
        "d" => material.base_colour[3] = share(rest)?,
        "Tr" => material.base_colour[3] = 1.0 - share(rest)?,
        "Pr" => material.roughness = share(rest)?,
        "Pm" => material.metallic = share(rest)?,
        "map_Kd" => material.base_image = Some(image(rest)?),
        "map_Ke" => {
            material.emissive_image = Some(image(rest)?);
            // Otherwise it would be multiplied with nothing.
            if material.emission == [0.0; 3] {
                material.emission = [1.0; 3];
            }
        }
        "norm" => material.normal_image = Some(image(rest)?),
        _ => {}
    }
    Some(())
}

/// Three numbers of 0 to 1, or one for all three.
fn colour(rest: &str) -> Option<[f32; 3]> {
    let mut words = rest.split_whitespace();
    let first = share(words.next()?)?;
    Some(match (words.next(), words.next()) {
        (Some(second), Some(third)) => [first, share(second)?, share(third)?],
        _ => [first; 3],
    })
}

fn share(word: &str) -> Option<f32> {
    let number: f32 = word.split_whitespace().next()?.parse().ok()?;
    number.is_finite().then(|| number.clamp(0.0, 1.0))
}

/// The path of an image, which may have spaces. One with options before it cannot be told from them.
fn image(rest: &str) -> Option<String> {
    (!rest.is_empty() && !rest.starts_with('-')).then(|| rest.replace('\\', "/"))
}
