//! What a uniform means to the scene: matrices, the eye, lights, time; guessed from names and types.

use super::buffers::Draw;
use super::camera::{Pose, Sphere, TURN, within};
use super::chance::{child, unit};
use super::layout::Leaf;
use crate::front::names::words;
use glam::{DMat3, DMat4, DVec3};
use naga::ScalarKind;

/// A value that the scene computes for every picture. None of them may be folded: a host changes them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Semantic {
    /// World to view.
    View,
    /// View to clip.
    Projection,
    /// World to clip.
    ViewProjection,
    /// Object to world.
    Model,
    /// Object to view.
    ModelView,
    /// Object to clip.
    ModelViewProjection,
    /// Normals from object to world.
    NormalMatrix,
    /// View to world.
    InverseView,
    /// Clip to view.
    InverseProjection,
    /// Clip to world.
    InverseViewProjection,
    /// World to object.
    InverseModel,
    /// The eye in world space.
    CameraPosition,
    /// From the surface towards a light far away: a unit vector in world space. Several are sampled.
    LightDirection,
    /// A light in world space, four radii of the object away. Several are sampled.
    LightPosition,
    /// White.
    LightColour,
    /// Seconds. Several are sampled.
    Time,
    /// Width and height of the picture in pixels.
    Resolution,
}

/// What a leaf must be to hold a semantic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shape {
    Matrix,
    NormalMatrix,
    Vector,
    Seconds,
    Size,
}

const KEYWORDS: &[(&str, Semantic)] = &[
    ("view", Semantic::View),
    ("projection", Semantic::Projection),
    ("view-projection", Semantic::ViewProjection),
    ("model", Semantic::Model),
    ("model-view", Semantic::ModelView),
    ("model-view-projection", Semantic::ModelViewProjection),
    ("normal-matrix", Semantic::NormalMatrix),
    ("inverse-view", Semantic::InverseView),
    ("inverse-projection", Semantic::InverseProjection),
    ("inverse-view-projection", Semantic::InverseViewProjection),
    ("inverse-model", Semantic::InverseModel),
    ("camera-position", Semantic::CameraPosition),
    ("light-direction", Semantic::LightDirection),
    ("light-position", Semantic::LightPosition),
    ("light-colour", Semantic::LightColour),
    ("time", Semantic::Time),
    ("resolution", Semantic::Resolution),
];

/// Directions towards the light: high and to the side, low and opposite, behind.
const LIGHTS: [[f64; 3]; 3] = [[0.5, 0.8, 0.6], [-0.8, 0.3, 0.5], [0.3, 0.5, -0.8]];

/// Seconds; no round numbers, so that a period does not hide.
const TIMES: [f64; 3] = [0.0, 1.7, 12.3];

impl Semantic {
    /// The semantic of a keyword of a scene's `[uniforms]`.
    pub fn of_keyword(keyword: &str) -> Option<Self> {
        let spelt = if keyword == "light-color" {
            "light-colour"
        } else {
            keyword
        };
        KEYWORDS.iter().find(|(k, _)| *k == spelt).map(|(_, s)| *s)
    }

