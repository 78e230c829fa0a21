//! The part of a scene file that does not depend on the shader: object, camera, distances, bound, output.

use super::Host;
use super::Model;
use super::camera::{Around, Sphere, spread};
use super::file::{SceneFile, Toml, suggest};
use super::mesh::Mesh;
use super::objects::{Object, bounding_sphere};
use crate::eval::draw::{Blend, DrawState};
use crate::eval::raster::MAX_EDGE;
use crate::{Diagnostic, Result};
use glam::{DMat4, DVec3};
use lodc_passes::Goal;
use lodc_passes::autolod::{self, BoundReading};
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;
use toml::Spanned;

/// What the shader's colour is, and how it gets to the display.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Output {
    /// Linear light, 0..1, written to an sRGB target.
    #[default]
    Display,
    /// Already encoded as sRGB.
    Encoded,
    /// Linear light without a limit: times the exposure, tone-mapped, then written to an sRGB target.
    Linear {
        /// What the light is multiplied by.
        exposure: f32,
        /// What brings it to 0..1.
        tone_mapping: ToneMapping,
    },
}

/// A curve that brings light to 0..1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ToneMapping {
    /// Cut off at 1.
    None,
    /// `x / (1 + x)` for each channel.
    Reinhard,
    /// A rational fit of the ACES curve.
    #[default]
    Aces,
}

/// The most pictures' width or height: the reference has four fine pixels a pixel.
const LARGEST: i64 = MAX_EDGE as i64 / 4;

/// The most levels, views and pictures; more is a slip of the finger.
const MOST_LEVELS: i64 = 64;
const MOST_VIEWS: usize = 256;
const MOST_OFFSETS: i64 = 64;

/// How many pixels a degree has for whoever looks: a screen 0.7 m wide with 3840 pixels, from 0.7 m away, as
/// those assume who measure FLIP.
const PIXELS_PER_DEGREE: f64 = 67.0;

/// How many offsets within a pixel errors are measured at when the file does not say.
const OFFSETS: i64 = 4;

/// The nearest and farthest distance when the file does not say, in radii of the object.
const NEAREST: f64 = 2.0;
const FARTHEST: f64 = 40.0;

/// The checked settings.
#[derive(Clone, Debug)]
pub(super) struct Settings {
    pub(super) object: Object,
    pub(super) mesh: Mesh,
    /// The file that the mesh is from, if it is.
    pub(super) file: Option<Model>,
    pub(super) model: DMat4,
    pub(super) sphere: Sphere,
    pub(super) resolution: [u32; 2],
    pub(super) fov: f64,
    pub(super) seed: u64,
    pub(super) e_max: f64,
    pub(super) q: f64,
    pub(super) distances: Vec<f64>,
    pub(super) nearest: f64,
    pub(super) farthest: f64,
    pub(super) reading: BoundReading,
    pub(super) goal: Goal,
    pub(super) host: Host,
    pub(super) offsets: usize,
    pub(super) pixels_per_degree: f64,
    pub(super) output: Output,
    /// Of each draw of the mesh; none when all are opaque.
    pub(super) states: Arc<[DrawState]>,
    pub(super) views: Vec<DVec3>,
    pub(super) around: Around,
    pub(super) warnings: Vec<Diagnostic>,
}

