//! What a model's materials say: their textures by role, their factors by name; and which of a shader's textures
//! and uniforms those are, told from names.
//!
//! The roles are glTF's: each has a place in the material's JSON, a colour space, and what stands in its place where
//! a material has none. Factors are the numbers beside them.

use super::layout::Leaf;
use crate::eval::image::Space;
use crate::eval::texture::{Sampler, Wrap};
use crate::front::names::words;
use serde_json::Value;
use std::collections::BTreeMap;

/// What a texture of a material is for.
#[derive(Debug)]
pub(super) struct Role {
    /// How a scene names it.
    pub(super) keyword: &'static str,
    /// Where it is in a material.
    pointer: &'static str,
    /// The colour space of its image.
    pub(super) space: Space,
    /// The texel that changes nothing: where a material has no such texture.
    pub(super) neutral: [f32; 4],
    /// The factor that glTF multiplies it with.
    pub(super) factor: Option<&'static str>,
    /// What shaders call it, words joined.
    names: &'static [&'static str],
}

/// A number or a colour of a material.
#[derive(Debug, PartialEq)]
pub(super) struct Factor {
    /// How a scene names it.
    pub(super) keyword: &'static str,
    pointer: &'static str,
    /// Its value where a material does not say; its length is that of the factor.
    default: &'static [f64],
    /// What shaders call it, words joined.
    names: &'static [&'static str],
}

/// The WGSL types that can hold a factor of some length, for a message.
const HOLDERS: [&str; 4] = [
    "an f32",
    "a vec2<f32>",
    "a vec3<f32> or vec4<f32>",
    "a vec4<f32> or vec3<f32>",
];

const WHITE: [f32; 4] = [1.0; 4];
const FLAT: [f32; 4] = [0.5, 0.5, 1.0, 1.0];