    /// Its keyword.
    pub fn keyword(self) -> &'static str {
        let found = KEYWORDS.iter().find(|(_, s)| *s == self);
        found.map_or("", |(keyword, _)| keyword)
    }

    /// Every keyword.
    pub fn keywords() -> impl Iterator<Item = &'static str> {
        KEYWORDS.iter().map(|(keyword, _)| *keyword)
    }

    /// What it is, for a person who reads a scene.
    pub(super) fn says(self) -> &'static str {
        match self {
            Self::View => "world to view",
            Self::Projection => "view to clip",
            Self::ViewProjection => "world to clip",
            Self::Model => "object to world",
            Self::ModelView => "object to view",
            Self::ModelViewProjection => "object to clip",
            Self::NormalMatrix => "normals from object to world",
            Self::InverseView => "view to world",
            Self::InverseProjection => "clip to view",
            Self::InverseViewProjection => "clip to world",
            Self::InverseModel => "world to object",
            Self::CameraPosition => "the eye in world space",
            Self::LightDirection => "towards a light far away, in three directions",
            Self::LightPosition => "a light four radii away, in three directions",
            Self::LightColour => "white",
            Self::Time => "seconds, at three times",
            Self::Resolution => "the picture's size in pixels",
        }
    }

    fn shape(self) -> Shape {
        match self {
            Self::NormalMatrix => Shape::NormalMatrix,
            Self::CameraPosition
            | Self::LightDirection
            | Self::LightPosition
            | Self::LightColour => Shape::Vector,
            Self::Time => Shape::Seconds,
            Self::Resolution => Shape::Size,
            _ => Shape::Matrix,
        }
    }

    /// The WGSL types that can hold it, for a message.
    pub(super) fn wants(self) -> &'static str {
        match self.shape() {
            Shape::Matrix => "a mat4x4<f32>",
            Shape::NormalMatrix => "a mat3x3<f32> or mat4x4<f32>",
            Shape::Vector => "a vec3<f32> or vec4<f32>",
            Shape::Seconds => "an f32",
            Shape::Size => "a vec2<f32>, vec2<u32> or vec3<f32>",
        }
    }

    /// Whether a leaf can hold it.
    pub(super) fn fits(self, leaf: &Leaf) -> bool {
        let float = leaf.is_float();
        match (self.shape(), leaf.columns, leaf.rows) {
            (Shape::Matrix, 4, 4) | (Shape::NormalMatrix, 3, 3) | (Shape::NormalMatrix, 4, 4) => {
                float
            }
            (Shape::Vector, 1, 3 | 4) | (Shape::Seconds, 1, 1) | (Shape::Size, 1, 3) => float,
            (Shape::Size, 1, 2) => leaf.width == 4 && leaf.kind != ScalarKind::Bool,
            _ => false,
        }
    }

    /// How many samples of it a scene has.
    pub(super) fn samples(self) -> usize {
        match self {
            Self::LightDirection | Self::LightPosition => LIGHTS.len(),
            Self::Time => TIMES.len(),
            _ => 1,
        }
    }

    /// Its numbers in a pose, for a leaf that it fits, column by column.
    pub(super) fn numbers(self, leaf: &Leaf, pose: &Pose, sphere: &Sphere, draw: Draw) -> Vec<f64> {
        let matrix = |m: DMat4| m.to_cols_array().to_vec();
        let four = |v: DVec3, w: f64| v.extend(w).to_array()[..leaf.rows].to_vec();
        let light = || {
            let listed = draw.one_of(&LIGHTS).copied().unwrap_or(LIGHTS[0]);
            let direction = DVec3::from_array(listed).normalize();
            match draw {
                Draw::Listed(_) => direction,
                Draw::Chance(seed) => within(direction, TURN, child(seed, 0)),
            }
        };
        let seconds = || match draw {
            Draw::Listed(_) => draw.one_of(&TIMES).copied().unwrap_or(0.0),
            Draw::Chance(seed) => unit(child(seed, 1)) * TIMES[TIMES.len() - 1],
        };
        let inverse = |m: DMat4| match m.determinant() {
            // A model that flattens has no inverse.
            0.0 => DMat4::IDENTITY,
            _ => m.inverse(),
        };
        match self {
            Self::View => matrix(pose.view),
            Self::Projection => matrix(pose.projection),
            Self::ViewProjection => matrix(pose.view_projection()),
            Self::Model => matrix(pose.model),
            Self::ModelView => matrix(pose.view * pose.model),
            Self::ModelViewProjection => matrix(pose.view_projection() * pose.model),
            Self::InverseView => matrix(inverse(pose.view)),
            Self::InverseProjection => matrix(inverse(pose.projection)),
            Self::InverseViewProjection => matrix(inverse(pose.view_projection())),
            Self::InverseModel => matrix(inverse(pose.model)),
            Self::NormalMatrix => {
                let normal: DMat3 = pose.normal_matrix();
                match leaf.columns {
                    3 => normal.to_cols_array().to_vec(),
                    _ => matrix(DMat4::from_mat3(normal)),
                }
            }
            Self::CameraPosition => four(pose.eye, 1.0),
            Self::LightDirection => four(light(), 0.0),
            Self::LightPosition => four(sphere.centre + light() * (4.0 * sphere.radius), 1.0),
            Self::LightColour => vec![1.0; leaf.rows],
            Self::Time => vec![seconds()],
            Self::Resolution => {
                let [width, height] = pose.resolution.map(f64::from);
                vec![width, height, 1.0][..leaf.rows].to_vec()
            }
        }
    }

    /// What a leaf means, when its name and its type agree on it. Elements of arrays mean nothing by
    /// themselves: which light of several is the one?
    pub(super) fn infer(leaf: &Leaf) -> Option<Self> {
        if leaf.path.contains('[') {
            return None;
        }
        let semantic = Self::of_path(&leaf.path, leaf)?;
        semantic.fits(leaf).then_some(semantic)
    }

    fn of_path(path: &str, leaf: &Leaf) -> Option<Self> {
        let (before, name) = path.rsplit_once('.').unwrap_or(("", path));
        let mut context = words(before);
        let mut said: Vec<String> = words(name)
            .into_iter()
            .filter(|word| !EMPTY_WORDS.contains(&word.as_str()))
            .collect();
        // What a name begins with says whose value it is: `camera_view_proj`, `sun_direction`.
        while said.len() > 1 && OWNERS.contains(&said[0].as_str()) {
            context.push(said.remove(0));
        }
        let said: Vec<&str> = said.iter().map(String::as_str).collect();
        let of = |owners: &[&str]| context.iter().any(|w| owners.contains(&w.as_str()));
        let (camera, light) = (of(CAMERAS), of(LIGHT_WORDS));
        if leaf.columns > 1 {
            // A light's matrices are for shadows, and those of the last frame for motion.
            if light || of(&["shadow", "shadows", "cascade", "previous", "prev", "last"]) {
                return None;
            }
            return Self::of_matrix(&said, leaf.columns);
        }
        Some(match said.as_slice() {
            [
                "eye" | "camera" | "cam" | "viewer" | "eyepos" | "campos" | "viewpos" | "camerapos",
            ] if leaf.rows > 2 => Self::CameraPosition,
            [
                "eye" | "camera" | "cam" | "view" | "viewer",
                "position" | "pos" | "location" | "origin",
            ] => Self::CameraPosition,
            ["world", "position" | "pos"] | ["position" | "pos" | "location" | "origin", ..]
                if camera && !light && said.len() <= 2 =>
            {
                Self::CameraPosition
            }
            ["position" | "pos" | "location"] | ["world", "position" | "pos"] if light => {
                Self::LightPosition
            }
            ["direction" | "dir" | "vector" | "vec"] | ["world", "direction" | "dir"] if light => {
                Self::LightDirection
            }
            ["sundir" | "lightdir" | "lightdirection" | "sundirection"] => Self::LightDirection,
            ["to", "light" | "sun"] => Self::LightDirection,
            ["lightpos" | "lightposition"] => Self::LightPosition,
            ["color" | "colour" | "col" | "rgb"] if light => Self::LightColour,
            ["lightcolor" | "lightcolour" | "suncolor" | "suncolour"] => Self::LightColour,
            ["time" | "seconds" | "elapsed"]
            | ["elapsed" | "total" | "game", "time" | "seconds"]
            | ["time", "seconds" | "elapsed"] => Self::Time,
            ["resolution" | "viewport"]
            | [
                "screen" | "viewport" | "window" | "render" | "target",
                "size" | "resolution" | "dimensions" | "dim",
            ] => Self::Resolution,
            _ => return None,
        })
    }

    fn of_matrix(said: &[&str], columns: usize) -> Option<Self> {
        if columns == 3 {
            return matches!(
                said,
                ["normal" | "normals" | "nrm"]
                    | ["model" | "world" | "object"]
                    | ["inverse" | "inv", "transpose", ..]
                    | ["model" | "world", "inverse" | "inv", "transpose"]
                    | ["normal", "world" | "model"]
                    | ["model" | "world", "normal"]
            )
            .then_some(Self::NormalMatrix);
        }
        Some(match said {
            ["view", "proj" | "projection"]
            | ["proj" | "projection", "view"]
            | ["vp" | "viewproj" | "viewprojection" | "projview"]
            | ["clip", "from", "world"]
            | ["world", "to", "clip"] => Self::ViewProjection,
            [
                "mvp"
                | "wvp"
                | "modelviewproj"
                | "modelviewprojection"
                | "worldviewproj"
                | "worldviewprojection",
            ]
            | ["model" | "world", "view", "proj" | "projection"]
            | ["clip", "from", "local" | "object" | "model"]
            | ["local" | "object" | "model", "to", "clip"] => Self::ModelViewProjection,
            ["model" | "world" | "object" | "local" | "transform" | "transformation"]
            | ["world", "from", "local" | "object" | "model"]
            | ["local" | "object" | "model", "to", "world"] => Self::Model,
            ["mv" | "modelview" | "worldview"]
            | ["model" | "world", "view"]
            | ["view", "from", "local" | "object" | "model"] => Self::ModelView,
            ["view" | "lookat"]
            | ["look", "at"]
            | ["view" | "camera", "from", "world"]
            | ["world", "to", "view" | "camera"] => Self::View,
            ["proj" | "projection" | "perspective"]
            | ["clip", "from", "view"]
            | ["view", "to", "clip"] => Self::Projection,
            ["normal" | "normals" | "nrm"]
            | ["inverse" | "inv", "transpose", ..]
            | ["model" | "world", "inverse" | "inv", "transpose"] => Self::NormalMatrix,
            ["inverse" | "inv", "view"]
            | ["view", "inverse" | "inv"]
            | ["world", "from", "view" | "camera"]
            | ["view" | "camera", "to", "world"]
            | ["invview"] => Self::InverseView,
            ["inverse" | "inv", "proj" | "projection"]
            | ["proj" | "projection", "inverse" | "inv"]
            | ["view", "from", "clip"]
            | ["invproj"] => Self::InverseProjection,
            ["inverse" | "inv", "view", "proj" | "projection"]
            | ["view", "proj" | "projection", "inverse" | "inv"]
            | ["world", "from", "clip"]
            | ["inverse" | "inv", "vp" | "viewproj"] => Self::InverseViewProjection,
            ["inverse" | "inv", "model" | "world"]
            | ["model" | "world", "inverse" | "inv"]
            | ["local" | "object" | "model", "from", "world"]
            | ["world", "to", "local" | "object" | "model"] => Self::InverseModel,
            _ => return None,
        })
    }
}

