//! Levels of a model's mesh by its pictures, under the shader that it is drawn with.

use super::mesh::{check_output, from_distance};
use super::search::Read;
use super::{Files, ModelFile, Request, relative};
use crate::mesh::{LevelMesh, Levels, Maker, Other, Settings, Subject, Until, Wanted};
use crate::scene::Scene;
use crate::{Diagnostic, Result};
use lodc_mesh::Mesh;
use lodc_mesh::distance::{Distance, Reference};
use lodc_mesh::write::{Level, Sight};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How far levels go by their pictures.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum PictureGoals {
    /// A level for each distance of the scene, within the bound there.
    Scene,
    /// One for each error, at one distance: excess of the RMSE, 0..1.
    Errors(Vec<f64>),
    /// One for each number of triangles, at one distance.
    Triangles(Vec<usize>),
}

/// A mesh that is simplified by its pictures, and how far.
#[derive(Clone, Debug)]
pub struct PictureRequest {
    /// The model: glTF, GLB, OBJ or PLY.
    pub model: PathBuf,
    /// The shader that it is drawn with, how that is read, and the scene, whose object the model takes the place of.
    pub request: Request,
    /// How far its levels go.
    pub goals: PictureGoals,
    /// The distance of the pictures, from the eye to the centre of the object, for all goals but the scene's own; by default where the
    /// whole object is in the picture.
    pub at: Option<f64>,
    /// How meshes are simplified.
    pub settings: Settings,
    /// The GLB that the levels are written to; without it nothing is.
    pub output: Option<PathBuf>,
    /// Whether each level has a file of its own.
    pub apart: bool,
}

/// A level of a mesh, by its pictures.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct PictureLevel {
    /// How many triangles it has.
    pub triangles: usize,
    /// How many vertices.
    pub vertices: usize,
    /// How far it is from the original, by the vertices of both.
    pub distance: Distance,
    /// Where it is looked at, from the eye to the object's centre, world units.
    pub at: f64,
    /// What it may add to the original's error there, where it was made for that.
    pub bound: Option<f64>,
    /// What it adds, on pictures that had no part in making it.
    pub excess: f64,
    /// The original's own error on those.
    pub floor: f64,
    /// What made it, and what others do in its place.
    pub makers: (Maker, Vec<(Maker, Other)>),
    /// How long our own mesh took to make, and, where others were asked, they.
    pub times: [Duration; 2],
}

/// What simplifying a mesh by its pictures gives.
#[derive(Debug)]
#[non_exhaustive]
pub struct SeenMesh {
    /// What is to be written.
    pub files: Files,
    /// How many triangles and vertices the original has.
    pub original: [usize; 2],
    /// Its levels.
    pub levels: Vec<PictureLevel>,
    /// What should be known.
    pub warnings: Vec<Diagnostic>,
}

/// How far that is.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Seeing {
    /// The level that is made, from 1.
    pub level: usize,
    /// How many there will be.
    pub of: usize,
    /// How many triangles are left.
    pub triangles: usize,
    /// What they add to the original's error.
    pub excess: f64,
    /// How much of the level is done, as far as can be told: 0..1.
    pub done: f64,
}