impl Settings {
    /// Checks what the file says, and fills in what it leaves out: of objects, `other`. Models are looked for from
    /// `folder`.
    pub(super) fn read(toml: Toml, file: &SceneFile, other: Object, folder: &Path) -> Result<Self> {
        let number = |what: &str,
                      value: &Option<Spanned<f64>>,
                      other: f64,
                      range: Range<f64>,
                      says: &str| {
            match value {
                None => Ok(other),
                Some(x) if range.contains(x.get_ref()) => Ok(*x.get_ref()),
                Some(x) => Err(toml.error(format!("`{what}` wants {says}"), x.span(), "")),
            }
        };
        let whole =
            |what: &str, value: &Option<Spanned<i64>>, other: i64, low: i64, high: i64| match value
            {
                None => Ok(other),
                Some(n) if (low..=high).contains(n.get_ref()) => Ok(*n.get_ref()),
                Some(n) => Err(toml.error(
                    format!("`{what}` wants a whole number of {low} to {high}"),
                    n.span(),
                    "",
                )),
            };
        let seed = whole("seed", &file.seed, 1, 0, i64::MAX)?.cast_unsigned();
        let (object, mesh, loaded) = match &file.object {
            Some(name) if Model::is_named(name.get_ref()) => {
                let mut loaded = load(toml, name, folder)?;
                (
                    Object::Model,
                    std::mem::take(&mut loaded.mesh),
                    Some(loaded),
                )
            }
            Some(name) => {
                let object = find_object(toml, name)?;
                (object, object.mesh(seed), None)
            }
            None => (other, other.mesh(seed), None),
        };
        let model = read_model(toml, file)?;
        let local = bounding_sphere(&mesh);
        let sphere = Sphere {
            centre: model.transform_point3(local.centre),
            radius: local.radius * autolod::s_max(&model.as_mat4().to_cols_array_2d()),
        };
        let resolution = match &file.resolution {
            None => [256; 2],
            Some(size) => match size
                .get_ref()
                .map(|n| u32::try_from(n).ok().filter(|_| (1..=LARGEST).contains(&n)))
            {
                [Some(width), Some(height)] => [width, height],
                _ => {
                    return Err(toml.error(
                        format!("`resolution` wants two whole numbers of 1 to {LARGEST}"),
                        size.span(),
                        "",
                    ));
                }
            },
        };
        let levels = whole("levels", &file.levels, 5, 1, MOST_LEVELS)?;
        let (nearest, farthest) = read_distances(toml, file, &sphere)?;
        let (views, around) = read_views(toml, file, object)?;
        let states = read_states(toml, file, loaded.as_ref())?;
        let mut warnings = match &loaded {
            Some(loaded) => loaded.warnings.clone(),
            None => Vec::new(),
        };
        if nearest <= sphere.radius {
            let warning = Diagnostic::warning(format!(
                "at the nearest distance, {nearest}, the eye is inside the object's bounding sphere"
            ));
            let located = match &file.distance.nearest {
                Some(said) => warning
                    .with_source(toml.name, toml.text)
                    .with_label(said.span(), ""),
                None => warning,
            };
            warnings.push(*located.with_note(format!(
                "the {}'s radius is {:.2}: a nearest distance beyond it makes autoLOD mean something there",
                object.name(),
                sphere.radius
            )));
        }
        Ok(Self {
            object,
            mesh,
            file: loaded,
            model,
            sphere,
            resolution,
            // Beyond these a perspective picture of a sphere is mostly distortion.
            fov: number(
                "fov",
                &file.fov,
                45.0,
                1.0..170.0,
                "degrees of 1 to 170, from top to bottom",
            )?,
            seed,
            e_max: number(
                "e_max",
                &file.e_max,
                0.05,
                0.0..1.0 + f64::EPSILON,
                "an error of 0 to 1",
            )?,
            q: number("Q", &file.q, 0.5, 0.0..100.0, "an exponent of 0 to 100")?,
            distances: autolod::distances(nearest, farthest, levels as usize),
            nearest,
            farthest,
            reading: match &file.bound {
                None => BoundReading::default(),
                Some(name) => BoundReading::of_name(name.get_ref()).ok_or_else(|| {
                    let error = toml.error(
                        format!("there is no bound `{}`", name.get_ref()),
                        name.span(),
                        "",
                    );
                    let known = [BoundReading::Excess, BoundReading::Paper].map(BoundReading::name);
                    suggest(error, name.get_ref(), &known)
                })?,
            },
            goal: match &file.goal {
                None => Goal::default(),
                Some(goal) => (goal.get_ref().parse())
                    .map_err(|wrong: String| toml.error(wrong, goal.span(), ""))?,
            },
            host: Host {
                parameters: file.host.parameters,
                textures: file.host.textures,
                most_texture_bytes: file.host.max_texture_memory.map(|mib| u64::from(mib) << 20),
            },
            offsets: whole("offsets", &file.offsets, OFFSETS, 1, MOST_OFFSETS)? as usize,
            pixels_per_degree: number(
                "pixels_per_degree",
                &file.pixels_per_degree,
                PIXELS_PER_DEGREE,
                1.0..1000.0,
                "1 to 1000 pixels",
            )?,
            output: read_output(toml, file)?,
            states,
            views,
            around,
            warnings,
        })
    }
}

