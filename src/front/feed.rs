//! What vertex inputs, and the fragment inputs of a supplied vertex stage, carry; guessed from their names.

use super::names::words;
use naga::{Scalar, ScalarKind, ShaderStage, TypeInner};

/// What an input carries. Vectors are in world space in the fragment stage, in object space in the vertex
/// stage; the model matrix lies between.
#[derive(Clone, Debug, PartialEq)]
pub enum Feed {
    /// The position: of the vertex in object space, or of the fragment in world space.
    Position,
    /// The fragment's position in object space.
    ObjectPosition,
    /// The unit normal.
    Normal,
    /// Texture coordinates.
    Uv,
    /// The second set of texture coordinates; of an object that has one set only, that one.
    SecondUv,
    /// The unit tangent along increasing u; a fourth component is the sign of the bitangent.
    Tangent,
    /// The bitangent: the normal times the tangent, with its sign; towards the top of the image.
    Bitangent,
    /// The sign of the bitangent alone.
    BitangentSign,
    /// The vertex colour, linear.
    Colour,
    /// From the fragment to the eye, of unit length at the vertices.
    ViewDirection,
    /// A column of the model matrix, 0 to 3: engines feed it per instance.
    ModelColumn(u8),
    /// The same numbers everywhere.
    Constant(Vec<f64>),
}

/// Every feed that a scene can name, with its keyword.
const KEYWORDS: &[(&str, Feed)] = &[
    ("position", Feed::Position),
    ("object-position", Feed::ObjectPosition),
    ("normal", Feed::Normal),
    ("uv", Feed::Uv),
    ("uv1", Feed::SecondUv),
    ("tangent", Feed::Tangent),
    ("bitangent", Feed::Bitangent),
    ("bitangent-sign", Feed::BitangentSign),
    ("colour", Feed::Colour),
    ("view-direction", Feed::ViewDirection),
    ("model-column-0", Feed::ModelColumn(0)),
    ("model-column-1", Feed::ModelColumn(1)),
    ("model-column-2", Feed::ModelColumn(2)),
    ("model-column-3", Feed::ModelColumn(3)),
];

/// Words that say where a value comes from, not what it is.
const EMPTY_WORDS: &[&str] = &[
    "a",
    "v",
    "i",
    "in",
    "out",
    "f",
    "vs",
    "fs",
    "frag",
    "fragment",
    "vertex",
    "vert",
    "var",
    "attr",
    "attribute",
    "varying",
    "input",
    "interpolated",
    "mesh",
    "vec",
    "the",
];

impl Feed {
    /// The feed of a keyword of a scene's `[attributes]`.
    pub fn of_keyword(keyword: &str) -> Option<Self> {
        let spelt = match keyword {
            "color" => "colour",
            "world-position" => "position",
            "world-normal" => "normal",
            other => other,
        };
        let found = KEYWORDS.iter().find(|(k, _)| *k == spelt);
        found.map(|(_, feed)| feed.clone())
    }

