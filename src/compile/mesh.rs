//! The mesh stage on its own: levels of a model's mesh, by its geometry, and how far two meshes are apart.
//!
//! This work is based on: Pan, Zhou and Shi, section 2, for simplification to a given error, and equation 1 for the distance.

use super::{Files, ModelFile};
use crate::{Diagnostic, Result, emit};
use lodc_mesh::Mesh;
use lodc_mesh::distance::{Distance, Reference, diagonal};
use lodc_mesh::simplify::Simplifier;
use lodc_mesh::write::{Level, Sight};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How many points are spread over either surface when two meshes are compared.
const SAMPLES: usize = 100_000;

/// A length in a model.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Length {
    /// In the model's units.
    Units(f64),
    /// A share of the diagonal of the model's bounding box, 1 for all of it.
    OfDiagonal(f64),
}

impl Length {
    /// In units of a model with this diagonal.
    pub fn units(self, diagonal: f64) -> f64 {
        match self {
            Self::Units(units) => units,
            Self::OfDiagonal(share) => share * diagonal,
        }
    }

    /// Reads `0.02%` of the diagonal, or a number of units.
    pub fn of_text(text: &str) -> Option<Self> {
        let percent = text.trim().strip_suffix('%');
        let number: f64 = percent.unwrap_or(text).trim().parse().ok()?;
        (number > 0.0 && number.is_finite()).then(|| match percent {
            Some(_) => Self::OfDiagonal(number / 100.0),
            None => Self::Units(number),
        })
    }
}

/// How far the levels of a mesh go, the least simplified first.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum MeshGoals {
    /// As far as no point of either surface is farther than this from the other, which is proved.
    Bounds(Vec<Length>),
    /// As far as the mean distance by Pan's equation 1 is no more than this.
    Means(Vec<Length>),
    /// To no more than so many triangles.
    Triangles(Vec<usize>),
}

/// A mesh that is simplified, and how far.
#[derive(Clone, Debug)]
pub struct MeshRequest {
    /// The model: glTF, GLB, OBJ or PLY.
    pub model: PathBuf,
    /// How far its levels go, in any order.
    pub goals: MeshGoals,
    /// The GLB that the levels are written to; without it nothing is.
    pub output: Option<PathBuf>,
    /// Whether each level has a file of its own.
    pub apart: bool,
    /// How it is looked at, for the distances at which levels begin.
    pub sight: Sight,
    /// How many pixels high the screen is, for the same.
    pub height: u32,
}

/// A level of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct MeshLevel {
    /// How many triangles it has.
    pub triangles: usize,
    /// How many vertices.
    pub vertices: usize,
    /// How far it is from the original, by the vertices of both.
    pub distance: Distance,
    /// No point of either surface is farther than this from the other, in the model's units.
    pub bound: f64,
    /// From where on it is drawn: there the bound is a pixel at the nearest point of the sphere about its box. From the eye to the sphere's
    /// centre, world units.
    pub from: f64,
    /// How long it took to make.
    pub time: Duration,
}

/// What simplifying a mesh gives.
#[derive(Debug)]
#[non_exhaustive]
pub struct SimplifiedMesh {
    /// What is to be written.
    pub files: Files,
    /// The original, then its levels.
    pub levels: Vec<MeshLevel>,
    /// What should be known.
    pub warnings: Vec<Diagnostic>,
}

/// How far a simplification is.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Simplifying {
    /// The level that is made, from 1.
    pub level: usize,
    /// How many there will be.
    pub of: usize,
    /// How many triangles are left.
    pub triangles: usize,
    /// How many the original has.
    pub original: usize,
}