/// The places of glTF's extensions are shortened: `:clearcoat` is `/extensions/KHR_materials_clearcoat`.
const ROLES: &[Role] = &[
    Role {
        keyword: "base-colour",
        pointer: "/pbrMetallicRoughness/baseColorTexture",
        space: Space::Srgb,
        neutral: WHITE,
        factor: Some("base-colour-factor"),
        names: &[
            "basecolor",
            "basecolour",
            "albedo",
            "diffuse",
            "color",
            "colour",
            "base",
        ],
    },
    Role {
        keyword: "metallic-roughness",
        pointer: "/pbrMetallicRoughness/metallicRoughnessTexture",
        space: Space::Linear,
        neutral: WHITE,
        factor: None,
        names: &[
            "metallicroughness",
            "roughnessmetallic",
            "metalnessroughness",
            "metalroughness",
            "metalrough",
            "mr",
            "orm",
            "arm",
            "occlusionroughnessmetallic",
            "occlusionroughmetal",
        ],
    },
    Role {
        keyword: "normal",
        pointer: "/normalTexture",
        space: Space::Linear,
        neutral: FLAT,
        factor: None,
        names: &["normal", "normals", "nrm", "tangentnormal"],
    },
    Role {
        keyword: "occlusion",
        pointer: "/occlusionTexture",
        space: Space::Linear,
        neutral: WHITE,
        factor: None,
        names: &["occlusion", "ao", "ambientocclusion"],
    },
    Role {
        keyword: "emissive",
        pointer: "/emissiveTexture",
        space: Space::Srgb,
        neutral: WHITE,
        factor: Some("emissive-factor"),
        names: &["emissive", "emission", "emit", "glow"],
    },
    Role {
        keyword: "clearcoat",
        pointer: ":clearcoat/clearcoatTexture",
        space: Space::Linear,
        neutral: WHITE,
        factor: Some("clearcoat-factor"),
        names: &["clearcoat", "coat"],
    },
    Role {
        keyword: "clearcoat-roughness",
        pointer: ":clearcoat/clearcoatRoughnessTexture",
        space: Space::Linear,
        neutral: WHITE,
        factor: Some("clearcoat-roughness-factor"),
        names: &["clearcoatroughness", "coatroughness"],
    },
    Role {
        keyword: "clearcoat-normal",
        pointer: ":clearcoat/clearcoatNormalTexture",
        space: Space::Linear,
        neutral: FLAT,
        factor: None,
        names: &["clearcoatnormal", "coatnormal"],
    },
    Role {
        keyword: "sheen-colour",
        pointer: ":sheen/sheenColorTexture",
        space: Space::Srgb,
        neutral: WHITE,
        factor: Some("sheen-colour-factor"),
        names: &["sheencolor", "sheencolour", "sheen"],
    },
    Role {
        keyword: "sheen-roughness",
        pointer: ":sheen/sheenRoughnessTexture",
        space: Space::Linear,
        neutral: WHITE,
        factor: Some("sheen-roughness-factor"),
        names: &["sheenroughness"],
    },
    Role {
        keyword: "transmission",
        pointer: ":transmission/transmissionTexture",
        space: Space::Linear,
        neutral: WHITE,
        factor: Some("transmission-factor"),
        names: &["transmission"],
    },
    Role {
        keyword: "thickness",
        pointer: ":volume/thicknessTexture",
        space: Space::Linear,
        neutral: WHITE,
        factor: Some("thickness-factor"),
        names: &["thickness"],
    },
    Role {
        keyword: "specular",
        pointer: ":specular/specularTexture",
        space: Space::Linear,
        neutral: WHITE,
        factor: Some("specular-factor"),
        names: &["specular", "specularstrength"],
    },
    Role {
        keyword: "specular-colour",
        pointer: ":specular/specularColorTexture",
        space: Space::Srgb,
        neutral: WHITE,
        factor: Some("specular-colour-factor"),
        names: &["specularcolor", "specularcolour", "speculartint"],
    },
    Role {
        keyword: "anisotropy",
        pointer: ":anisotropy/anisotropyTexture",
        space: Space::Linear,
        // Along the tangent, at full strength.
        neutral: [1.0, 0.5, 1.0, 1.0],
        factor: None,
        names: &["anisotropy"],
    },
    Role {
        keyword: "iridescence",
        pointer: ":iridescence/iridescenceTexture",
        space: Space::Linear,
        neutral: WHITE,
        factor: Some("iridescence-factor"),
        names: &["iridescence"],
    },
    Role {
        keyword: "iridescence-thickness",
        pointer: ":iridescence/iridescenceThicknessTexture",
        space: Space::Linear,
        neutral: WHITE,
        factor: None,
        names: &["iridescencethickness"],
    },
];