    /// The keywords of a stage's inputs.
    pub fn keywords(stage: ShaderStage) -> impl Iterator<Item = &'static str> {
        let of_stage = KEYWORDS.iter().filter(move |(_, f)| f.is_of(stage));
        of_stage.map(|(keyword, _)| *keyword)
    }

    /// As a scene writes it.
    pub fn to_toml(&self) -> String {
        match self {
            Self::Constant(numbers) => match numbers.as_slice() {
                [one] => format!("{one:?}"),
                several => format!("{several:?}"),
            },
            named => {
                let found = KEYWORDS.iter().find(|(_, f)| f == named);
                format!("\"{}\"", found.map_or("", |(keyword, _)| keyword))
            }
        }
    }

    /// The first keyword of a stage that fits a type, or else zeros: a line to start from.
    pub(crate) fn suggestion(ty: &TypeInner, stage: ShaderStage) -> String {
        let named = Self::keywords(stage).filter_map(Self::of_keyword);
        let fitting = named.into_iter().find(|feed| feed.fits(ty).is_ok());
        match (fitting, shape(ty)) {
            (Some(feed), Some((size, _))) if size > 1 => feed.to_toml(),
            (_, Some((1, scalar))) if scalar.kind == ScalarKind::Float => "0.0".to_owned(),
            (_, Some((1, _)) | None) => "0".to_owned(),
            (_, Some((size, _))) => format!("[{}]", vec!["0"; size].join(", ")),
        }
    }

    /// Whether a stage's inputs can carry it.
    pub fn is_of(&self, stage: ShaderStage) -> bool {
        match self {
            Self::ObjectPosition | Self::ViewDirection => stage == ShaderStage::Fragment,
            Self::ModelColumn(_) => stage == ShaderStage::Vertex,
            _ => true,
        }
    }

    /// Whether a type can hold it; otherwise what would hold it, for a message.
    ///
    /// # Errors
    /// The WGSL types that it fits.
    pub fn fits(&self, ty: &TypeInner) -> Result<(), String> {
        let (size, scalar) = shape(ty).ok_or("a scalar or a vector")?;
        let float = scalar == Scalar::F32;
        let (fit, wanted) = match self {
            Self::Position | Self::ObjectPosition => (float && size >= 2, "vec3<f32> or vec4<f32>"),
            Self::Normal | Self::Tangent | Self::Bitangent | Self::ViewDirection | Self::Colour => {
                (float && size >= 3, "vec3<f32> or vec4<f32>")
            }
            Self::Uv | Self::SecondUv => (float && size >= 2, "vec2<f32>"),
            Self::BitangentSign => (float && size == 1, "f32"),
            Self::ModelColumn(_) => (float && size >= 3, "vec4<f32>"),
            Self::Constant(numbers) => {
                let whole = matches!(scalar.kind, ScalarKind::Sint | ScalarKind::Uint);
                let lowest = if scalar.kind == ScalarKind::Uint {
                    0.0
                } else {
                    f64::MIN
                };
                let fit = numbers.len() == size
                    && scalar.width == 4
                    && numbers
                        .iter()
                        .all(|n| n.is_finite() && *n >= lowest && (!whole || n.fract() == 0.0));
                return match fit {
                    true => Ok(()),
                    false => Err(format!(
                        "{size} {} number{}",
                        if whole { "whole" } else { "finite" },
                        if size == 1 { "" } else { "s" }
                    )),
                };
            }
        };
        if fit { Ok(()) } else { Err(wanted.to_owned()) }
    }

    /// What an input of this name and type carries, when both agree on it.
    pub fn infer(name: &str, ty: &TypeInner, stage: ShaderStage) -> Option<Self> {
        let feed = Self::of_name(name, stage)?;
        feed.fits(ty).is_ok().then_some(feed)
    }

    fn of_name(name: &str, stage: ShaderStage) -> Option<Self> {
        let all = words(name);
        let column = match all.split_last() {
            Some((digit, before)) if ["0", "1", "2", "3"].contains(&digit.as_str()) => {
                let matrix = before.iter().any(|w| {
                    ["model", "instance", "world", "transform", "matrix"].contains(&w.as_str())
                });
                let other = before.iter().any(|w| {
                    [
                        "normal", "view", "position", "pos", "tangent", "uv", "color", "colour",
                    ]
                    .contains(&w.as_str())
                });
                digit.parse().ok().filter(|_| matrix && !other)
            }
            _ => None,
        };
        if let (Some(column), ShaderStage::Vertex) = (column, stage) {
            return Some(Self::ModelColumn(column));
        }
        let digit = |w: &String| w.bytes().all(|b| b.is_ascii_digit());
        let said: Vec<&str> = all
            .iter()
            .filter(|w| !EMPTY_WORDS.contains(&w.as_str()) && !digit(w))
            .map(String::as_str)
            .collect();
        let spaced: Vec<&str> = said
            .iter()
            .copied()
            .filter(|w| {
                ![
                    "world",
                    "ws",
                    "w",
                    "surface",
                    "geometric",
                    "geom",
                    "shading",
                ]
                .contains(w)
            })
            .collect();
        Some(match spaced.as_slice() {
            ["position" | "pos" | "p" | "location"] => Self::Position,
            ["local" | "object" | "model" | "os", "position" | "pos"]
            | ["position" | "pos", "local" | "object" | "model" | "os"] => {
                if stage == ShaderStage::Vertex {
                    Self::Position
                } else {
                    Self::ObjectPosition
                }
            }
            ["normal" | "normals" | "norm" | "nrm" | "nor" | "n"] => Self::Normal,
            ["local" | "object" | "model", "normal"] if stage == ShaderStage::Vertex => {
                Self::Normal
            }
            ["uv" | "uvs" | "st" | "texcoord" | "texcoords" | "coord" | "coords" | "uvw"]
            | [
                "tex" | "texture",
                "coord" | "coords" | "coordinate" | "coordinates" | "uv",
            ]
            | ["uv", "a" | "b" | "set" | "coord" | "coords"]
            | ["lightmap" | "detail" | "base", "uv" | "uvs"] => Self::Uv,
            ["tangent" | "tangents" | "tan" | "t"] => Self::Tangent,
            ["bitangent" | "binormal" | "bitan" | "b"] => Self::Bitangent,
            ["bitangent" | "binormal" | "tangent", "sign" | "handedness"]
            | ["sign" | "handedness"] => Self::BitangentSign,
            ["color" | "colour" | "col" | "rgb" | "rgba" | "albedo"] => Self::Colour,
            ["view" | "eye", "dir" | "direction" | "vector"]
            | ["to", "eye" | "camera" | "view" | "viewer"]
            | ["viewdir"]
                if stage == ShaderStage::Fragment =>
            {
                Self::ViewDirection
            }
            _ => return None,
        })
    }
}