/// Reads a model; what is wrong with it is said at its name.
fn load(toml: Toml, name: &Spanned<String>, folder: &Path) -> Result<Model> {
    let at = |error: Box<Diagnostic>| {
        error
            .with_source(toml.name, toml.text)
            .with_label(name.span(), "")
    };
    let model = Model::read(name.get_ref(), folder).map_err(at)?;
    let mut positions = model.mesh.positions.iter();
    let first = positions.next();
    if positions.all(|position| Some(position) == first) {
        return Err(at(Diagnostic::error(format!(
            "all vertices of the model `{}` are in one place",
            name.get_ref()
        ))
        .with_note(
            "check the scale of its nodes: an object without a size has no distance",
        )));
    }
    Ok(model)
}

fn find_object(toml: Toml, name: &Spanned<String>) -> Result<Object> {
    let mut all = Object::ALL.into_iter();
    if let Some((_, object)) = all.find(|(known, _)| known == name.get_ref()) {
        return Ok(object);
    }
    let known = Object::ALL.map(|(known, _)| known);
    let error = toml.error(
        format!("there is no object `{}`", name.get_ref()),
        name.span(),
        "",
    );
    let error = suggest(error, name.get_ref(), &known);
    Err(error.with_note(Model::way_out(name.get_ref())))
}

fn read_model(toml: Toml, file: &SceneFile) -> Result<DMat4> {
    let Some(columns) = &file.model else {
        return Ok(DMat4::IDENTITY);
    };
    let model = DMat4::from_cols_array_2d(columns.get_ref());
    let affine = model.row(3) == glam::DVec4::W;
    let size = autolod::s_max(&model.as_mat4().to_cols_array_2d());
    if !model.is_finite() || !affine || !size.is_finite() || size <= 0.0 {
        return Err(toml
            .error(
                "`model` wants a matrix that moves, turns and scales",
                columns.span(),
                "",
            )
            .with_note(
                "write it column by column; the last number of each column is 0, 0, 0 and 1",
            ));
    }
    Ok(model)
}

fn read_distances(toml: Toml, file: &SceneFile, sphere: &Sphere) -> Result<(f64, f64)> {
    let said = (&file.distance.nearest, &file.distance.farthest);
    for (name, value) in [("nearest", said.0), ("farthest", said.1)] {
        if let Some(value) = value
            && !(value.get_ref().is_finite() && *value.get_ref() > 0.0)
        {
            return Err(toml.error(
                format!("`{name}` wants a distance above 0"),
                value.span(),
                "from the eye to the centre of the object, world units",
            ));
        }
    }
    let (nearest, farthest) = match (
        said.0.as_ref().map(|d| *d.get_ref()),
        said.1.as_ref().map(|d| *d.get_ref()),
    ) {
        (Some(nearest), Some(farthest)) => (nearest, farthest),
        (Some(nearest), None) => (nearest, nearest * (FARTHEST / NEAREST)),
        (None, Some(farthest)) => (farthest / (FARTHEST / NEAREST), farthest),
        (None, None) => (NEAREST * sphere.radius, FARTHEST * sphere.radius),
    };
    if nearest < farthest {
        return Ok((nearest, farthest));
    }
    let places = [said.1, said.0];
    let mut places = places.into_iter().flatten();
    let span = places.next().map_or(0..0, Spanned::span);
    let error = toml.error(
        format!("the nearest distance, {nearest}, is not below the farthest, {farthest}"),
        span,
        "",
    );
    Err(match places.next() {
        Some(other) => error.with_label(other.span(), ""),
        None => error,
    }
    .with_note(
        "`nearest` is where the original is used, `farthest` where the error may be `e_max`",
    ))
}