const FACTORS: &[Factor] = &[
    Factor {
        keyword: "base-colour-factor",
        pointer: "/pbrMetallicRoughness/baseColorFactor",
        default: &[1.0; 4],
        names: &[
            "basecolor",
            "basecolour",
            "albedo",
            "diffuse",
            "tint",
            "color",
            "colour",
        ],
    },
    Factor {
        keyword: "metallic-factor",
        pointer: "/pbrMetallicRoughness/metallicFactor",
        default: &[1.0],
        names: &["metallic", "metalness", "metal"],
    },
    Factor {
        keyword: "roughness-factor",
        pointer: "/pbrMetallicRoughness/roughnessFactor",
        default: &[1.0],
        names: &["roughness", "rough", "perceptualroughness"],
    },
    Factor {
        keyword: "normal-scale",
        pointer: "/normalTexture/scale",
        default: &[1.0],
        names: &[
            "normalscale",
            "normalstrength",
            "bumpscale",
            "normalintensity",
        ],
    },
    Factor {
        keyword: "occlusion-strength",
        pointer: "/occlusionTexture/strength",
        default: &[1.0],
        names: &[
            "occlusion",
            "occlusionstrength",
            "ao",
            "aostrength",
            "ambientocclusion",
            "occlusionintensity",
        ],
    },
    Factor {
        keyword: "emissive-factor",
        pointer: "/emissiveFactor",
        default: &[0.0; 3],
        names: &[
            "emissive",
            "emission",
            "emissivecolor",
            "emissivecolour",
            "emissioncolor",
            "emissioncolour",
        ],
    },
    Factor {
        keyword: "emissive-strength",
        pointer: ":emissive_strength/emissiveStrength",
        default: &[1.0],
        names: &[
            "emissivestrength",
            "emissiveintensity",
            "emissionstrength",
            "emissionintensity",
        ],
    },
    Factor {
        keyword: "alpha-cutoff",
        pointer: "/alphaCutoff",
        default: &[0.5],
        names: &["alphacutoff", "cutoff", "alphathreshold", "alphatest"],
    },
    Factor {
        keyword: "clearcoat-factor",
        pointer: ":clearcoat/clearcoatFactor",
        default: &[0.0],
        names: &["clearcoat", "clearcoatstrength", "coat"],
    },
    Factor {
        keyword: "clearcoat-roughness-factor",
        pointer: ":clearcoat/clearcoatRoughnessFactor",
        default: &[0.0],
        names: &[
            "clearcoatroughness",
            "clearcoatperceptualroughness",
            "coatroughness",
        ],
    },
    Factor {
        keyword: "clearcoat-normal-scale",
        pointer: ":clearcoat/clearcoatNormalTexture/scale",
        default: &[1.0],
        names: &["clearcoatnormalscale", "coatnormalscale"],
    },
    Factor {
        keyword: "sheen-colour-factor",
        pointer: ":sheen/sheenColorFactor",
        default: &[0.0; 3],
        names: &["sheencolor", "sheencolour", "sheen"],
    },
    Factor {
        keyword: "sheen-roughness-factor",
        pointer: ":sheen/sheenRoughnessFactor",
        default: &[0.0],
        names: &["sheenroughness"],
    },
    Factor {
        keyword: "transmission-factor",
        pointer: ":transmission/transmissionFactor",
        default: &[0.0],
        names: &["transmission", "speculartransmission"],
    },
    Factor {
        keyword: "thickness-factor",
        pointer: ":volume/thicknessFactor",
        default: &[0.0],
        names: &["thickness"],
    },
    Factor {
        keyword: "attenuation-colour",
        pointer: ":volume/attenuationColor",
        default: &[1.0; 3],
        names: &["attenuationcolor", "attenuationcolour"],
    },
    Factor {
        keyword: "ior",
        pointer: ":ior/ior",
        default: &[1.5],
        names: &["ior", "indexofrefraction", "refractiveindex"],
    },
    Factor {
        keyword: "specular-factor",
        pointer: ":specular/specularFactor",
        default: &[1.0],
        names: &["specular", "specularstrength"],
    },
    Factor {
        keyword: "specular-colour-factor",
        pointer: ":specular/specularColorFactor",
        default: &[1.0; 3],
        names: &["specularcolor", "specularcolour", "speculartint"],
    },
    Factor {
        keyword: "anisotropy-strength",
        pointer: ":anisotropy/anisotropyStrength",
        default: &[0.0],
        names: &["anisotropy", "anisotropystrength"],
    },
    Factor {
        keyword: "iridescence-factor",
        pointer: ":iridescence/iridescenceFactor",
        default: &[0.0],
        names: &["iridescence"],
    },
];

/// Words of a texture's name that do not say what it is for.
const EMPTY_TEXTURE_WORDS: &[&str] = &[
    "texture", "textures", "tex", "map", "t", "u", "g", "m", "s", "sampler", "image", "img",
    "material", "mat", "surface", "pbr", "gltf", "2", "d", "0", "the",
];

/// Words that say that a uniform is a material's: without one of them a name must say `factor`.
const MATERIAL_WORDS: &[&str] = &["material", "mat", "surface", "pbr", "gltf", "standard"];

impl Role {
    /// The role of a keyword.
    pub(super) fn of_keyword(keyword: &str) -> Option<&'static Self> {
        let british = keyword.replace("color", "colour");
        ROLES.iter().find(|role| role.keyword == british)
    }

    /// Every keyword.
    pub(super) fn keywords() -> impl Iterator<Item = &'static str> {
        ROLES.iter().map(|role| role.keyword)
    }

    /// The role that a texture's name says.
    pub(super) fn infer(name: &str) -> Option<&'static Self> {
        let said = joined(name, EMPTY_TEXTURE_WORDS);
        ROLES
            .iter()
            .find(|role| role.names.contains(&said.as_str()))
    }

    /// Whether a texture holds the normals of the surface, by the role that a scene says or else by its name, which may
    /// say whose normals: `detail_normal`.
    pub(super) fn is_normals(said: Option<&Self>, name: &str) -> bool {
        match said.or_else(|| Self::infer(name)) {
            Some(role) => role.keyword == "normal",
            None => words(name)
                .iter()
                .any(|word| ["normal", "normals", "nrm"].contains(&word.as_str())),
        }
    }
}