/// Words that say nothing about what a value is.
const EMPTY_WORDS: &[&str] = &[
    "u", "i", "g", "m", "the", "uniform", "uniforms", "matrix", "mat", "mtx", "4", "3", "x",
    "mat4", "ws",
];

/// Words that say whose value it is, when others follow.
const OWNERS: &[&str] = &[
    "camera",
    "cam",
    "scene",
    "frame",
    "mesh",
    "instance",
    "node",
    "entity",
    "main",
    "global",
    "light",
    "sun",
    "lamp",
    "moon",
    "key",
    "directional",
    "sunlight",
    "point",
];

const CAMERAS: &[&str] = &["camera", "cam", "eye", "view", "viewer"];

const LIGHT_WORDS: &[&str] = &[
    "light",
    "sun",
    "lamp",
    "moon",
    "sunlight",
    "dirlight",
    "directional",
];

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec4;

    fn leaf(path: &str, ty: &str) -> Leaf {
        let (columns, rows, kind) = match ty {
            "f" => (1, 1, ScalarKind::Float),
            "2u" => (1, 2, ScalarKind::Uint),
            "44" => (4, 4, ScalarKind::Float),
            "33" => (3, 3, ScalarKind::Float),
            n => (1, n.parse().unwrap(), ScalarKind::Float),
        };
        Leaf {
            path: path.to_owned(),
            offset: 0,
            columns,
            rows,
            stride: 16,
            kind,
            width: 4,
        }
    }

    #[test]
    fn names_and_types_together_say_what_a_uniform_is() {
        use Semantic::*;
        for (path, ty, expected) in [
            ("camera.view_proj", "44", Some(ViewProjection)),
            ("u.viewProj", "44", Some(ViewProjection)),
            (
                "uniforms.modelViewProjectionMatrix",
                "44",
                Some(ModelViewProjection),
            ),
            ("mvp", "44", Some(ModelViewProjection)),
            ("u_mvp", "44", Some(ModelViewProjection)),
            ("model", "44", Some(Model)),
            ("object.model", "44", Some(Model)),
            ("model.matrix", "44", None),
            ("mesh.world_from_local", "44", Some(Model)),
            ("view.clip_from_world", "44", Some(ViewProjection)),
            ("view.world_position", "3", Some(CameraPosition)),
            ("object.normal_matrix", "33", Some(NormalMatrix)),
            ("object.normal_matrix", "44", Some(NormalMatrix)),
            ("camera.view", "44", Some(View)),
            ("camera.proj", "44", Some(Projection)),
            ("projectionMatrix", "44", Some(Projection)),
            ("inv_view", "44", Some(InverseView)),
            ("inverse_view_proj", "44", Some(InverseViewProjection)),
            ("camera.position", "3", Some(CameraPosition)),
            ("camera.position", "4", Some(CameraPosition)),
            ("camera_position", "3", Some(CameraPosition)),
            ("frame.camera_position", "3", Some(CameraPosition)),
            ("scene.eye", "3", Some(CameraPosition)),
            ("eyePos", "3", Some(CameraPosition)),
            ("viewPos", "3", Some(CameraPosition)),
            ("cameraPos", "3", Some(CameraPosition)),
            ("sun.direction", "3", Some(LightDirection)),
            ("light.dir", "3", Some(LightDirection)),
            ("lightDir", "3", Some(LightDirection)),
            ("scene.sun_direction", "3", Some(LightDirection)),
            ("directional_light.direction", "4", Some(LightDirection)),
            ("lamp.position", "3", Some(LightPosition)),
            ("lightPos", "3", Some(LightPosition)),
            ("light_color", "3", Some(LightColour)),
            ("frame.light_colour", "3", Some(LightColour)),
            ("sun.colour", "4", Some(LightColour)),
            ("globals.time", "f", Some(Time)),
            ("iTime", "f", Some(Time)),
            ("u_time", "f", Some(Time)),
            ("resolution", "2", Some(Resolution)),
            ("iResolution", "3", Some(Resolution)),
            ("screen_size", "2u", Some(Resolution)),
            // The name alone is not enough.
            ("camera.view_proj", "4", None),
            ("time", "2", None),
            ("eye", "f", None),
            ("model", "f", None),
            ("light.direction", "2", None),
            // Nor is half a name.
            ("material.roughness", "f", None),
            ("material.colour", "3", None),
            ("frame.sky_colour", "3", None),
            ("delta_time", "f", None),
            ("light.intensity", "f", None),
            ("wind.direction", "3", None),
            ("object.position", "3", None),
            ("light", "3", None),
            ("lights[0].direction", "3", None),
            ("previous_view_proj", "44", None),
            ("shadow.view_proj", "44", None),
            ("light_view_proj", "44", None),
        ] {
            assert_eq!(Semantic::infer(&leaf(path, ty)), expected, "{path}: {ty}");
        }
    }

    #[test]
    fn keywords_read_back() {
        for (keyword, semantic) in KEYWORDS {
            assert_eq!(Semantic::of_keyword(keyword), Some(*semantic));
            assert_eq!(semantic.keyword(), *keyword);
        }
        assert_eq!(
            Semantic::of_keyword("light-color"),
            Some(Semantic::LightColour)
        );
    }

    #[test]
    fn values_belong_together() {
        let sphere = Sphere {
            centre: DVec3::new(1.0, 0.0, 0.0),
            radius: 2.0,
        };
        let model = DMat4::from_scale(DVec3::new(1.0, 2.0, 1.0));
        let pose = Pose::new(model, sphere, DVec3::Z, 6.0, 45.0, [64, 32]);
        let of = |semantic: Semantic, ty: &str, sample| {
            let leaf = leaf("x", ty);
            assert!(semantic.fits(&leaf));
            let numbers = semantic.numbers(&leaf, &pose, &sphere, Draw::Listed(sample));
            assert_eq!(numbers.len(), leaf.len());
            numbers
        };
        let matrix = |semantic| DMat4::from_cols_slice(&of(semantic, "44", 0));
        let close = |a: DMat4, b: DMat4| assert!(a.abs_diff_eq(b, 1e-9), "{a} {b}");
        use Semantic::*;
        close(matrix(Projection) * matrix(View), matrix(ViewProjection));
        close(
            matrix(ViewProjection) * matrix(Model),
            matrix(ModelViewProjection),
        );
        close(matrix(View) * matrix(Model), matrix(ModelView));
        for (m, inverse) in [
            (View, InverseView),
            (Projection, InverseProjection),
            (Model, InverseModel),
            (ViewProjection, InverseViewProjection),
        ] {
            close(matrix(m) * matrix(inverse), DMat4::IDENTITY);
        }
        assert_eq!(of(CameraPosition, "4", 0), [1.0, 0.0, 6.0, 1.0]);
        let eye = matrix(View) * DVec4::new(1.0, 0.0, 6.0, 1.0);
        assert!(eye.truncate().length() < 1e-12);
        assert_eq!(of(NormalMatrix, "33", 0)[4], 0.5);
        assert_eq!(of(Resolution, "2u", 0), [64.0, 32.0]);
        assert_eq!(of(LightColour, "4", 0), [1.0; 4]);
        // Lights differ from sample to sample, and come round.
        assert_ne!(of(LightDirection, "3", 0), of(LightDirection, "3", 1));
        assert_eq!(of(LightDirection, "3", 0), of(LightDirection, "3", 3));
        let d = DVec3::from_slice(&of(LightDirection, "4", 1));
        assert!((d.length() - 1.0).abs() < 1e-12);
        let p = DVec3::from_slice(&of(LightPosition, "3", 1));
        assert!((p.distance(sphere.centre) - 8.0).abs() < 1e-9);
    }
}