/// How many components a scalar or a vector has, and of what.
pub(super) fn shape(ty: &TypeInner) -> Option<(usize, Scalar)> {
    match *ty {
        TypeInner::Scalar(scalar) => Some((1, scalar)),
        TypeInner::Vector { size, scalar } => Some((size as usize, scalar)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use naga::VectorSize;

    fn vector(size: usize) -> TypeInner {
        let scalar = Scalar::F32;
        match size {
            2 => TypeInner::Vector {
                size: VectorSize::Bi,
                scalar,
            },
            3 => TypeInner::Vector {
                size: VectorSize::Tri,
                scalar,
            },
            4 => TypeInner::Vector {
                size: VectorSize::Quad,
                scalar,
            },
            _ => TypeInner::Scalar(scalar),
        }
    }

    #[test]
    fn names_and_types_together_say_what_an_input_is() {
        use ShaderStage::{Fragment, Vertex};
        for (name, size, stage, expected) in [
            ("uv", 2, Fragment, Some(Feed::Uv)),
            ("in_uv0", 2, Fragment, Some(Feed::Uv)),
            ("texCoord", 2, Vertex, Some(Feed::Uv)),
            ("tex_coords", 2, Vertex, Some(Feed::Uv)),
            ("v_normal", 3, Fragment, Some(Feed::Normal)),
            ("world_normal", 3, Fragment, Some(Feed::Normal)),
            ("normalWS", 3, Fragment, Some(Feed::Normal)),
            ("worldPosition", 3, Fragment, Some(Feed::Position)),
            ("world_position", 4, Fragment, Some(Feed::Position)),
            ("fragPos", 3, Fragment, Some(Feed::Position)),
            ("a_position", 3, Vertex, Some(Feed::Position)),
            ("object_position", 3, Fragment, Some(Feed::ObjectPosition)),
            ("tangent", 4, Vertex, Some(Feed::Tangent)),
            ("binormal", 3, Vertex, Some(Feed::Bitangent)),
            ("tangent_sign", 1, Vertex, Some(Feed::BitangentSign)),
            ("vertex_color", 4, Fragment, Some(Feed::Colour)),
            ("view_dir", 3, Fragment, Some(Feed::ViewDirection)),
            ("view_dir", 3, Vertex, None),
            ("model_matrix_2", 4, Vertex, Some(Feed::ModelColumn(2))),
            ("normal_matrix_0", 3, Vertex, None),
            // The name alone is not enough, nor is the type.
            ("uv", 1, Fragment, None),
            ("normal", 2, Fragment, None),
            ("wetness", 1, Fragment, None),
            ("joint_weights", 4, Vertex, None),
            ("shadow_coord", 4, Fragment, None),
            ("", 3, Vertex, None),
        ] {
            assert_eq!(Feed::infer(name, &vector(size), stage), expected, "{name}");
        }
        let whole = TypeInner::Vector {
            size: VectorSize::Bi,
            scalar: Scalar::U32,
        };
        assert_eq!(Feed::infer("uv", &whole, Fragment), None);
    }

    #[test]
    fn keywords_read_back() {
        for (keyword, feed) in KEYWORDS {
            assert_eq!(Feed::of_keyword(keyword).as_ref(), Some(feed));
            assert_eq!(feed.to_toml(), format!("\"{keyword}\""));
        }
        assert_eq!(Feed::of_keyword("color"), Some(Feed::Colour));
        assert_eq!(Feed::of_keyword("nonsense"), None);
        assert_eq!(Feed::Constant(vec![1.0, 0.5]).to_toml(), "[1.0, 0.5]");
    }

    #[test]
    fn constants_fit_their_types_only() {
        let one = |x: f64| Feed::Constant(vec![x]);
        assert!(one(0.5).fits(&TypeInner::Scalar(Scalar::F32)).is_ok());
        assert!(one(f64::NAN).fits(&TypeInner::Scalar(Scalar::F32)).is_err());
        assert!(one(0.5).fits(&TypeInner::Scalar(Scalar::U32)).is_err());
        assert!(one(-1.0).fits(&TypeInner::Scalar(Scalar::U32)).is_err());
        assert!(one(-1.0).fits(&TypeInner::Scalar(Scalar::I32)).is_ok());
        assert!(one(1.0).fits(&vector(2)).is_err());
    }
}