impl Factor {
    /// The factor of a keyword.
    pub(super) fn of_keyword(keyword: &str) -> Option<&'static Self> {
        let british = keyword.replace("color", "colour");
        FACTORS.iter().find(|factor| factor.keyword == british)
    }

    /// Every keyword.
    pub(super) fn keywords() -> impl Iterator<Item = &'static str> {
        FACTORS.iter().map(|factor| factor.keyword)
    }

    /// Whether a part of a buffer can hold it: a colour may lack its alpha, or have one more.
    pub(super) fn fits(&self, leaf: &Leaf) -> bool {
        let rows = match self.default.len() {
            1 => leaf.rows == 1,
            _ => leaf.rows >= 3,
        };
        leaf.is_float() && leaf.columns == 1 && rows
    }

    /// The WGSL types that can hold it, for a message.
    pub(super) fn wants(&self) -> &'static str {
        HOLDERS[(self.default.len() - 1).min(3)]
    }

    /// The factor that a part of a buffer is, when name and type agree on it.
    pub(super) fn infer(leaf: &Leaf) -> Option<&'static Self> {
        if leaf.path.contains('[') {
            return None;
        }
        let all = words(&leaf.path);
        let of_material = all.iter().any(|w| MATERIAL_WORDS.contains(&w.as_str()));
        if !of_material && !all.iter().any(|w| w == "factor") {
            return None;
        }
        let name = leaf.path.rsplit('.').next().unwrap_or_default();
        let empty = [MATERIAL_WORDS, &["factor", "u", "the", "uniform"]].concat();
        let said = joined(name, &empty);
        let mut named = FACTORS.iter();
        named.find(|factor| factor.names.contains(&said.as_str()) && factor.fits(leaf))
    }
}

/// The words of a name but the empty ones, in one.
fn joined(name: &str, empty: &[&str]) -> String {
    let said = words(name);
    let said = said.iter().filter(|word| !empty.contains(&word.as_str()));
    said.map(String::as_str).collect()
}

/// A texture of a material.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Map {
    /// Which of the model's images.
    pub(super) image: usize,
    /// How it is read.
    pub(super) sampler: Sampler,
    /// Which set of texture coordinates it is read with, and how those are changed before.
    pub(super) place: UvPlace,
}

/// A set of texture coordinates, scaled, turned and moved (KHR_texture_transform).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct UvPlace {
    pub(super) set: u32,
    pub(super) offset: [f64; 2],
    /// Radians.
    pub(super) rotation: f64,
    pub(super) scale: [f64; 2],
}

impl Default for UvPlace {
    fn default() -> Self {
        Self {
            set: 0,
            offset: [0.0; 2],
            rotation: 0.0,
            scale: [1.0; 2],
        }
    }
}

impl UvPlace {
    /// The coordinates that an image is read with.
    pub(super) fn apply(&self, [u, v]: [f32; 2]) -> [f32; 2] {
        let (u, v) = (f64::from(u) * self.scale[0], f64::from(v) * self.scale[1]);
        let (sin, cos) = (libm::sin(self.rotation), libm::cos(self.rotation));
        [
            (u * cos + v * sin + self.offset[0]) as f32,
            (v * cos - u * sin + self.offset[1]) as f32,
        ]
    }
}

/// A material of a model: of each of its draws.
#[derive(Clone, Debug, Default)]
pub(super) struct Material {
    /// Its name, or its place among the model's.
    pub(super) name: String,
    /// Its textures by the keywords of their roles.
    pub(super) maps: BTreeMap<&'static str, Map>,
    json: Value,
}