fn read_output(toml: Toml, file: &SceneFile) -> Result<Output> {
    let exposed = file
        .output
        .as_ref()
        .is_some_and(|o| o.get_ref() == "linear");
    if !exposed {
        let spans = [
            file.exposure.as_ref().map(|e| ("exposure", e.span())),
            file.tone_mapping
                .as_ref()
                .map(|t| ("tone_mapping", t.span())),
        ];
        if let Some((name, span)) = spans.into_iter().flatten().next() {
            return Err(toml
                .error(format!("`{name}` is for `output = \"linear\"` only"), span, "")
                .with_note("leave it out, or say `output = \"linear\"` when the shader returns light without a limit"));
        }
    }
    let word = |what: &str, value: &Spanned<String>, known: &[&str]| {
        let error = toml.error(
            format!("there is no {what} `{}`", value.get_ref()),
            value.span(),
            "",
        );
        suggest(error, value.get_ref(), known)
    };
    let Some(output) = &file.output else {
        return Ok(Output::Display);
    };
    match output.get_ref().as_str() {
        "display" => Ok(Output::Display),
        "encoded" => Ok(Output::Encoded),
        "linear" => {
            let tone_mapping = match &file.tone_mapping {
                None => ToneMapping::default(),
                Some(name) => match name.get_ref().as_str() {
                    "none" => ToneMapping::None,
                    "reinhard" => ToneMapping::Reinhard,
                    "aces" => ToneMapping::Aces,
                    _ => return Err(word("tone mapping", name, &["none", "reinhard", "aces"])),
                },
            };
            let exposure = match &file.exposure {
                None => 1.0,
                Some(e) => {
                    let exposure = *e.get_ref() as f32;
                    if !(exposure.is_finite() && exposure > 0.0) {
                        return Err(toml.error("`exposure` wants a factor above 0", e.span(), ""));
                    }
                    exposure
                }
            };
            Ok(Output::Linear {
                exposure,
                tone_mapping,
            })
        }
        _ => Err(word("output", output, &["display", "encoded", "linear"])),
    }
}

/// How each draw gets into the picture: as the scene says for all, or else as the model's materials do. What is blended
/// and not double-sided shows its front alone.
fn read_states(toml: Toml, file: &SceneFile, model: Option<&Model>) -> Result<Arc<[DrawState]>> {
    let said = match &file.blend {
        None => None,
        Some(name) => Some(Blend::of_name(name.get_ref()).ok_or_else(|| {
            toml.unknown("blending", name, Blend::ALL.into_iter().map(Blend::name))
        })?),
    };
    let state = |blend: Blend, double_sided: bool| DrawState {
        blend,
        front_only: blend != Blend::Opaque && !double_sided,
    };
    let states: Vec<DrawState> = match model {
        Some(model) => model
            .materials
            .iter()
            .map(|material| {
                let own = match material.blends() {
                    true => Blend::Alpha,
                    false => Blend::Opaque,
                };
                state(said.unwrap_or(own), material.double_sided())
            })
            .collect(),
        None => vec![state(said.unwrap_or_default(), true)],
    };
    let blended = states.iter().any(|state| state.blend != Blend::Opaque);
    Ok(match blended {
        true => states.into(),
        false => Arc::default(),
    })
}