/// Makes levels of a model's mesh by its pictures.
///
/// # Errors
/// When the model, the shader or the scene cannot be read, when the evaluator refuses the shader, when the distance is within
/// the object; when the output cannot be written, or is the model itself.
pub fn mesh_by_pictures(request: &PictureRequest, progress: &dyn Fn(Seeing)) -> Result<SeenMesh> {
    check_output(request.output.as_deref(), &request.model)?;
    let model = ModelFile::read(&request.model)?;
    let read = Read::new(&request.request)?;
    let named_from = read.scene_file.as_ref().unwrap_or(&request.request.shader);
    let object = relative(named_from.parent().unwrap_or(Path::new("")), &request.model);
    let scene = Scene::read_on(&read.source, read.scene_file.as_deref(), &object)?;
    let ready = read.ready(scene);
    let vertex = ready.vertex()?;
    ready.ends(&vertex)?;
    let fragment = ready.fragment()?;
    let scene = &ready.scene;
    let subject = Subject {
        vertex: &vertex,
        fragment: &fragment,
        scene,
    };
    let all = wanted(request, scene)?;
    let mut warnings = model.warnings.clone();
    let is_new =
        |warning: &&Diagnostic| !model.warnings.iter().any(|w| w.message == warning.message);
    warnings.extend(scene.warnings.iter().filter(is_new).cloned());

    let original = &*scene.mesh;
    let reference = Reference::new(original);
    let mut makers = Levels::new(subject, request.settings);
    let mut levels = Vec::new();
    let mut meshes: Vec<Mesh> = Vec::new();
    let mut before = original.indices.len() / 3;
    for (number, wanted) in (1..).zip(&all) {
        let began = Instant::now();
        let mut level = makers.make(*wanted, &|now| {
            let done = match wanted.until {
                Until::Triangles(count) => {
                    (before - now.triangles) as f64 / before.saturating_sub(count).max(1) as f64
                }
                Until::Error(bound) => now.excess / bound,
            };
            progress(Seeing {
                level: number,
                of: all.len(),
                triangles: now.triangles,
                excess: now.excess,
                done: done.clamp(0.0, 1.0),
            });
        });
        before = level.triangles.count();
        let made = began.elapsed();
        propose(&mut makers, &mut level);
        let mesh = level.triangles.mesh(original);
        levels.push(PictureLevel {
            triangles: mesh.indices.len() / 3,
            vertices: mesh.positions.len(),
            distance: reference.to(&mesh),
            at: wanted.distance,
            bound: match wanted.until {
                Until::Error(bound) => Some(bound),
                Until::Triangles(_) => None,
            },
            excess: level.excess,
            floor: level.floor,
            makers: (level.maker, level.others),
            times: [made, began.elapsed() - made],
        });
        meshes.push(mesh);
    }
    let files = match &request.output {
        Some(output) => {
            let sight = Sight {
                fov: scene.fov,
                ..Sight::default()
            };
            let height = scene.resolution[1];
            // Where levels are looked at from one distance, they begin where what they are off is a pixel high.
            let from = |level: &PictureLevel| match request.goals {
                PictureGoals::Scene => level.at,
                PictureGoals::Errors(_) | PictureGoals::Triangles(_) => {
                    from_distance(&level.distance, level.distance.largest(), (&sight, height))
                }
            };
            let first = Level {
                mesh: original,
                distance: 0.0,
            };
            let rest = meshes.iter().zip(&levels).map(|(mesh, level)| Level {
                mesh,
                distance: from(level),
            });
            let written: Vec<Level> = std::iter::once(first).chain(rest).collect();
            model.files(&written, &sight, output, request.apart)?
        }
        None => Files::new(),
    };
    Ok(SeenMesh {
        files,
        original: [original.indices.len() / 3, original.positions.len()],
        levels,
        warnings,
    })
}

#[cfg(feature = "meshopt")]
fn propose(makers: &mut Levels<'_>, level: &mut LevelMesh) {
    makers.propose(level);
}

#[cfg(not(feature = "meshopt"))]
fn propose(_: &mut Levels<'_>, _: &mut LevelMesh) {}

/// The levels in their order.
fn wanted(request: &PictureRequest, scene: &Scene) -> Result<Vec<Wanted>> {
    let whole = scene.sphere.radius / libm::sin(scene.fov.to_radians() / 2.0);
    let distance = request.at.unwrap_or(whole);
    let is_scene = request.goals == PictureGoals::Scene;
    if !is_scene && distance <= scene.sphere.radius {
        return Err(Diagnostic::error(format!(
            "at the distance {distance} the eye is inside the object, whose radius is {}",
            scene.sphere.radius
        ))
        .with_note("give a larger one with `--at`"));
    }
    let at = |until| Wanted { distance, until };
    Ok(match &request.goals {
        PictureGoals::Scene => {
            let distances = scene.distances.iter().skip(1);
            distances
                .map(|distance| Wanted {
                    distance: *distance,
                    until: Until::Error(scene.bound(*distance)),
                })
                .collect()
        }
        PictureGoals::Errors(errors) => {
            let mut errors = errors.clone();
            errors.sort_by(f64::total_cmp);
            errors.into_iter().map(|e| at(Until::Error(e))).collect()
        }
        PictureGoals::Triangles(counts) => {
            let mut counts = counts.clone();
            counts.sort_unstable_by(|a, b| b.cmp(a));
            let counts = counts.into_iter();
            counts.map(|count| at(Until::Triangles(count))).collect()
        }
    })
}