impl Material {
    /// Reads a material. `textures` and `samplers` are the model's.
    pub(super) fn read(name: String, json: &Value, textures: &[Value], samplers: &[Value]) -> Self {
        let mut maps = BTreeMap::new();
        for role in ROLES {
            let info = json.pointer(&full(role.pointer));
            if let Some(map) = info.and_then(|info| read_map(info, textures, samplers)) {
                maps.insert(role.keyword, map);
            }
        }
        Self {
            name,
            maps,
            json: json.clone(),
        }
    }

    /// A factor's numbers; those that are no finite numbers are as if they were not said.
    pub(super) fn factor(&self, factor: &Factor) -> Vec<f64> {
        if factor.keyword == "alpha-cutoff" && !self.cuts() {
            // Nothing is cut out of what is opaque.
            return vec![0.0];
        }
        let said = self.json.pointer(&full(factor.pointer));
        let number = |value: &Value| value.as_f64().filter(|x| (*x as f32).is_finite());
        let numbers: Option<Vec<f64>> = match said {
            Some(Value::Array(all)) => all.iter().map(number).collect(),
            Some(one) => number(one).map(|one| vec![one]),
            None => None,
        };
        numbers
            .filter(|numbers| numbers.len() == factor.default.len())
            .unwrap_or_else(|| factor.default.to_vec())
    }

    /// The same for a part of a buffer that it fits: an alpha that the factor lacks is 1.
    pub(super) fn numbers(&self, factor: &Factor, leaf: &Leaf) -> Vec<f64> {
        let mut numbers = self.factor(factor);
        numbers.resize(leaf.rows, 1.0);
        numbers
    }

    fn mode(&self) -> Option<&str> {
        self.json.get("alphaMode")?.as_str()
    }

    /// Whether it is cut out where alpha is low.
    fn cuts(&self) -> bool {
        self.mode() == Some("MASK")
    }

    /// Whether it is blended with what is behind.
    pub(super) fn blends(&self) -> bool {
        self.mode() == Some("BLEND")
    }

    /// Whether its back faces are drawn.
    pub(super) fn double_sided(&self) -> bool {
        self.json.get("doubleSided") == Some(&Value::Bool(true))
    }

    /// Where the coordinates of its textures come from: the first of the roles that it has.
    pub(super) fn place(&self) -> UvPlace {
        let mut roles = ROLES.iter();
        let first = roles.find_map(|role| self.maps.get(role.keyword));
        first.map_or_else(UvPlace::default, |map| map.place)
    }

    /// The roles whose textures are read with other coordinates.
    pub(super) fn elsewhere(&self) -> Vec<&'static str> {
        let place = self.place();
        let others = self.maps.iter().filter(|(_, map)| map.place != place);
        others.map(|(role, _)| *role).collect()
    }
}

/// A pointer with the extension that it may begin with written out.
fn full(pointer: &str) -> String {
    match pointer.strip_prefix(':') {
        Some(extension) => format!("/extensions/KHR_materials_{extension}"),
        None => pointer.to_owned(),
    }
}

fn read_map(info: &Value, textures: &[Value], samplers: &[Value]) -> Option<Map> {
    let index = |value: &Value, key: &str| usize::try_from(value.get(key)?.as_u64()?).ok();
    let texture = textures.get(index(info, "index")?)?;
    let image = match index(texture, "source") {
        Some(image) => image,
        // Images in other formats stand in extensions: reading one says which format it is.
        None => {
            let extensions = texture.get("extensions")?.as_object()?;
            extensions.values().find_map(|e| index(e, "source"))?
        }
    };
    let said = index(texture, "sampler").and_then(|i| samplers.get(i));
    Some(Map {
        image,
        sampler: said.map_or_else(Sampler::default, read_sampler),
        place: uv_place(info.as_object()?),
    })
}