/// Makes levels of a model's mesh.
///
/// # Errors
/// When the model cannot be read or is damaged; when the output cannot be written, or is the model itself.
pub fn mesh(request: &MeshRequest, progress: &dyn Fn(Simplifying)) -> Result<SimplifiedMesh> {
    check_output(request.output.as_deref(), &request.model)?;
    let model = ModelFile::read(&request.model)?;
    let original = &model.mesh;
    let reference = Reference::new(original);
    let size = diagonal(original);
    let mut simplifier = Simplifier::new(original);
    let mut meshes: Vec<Mesh> = Vec::new();
    let mut levels = vec![MeshLevel {
        triangles: original.indices.len() / 3,
        vertices: original.positions.len(),
        distance: reference.to(original),
        bound: 0.0,
        from: 0.0,
        time: Duration::ZERO,
    }];
    let steps = steps(&request.goals, size);
    for (number, step) in (1..).zip(&steps) {
        let mut tell = |triangles| {
            progress(Simplifying {
                level: number,
                of: steps.len(),
                triangles,
                original: levels[0].triangles,
            });
        };
        let began = Instant::now();
        match *step {
            Step::Bound(bound) => simplifier.to_bound(bound, &mut tell),
            Step::Mean(mean) => simplifier.to_mean(mean, &reference, &mut tell),
            Step::Triangles(triangles) => simplifier.to_triangles(triangles, &mut tell),
        }
        let made = simplifier.mesh();
        let time = began.elapsed();
        let distance = reference.to(&made);
        let seen = (&request.sight, request.height);
        levels.push(MeshLevel {
            triangles: made.indices.len() / 3,
            vertices: made.positions.len(),
            bound: simplifier.bound(),
            from: from_distance(&distance, simplifier.bound(), seen),
            distance,
            time,
        });
        meshes.push(made);
    }
    let files = match &request.output {
        Some(output) => {
            let all = std::iter::once(original).chain(&meshes).zip(&levels);
            let all: Vec<Level> = all
                .map(|(mesh, level)| Level {
                    mesh,
                    distance: level.from,
                })
                .collect();
            model.files(&all, &request.sight, output, request.apart)?
        }
        None => Files::new(),
    };
    Ok(SimplifiedMesh {
        files,
        levels,
        warnings: model.warnings,
    })
}

/// Refuses what cannot be written before the work is done, and to write over the model.
pub(super) fn check_output(output: Option<&Path>, model: &Path) -> Result<()> {
    let Some(output) = output else {
        return Ok(());
    };
    emit::writable(&[(output.to_owned(), Vec::new())])?;
    if same_file(output, model) {
        return Err(Diagnostic::error(format!(
            "the output `{}` is the model itself",
            output.display()
        ))
        .with_note("give another name with `-o`"));
    }
    Ok(())
}

/// From where on a level is drawn: there what it is off is a pixel high at the nearest point of the sphere about its box. From the
/// eye to the sphere's centre, world units.
pub(super) fn from_distance(distance: &Distance, off: f64, (sight, height): (&Sight, u32)) -> f64 {
    // A unit at distance 1 is so many pixels high.
    let pixels = f64::from(height) * sight.height(1.0, 1.0);
    sight.scale * (0.5 * distance.diagonal + off * pixels)
}

/// How far one level goes, in the model's units.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Step {
    Bound(f64),
    Mean(f64),
    Triangles(usize),
}

/// The levels in their order, each once.
fn steps(goals: &MeshGoals, diagonal: f64) -> Vec<Step> {
    let rising = |lengths: &[Length]| {
        let mut units: Vec<f64> = lengths
            .iter()
            .map(|length| length.units(diagonal))
            .collect();
        units.sort_by(f64::total_cmp);
        units.dedup();
        units.into_iter()
    };
    match goals {
        MeshGoals::Bounds(bounds) => rising(bounds).map(Step::Bound).collect(),
        MeshGoals::Means(means) => rising(means).map(Step::Mean).collect(),
        MeshGoals::Triangles(counts) => {
            let mut counts = counts.clone();
            counts.sort_unstable_by(|a, b| b.cmp(a));
            counts.dedup();
            counts.into_iter().map(Step::Triangles).collect()
        }
    }
}

fn same_file(a: &Path, b: &Path) -> bool {
    a == b
        || a.canonicalize()
            .is_ok_and(|a| b.canonicalize().is_ok_and(|b| a == b))
}

/// How far two meshes are apart.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct MeshError {
    /// How many triangles the original and the other have.
    pub triangles: [usize; 2],
    /// By the vertices of both.
    pub vertices: Distance,
    /// By points spread over both surfaces.
    pub surfaces: Distance,
    /// What should be known.
    pub warnings: Vec<Diagnostic>,
}