fn read_views(toml: Toml, file: &SceneFile, object: Object) -> Result<(Vec<DVec3>, Around)> {
    let views = &file.views;
    if let (Some(directions), Some(count)) = (&views.directions, &views.count) {
        return Err(toml
            .error(
                "`directions` and `count` exclude each other",
                count.span(),
                "",
            )
            .with_label(directions.span(), ""));
    }
    if let Some(directions) = &views.directions {
        let list = directions.get_ref();
        if list.is_empty() || list.len() > MOST_VIEWS {
            return Err(toml.error(
                format!("`directions` wants 1 to {MOST_VIEWS} views"),
                directions.span(),
                format!("these are {}", list.len()),
            ));
        }
        let views = list
            .iter()
            .map(|d| {
                let vector = DVec3::from_array(*d.get_ref());
                vector.try_normalize().ok_or_else(|| {
                    toml.error("a view direction wants a length", d.span(), "")
                        .with_note("it points from the object's centre to the eye")
                })
            })
            .collect::<Result<_>>()?;
        return Ok((views, Around::Listed));
    }
    let count = match &views.count {
        // Every direction shows the same.
        None if object == Object::Screen => 1,
        None => 6,
        Some(count) => {
            let found = usize::try_from(*count.get_ref()).ok();
            found
                .filter(|n| (1..=MOST_VIEWS).contains(n))
                .ok_or_else(|| {
                    toml.error(
                        format!("`count` wants a whole number of 1 to {MOST_VIEWS}"),
                        count.span(),
                        "",
                    )
                })?
        }
    };
    let (axis, angle) = object.visible_from();
    // One view alone is from the axis, and stands for those near it.
    let around = match count {
        1 => Around::Listed,
        _ => Around::Cap(axis, angle),
    };
    Ok((spread(count, axis, angle), around))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Settings> {
        let toml = Toml {
            name: "a.toml",
            text,
        };
        Settings::read(toml, &toml.parse()?, Object::Sphere, Path::new(""))
    }

    #[test]
    fn an_empty_file_is_a_scene() {
        let settings = read("").unwrap();
        assert_eq!(settings.object, Object::Sphere);
        assert_eq!((settings.resolution, settings.fov), ([256, 256], 45.0));
        assert_eq!((settings.e_max, settings.q, settings.seed), (0.05, 0.5, 1));
        assert!((settings.nearest - 2.0).abs() < 1e-6 && (settings.farthest - 40.0).abs() < 1e-4);
        assert_eq!(settings.distances.len(), 5);
        assert_eq!(settings.views.len(), 6);
        assert_eq!(settings.output, Output::Display);
        assert!(settings.warnings.is_empty());
    }

    #[test]
    fn everything_can_be_said() {
        let settings = read(
            "object = \"terrain\"\nresolution = [64, 32]\nfov = 60\nseed = 7\ne_max = 0.1\nQ = 1\nlevels = 3\n\
             output = \"linear\"\nexposure = 2\ntone_mapping = \"reinhard\"\n\
             model = [[2,0,0,0],[0,2,0,0],[0,0,2,0],[1,0,0,1]]\n\
             [distance]\nnearest = 4\nfarthest = 64\n[views]\ndirections = [[0, 0, 2]]\n",
        )
        .unwrap();
        assert_eq!(settings.object, Object::Terrain);
        assert_eq!(settings.resolution, [64, 32]);
        assert_eq!(settings.distances, [4.0, 16.0, 64.0]);
        assert_eq!(settings.views, [DVec3::Z]);
        assert_eq!(
            settings.output,
            Output::Linear {
                exposure: 2.0,
                tone_mapping: ToneMapping::Reinhard
            }
        );
        // The model moves and stretches the sphere.
        assert!(settings.sphere.radius > 2.5 && (settings.sphere.centre.x - 1.0).abs() < 1e-6);
    }

    #[test]
    fn one_distance_gives_the_other() {
        let one = read("[distance]\nnearest = 3").unwrap();
        assert_eq!((one.nearest, one.farthest), (3.0, 60.0));
        let other = read("[distance]\nfarthest = 100").unwrap();
        assert_eq!((other.nearest, other.farthest), (5.0, 100.0));
    }

    #[test]
    fn an_eye_inside_the_object_is_warned_of() {
        let settings = read("[distance]\nnearest = 0.5\nfarthest = 4").unwrap();
        let text = settings.warnings[0].to_string();
        assert!(
            text.contains("inside the object's bounding sphere") && text.contains("a.toml:2:11"),
            "{text}"
        );
    }

    #[test]
    fn objects_with_a_back_are_not_looked_at_from_behind() {
        for (object, axis) in [("plane", DVec3::Z), ("terrain", DVec3::Y)] {
            let settings = read(&format!("object = \"{object}\"\n[views]\ncount = 9")).unwrap();
            assert!(settings.views.iter().all(|v| v.dot(axis) > 0.2), "{object}");
        }
    }

    #[test]
    fn wrong_values_are_located() {
        for (text, message, place) in [
            (
                "object = \"teapot\"",
                "there is no object `teapot`",
                "\"teapot\"",
            ),
            (
                "object = \"rock.stl\"",
                "there is no object `rock.stl`",
                "\"rock.stl\"",
            ),
            (
                "resolution = [0, 256]",
                "`resolution` wants two whole numbers of 1 to 4096",
                "[0, 256]",
            ),
            (
                "resolution = [100000, 1]",
                "`resolution` wants two whole numbers of 1 to 4096",
                "[100000, 1]",
            ),
            (
                "resolution = [-1, 1]",
                "`resolution` wants two whole numbers of 1 to 4096",
                "[-1, 1]",
            ),
            (
                "fov = 180.0",
                "`fov` wants degrees of 1 to 170, from top to bottom",
                "180.0",
            ),
            (
                "fov = nan",
                "`fov` wants degrees of 1 to 170, from top to bottom",
                "nan",
            ),
            (
                "seed = -1",
                "`seed` wants a whole number of 0 to 9223372036854775807",
                "-1",
            ),
            ("e_max = -0.1", "`e_max` wants an error of 0 to 1", "-0.1"),
            ("e_max = inf", "`e_max` wants an error of 0 to 1", "inf"),
            ("Q = -1", "`Q` wants an exponent of 0 to 100", "-1"),
            (
                "levels = 0",
                "`levels` wants a whole number of 1 to 64",
                "0",
            ),
            (
                "output = \"gamma\"",
                "there is no output `gamma`",
                "\"gamma\"",
            ),
            (
                "blend = \"over\"",
                "there is no blending `over`",
                "\"over\"",
            ),
            (
                "exposure = 2.0",
                "`exposure` is for `output = \"linear\"` only",
                "2.0",
            ),
            (
                "tone_mapping = \"aces\"",
                "`tone_mapping` is for `output = \"linear\"` only",
                "\"aces\"",
            ),
            (
                "output = \"linear\"\nexposure = 0",
                "`exposure` wants a factor above 0",
                "0",
            ),
            (
                "output = \"linear\"\ntone_mapping = \"filmic\"",
                "there is no tone mapping `filmic`",
                "\"filmic\"",
            ),
            (
                "[distance]\nnearest = nan",
                "`nearest` wants a distance above 0",
                "nan",
            ),
            (
                "[distance]\nfarthest = -2",
                "`farthest` wants a distance above 0",
                "-2",
            ),
            (
                "[distance]\nnearest = 40\nfarthest = 2",
                "the nearest distance, 40, is not below the farthest, 2",
                "2",
            ),
            (
                "[distance]\nnearest = 2\nfarthest = 2",
                "the nearest distance, 2, is not below the farthest, 2",
                "2",
            ),
            (
                "[views]\ncount = 0",
                "`count` wants a whole number of 1 to 256",
                "0",
            ),
            (
                "[views]\ncount = 1\ndirections = []",
                "`directions` and `count` exclude each other",
                "1",
            ),
            (
                "[views]\ndirections = []",
                "`directions` wants 1 to 256 views",
                "[]",
            ),
            (
                "[views]\ndirections = [[0, 0, 1], [0, 0, 0]]",
                "a view direction wants a length",
                "[0, 0, 0]",
            ),
            (
                "model = [[0,0,0,0],[0,0,0,0],[0,0,0,0],[0,0,0,1]]",
                "`model` wants a matrix that moves, turns and scales",
                "",
            ),
            (
                "model = [[1,0,0,1],[0,1,0,0],[0,0,1,0],[0,0,0,1]]",
                "`model` wants a matrix that moves, turns and scales",
                "",
            ),
        ] {
            let error = read(text).expect_err(text);
            assert_eq!(error.message, message);
            let covered = &text[error.labels[0].0.clone()];
            assert!(place.is_empty() || covered == place, "{text}: {covered}");
        }
        assert!(
            read("object = \"rock.stl\"")
                .unwrap_err()
                .notes
                .join(" ")
                .contains("export it as")
        );
    }
}