/// How a texture of a material is read: `info` is what names it.
pub(super) fn uv_place(info: &serde_json::Map<String, Value>) -> UvPlace {
    let index = |value: Option<&Value>| u32::try_from(value?.as_u64()?).ok();
    let mut place = UvPlace {
        set: index(info.get("texCoord")).unwrap_or(0),
        ..UvPlace::default()
    };
    let extensions = info.get("extensions");
    if let Some(transform) = extensions.and_then(|all| all.get("KHR_texture_transform")) {
        let pair = |key: &str, other: [f64; 2]| {
            let pair = transform.get(key).and_then(Value::as_array);
            let pair = pair.and_then(|p| Some([p.first()?.as_f64()?, p.get(1)?.as_f64()?]));
            pair.unwrap_or(other)
        };
        place.offset = pair("offset", [0.0; 2]);
        place.scale = pair("scale", [1.0; 2]);
        place.rotation = transform
            .get("rotation")
            .and_then(Value::as_f64)
            .unwrap_or(0.0);
        place.set = index(transform.get("texCoord")).unwrap_or(place.set);
    }
    place
}

/// A glTF sampler; what it leaves out repeats and is filtered.
fn read_sampler(json: &Value) -> Sampler {
    let code = |key: &str| json.get(key).and_then(Value::as_u64);
    let wrap = |key: &str| match code(key) {
        Some(33_071) => Wrap::ClampToEdge,
        Some(33_648) => Wrap::MirrorRepeat,
        _ => Wrap::Repeat,
    };
    let minification = code("minFilter");
    Sampler {
        wrap: [wrap("wrapS"), wrap("wrapT"), Wrap::Repeat],
        linear_magnification: code("magFilter") != Some(9728),
        // NEAREST, NEAREST_MIPMAP_NEAREST, NEAREST_MIPMAP_LINEAR.
        linear_minification: !matches!(minification, Some(9728 | 9984 | 9986)),
        // Without levels in the file's sense lodc still filters between those that it makes.
        linear_mip: !matches!(minification, Some(9984 | 9985)),
        ..Sampler::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use naga::ScalarKind;
    use serde_json::json;

    fn leaf(path: &str, rows: usize) -> Leaf {
        Leaf {
            path: path.to_owned(),
            offset: 0,
            columns: 1,
            rows,
            stride: 16,
            kind: ScalarKind::Float,
            width: 4,
        }
    }

    #[test]
    fn names_say_the_roles_of_textures() {
        for (name, role) in [
            ("base_color_texture", Some("base-colour")),
            ("albedo", Some("base-colour")),
            ("t_diffuse", Some("base-colour")),
            ("materialBaseColorMap", Some("base-colour")),
            ("metallic_roughness_texture", Some("metallic-roughness")),
            ("orm_map", Some("metallic-roughness")),
            ("normalTex", Some("normal")),
            ("normal_map_texture", Some("normal")),
            ("ao_texture", Some("occlusion")),
            ("emissive", Some("emissive")),
            ("clearcoat_normal_texture", Some("clearcoat-normal")),
            ("sheen_color_texture", Some("sheen-colour")),
            ("detail_normal", None),
            ("shadow_map", None),
            ("roughness_texture", None),
            ("texture", None),
        ] {
            assert_eq!(Role::infer(name).map(|r| r.keyword), role, "{name}");
        }
    }

    #[test]
    fn a_scene_or_a_name_says_what_holds_normals() {
        for (said, name, holds) in [
            (None, "normal_texture", true),
            (None, "detailNormal", true),
            (None, "rock_normal_map", true),
            (None, "clearcoat_normal_texture", false),
            (None, "abnormality", false),
            (None, "bumps", false),
            (Some("normal"), "bumps", true),
            (Some("occlusion"), "detail_normal", false),
        ] {
            let role = said.and_then(Role::of_keyword);
            assert_eq!(Role::is_normals(role, name), holds, "{said:?} {name}");
        }
    }

    #[test]
    fn names_and_types_say_the_factors() {
        for (path, rows, factor) in [
            ("material.base_color_factor", 4, Some("base-colour-factor")),
            ("material.baseColor", 3, Some("base-colour-factor")),
            ("material.tint", 4, Some("base-colour-factor")),
            ("material.base_color", 1, None),
            ("roughness_factor", 1, Some("roughness-factor")),
            ("material.roughness", 1, Some("roughness-factor")),
            ("u.roughness", 1, None),
            ("light.color", 3, None),
            ("material.occlusion", 1, Some("occlusion-strength")),
            ("material.emissive", 3, Some("emissive-factor")),
            ("material.emissive", 4, Some("emissive-factor")),
            ("material.alpha_cutoff", 1, Some("alpha-cutoff")),
            ("material.clearcoat", 1, Some("clearcoat-factor")),
            ("materials[2].roughness", 1, None),
        ] {
            let found = Factor::infer(&leaf(path, rows)).map(|f| f.keyword);
            assert_eq!(found, factor, "{path}");
        }
    }

    #[test]
    fn keywords_are_found_and_differ() {
        for role in ROLES {
            assert_eq!(
                Role::of_keyword(role.keyword).unwrap().pointer,
                role.pointer
            );
            assert!(role.factor.is_none_or(|f| Factor::of_keyword(f).is_some()));
        }
        for factor in FACTORS {
            let found = Factor::of_keyword(factor.keyword).unwrap();
            assert_eq!(found.pointer, factor.pointer);
        }
        assert_eq!(
            Role::of_keyword("base-color").map(|r| r.keyword),
            Some("base-colour")
        );
    }

    #[test]
    fn a_material_is_read_with_its_defaults() {
        let json = json!({
            "pbrMetallicRoughness": {
                "baseColorFactor": [0.1, 0.2, 0.3, 0.4],
                "baseColorTexture": { "index": 1, "texCoord": 1, "extensions": {
                    "KHR_texture_transform": { "scale": [2, 3], "offset": [0.5, 0.25] } } },
                "roughnessFactor": 0.25,
            },
            "normalTexture": { "index": 0, "scale": 0.5 },
            "occlusionTexture": { "index": 9 },
            "emissiveFactor": [1, "bright", 0],
            "alphaCutoff": 0.75,
            "extensions": { "KHR_materials_clearcoat": { "clearcoatFactor": 0.5 } },
        });
        let textures = [json!({ "source": 4 }), json!({ "source": 2, "sampler": 0 })];
        let samplers = [json!({ "wrapS": 33071, "magFilter": 9728, "minFilter": 9984 })];
        let material = Material::read("m".to_owned(), &json, &textures, &samplers);
        let factor = |keyword: &str| material.factor(Factor::of_keyword(keyword).unwrap());
        assert_eq!(factor("base-colour-factor"), [0.1, 0.2, 0.3, 0.4]);
        assert_eq!(factor("roughness-factor"), [0.25]);
        assert_eq!(factor("metallic-factor"), [1.0]);
        assert_eq!(factor("normal-scale"), [0.5]);
        assert_eq!(factor("emissive-factor"), [0.0; 3]);
        assert_eq!(factor("clearcoat-factor"), [0.5]);
        assert_eq!(factor("alpha-cutoff"), [0.0]);
        let base = Factor::of_keyword("base-colour-factor").unwrap();
        assert_eq!(material.numbers(base, &leaf("m.c", 3)), [0.1, 0.2, 0.3]);
        let glow = Factor::of_keyword("emissive-factor").unwrap();
        assert_eq!(
            material.numbers(glow, &leaf("m.e", 4)),
            [0.0, 0.0, 0.0, 1.0]
        );
        // A texture that is not there is none.
        let roles: Vec<_> = material.maps.keys().copied().collect();
        assert_eq!(roles, ["base-colour", "normal"]);
        let base = &material.maps["base-colour"];
        assert_eq!((base.image, base.place.set), (2, 1));
        assert_eq!(base.sampler.wrap[..2], [Wrap::ClampToEdge, Wrap::Repeat]);
        assert!(!base.sampler.linear_magnification && !base.sampler.linear_mip);
        assert_eq!(material.place().apply([0.25, 0.5]), [1.0, 1.75]);
        assert_eq!(material.elsewhere(), ["normal"]);
        let turned = UvPlace {
            rotation: std::f64::consts::FRAC_PI_2,
            ..UvPlace::default()
        };
        let [u, v] = turned.apply([1.0, 0.0]);
        assert!(u.abs() < 1e-6 && (v + 1.0).abs() < 1e-6, "{u} {v}");
    }
}