/// Measures how far a model's mesh is from another's. The first is the original.
///
/// # Errors
/// When one of them cannot be read or is damaged.
pub fn mesh_error(original: &Path, other: &Path) -> Result<MeshError> {
    let (a, b) = (ModelFile::read(original)?, ModelFile::read(other)?);
    let reference = Reference::new(&a.mesh);
    Ok(MeshError {
        triangles: [&a, &b].map(|model| model.mesh.indices.len() / 3),
        vertices: reference.to(&b.mesh),
        surfaces: reference.to_by_samples(&b.mesh, SAMPLES),
        warnings: [a.warnings, b.warnings].concat(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_read() {
        assert_eq!(Length::of_text("0.5%"), Some(Length::OfDiagonal(0.005)));
        assert_eq!(Length::of_text(" 2 "), Some(Length::Units(2.0)));
        for wrong in ["", "%", "0", "-1%", "NaN", "inf", "0%", "1 m"] {
            assert_eq!(Length::of_text(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn levels_are_made_in_order_and_once() {
        let bounds = MeshGoals::Bounds(vec![
            Length::OfDiagonal(0.5),
            Length::Units(1.0),
            Length::Units(2.0),
        ]);
        assert_eq!(steps(&bounds, 4.0), [Step::Bound(1.0), Step::Bound(2.0)]);
        let triangles = MeshGoals::Triangles(vec![10, 30, 10]);
        assert_eq!(
            steps(&triangles, 4.0),
            [Step::Triangles(30), Step::Triangles(10)]
        );
    }

    /// A field of hills as OBJ, in a folder of its own.
    fn hills(name: &str) -> PathBuf {
        let mut text = String::new();
        for i in 0..30 {
            for j in 0..30 {
                let (x, z) = (f64::from(i) / 10.0, f64::from(j) / 10.0);
                text += &format!("v {x} {} {z}\n", (x * 2.0).sin() * (z * 3.0).cos() / 5.0);
            }
        }
        for i in 0..29 {
            for j in 0..29 {
                let corner = 30 * i + j + 1;
                text += &format!(
                    "f {corner} {} {} {}\n",
                    corner + 1,
                    corner + 31,
                    corner + 30
                );
            }
        }
        let folder = std::env::temp_dir().join(format!("lodc-mesh-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a writable folder");
        let path = folder.join("hills.obj");
        std::fs::write(&path, text).expect("a writable folder");
        path
    }

    #[test]
    fn levels_are_written_and_as_far_from_the_original_as_they_say() {
        let model = hills("levels");
        let request = MeshRequest {
            model: model.clone(),
            goals: MeshGoals::Bounds(vec![Length::OfDiagonal(0.02), Length::OfDiagonal(0.005)]),
            output: Some(model.with_file_name("out.glb")),
            apart: true,
            sight: Sight::default(),
            height: 1080,
        };
        let made = mesh(&request, &|_| ()).expect("levels");
        assert_eq!(made.levels[0].triangles, 1682);
        assert!(made.levels.is_sorted_by(|a, b| a.triangles > b.triangles
            && a.from < b.from
            && a.bound < b.bound));
        assert!(made.levels[2].bound <= 0.02 * made.levels[2].distance.diagonal);

        let names: Vec<_> = made
            .files
            .iter()
            .filter_map(|(path, _)| path.file_name()?.to_str())
            .collect();
        assert_eq!(
            names,
            [
                "out.lod0.glb",
                "out.lod1.glb",
                "out.lod2.glb",
                "out.meshes.toml"
            ]
        );
        emit::write_atomically(&made.files).expect("files");
        let measured =
            mesh_error(&model, &model.with_file_name("out.lod2.glb")).expect("distances");
        assert_eq!(measured.triangles, [1682, made.levels[2].triangles]);
        assert_eq!(measured.vertices, made.levels[2].distance);
        assert!(measured.surfaces.largest() <= made.levels[2].bound);

        let onto_itself = MeshRequest {
            output: Some(model.clone()),
            ..request
        };
        assert!(mesh(&onto_itself, &|_| ()).is_err());
        let _ = std::fs::remove_dir_all(model.parent().expect("its folder"));
    }
}
