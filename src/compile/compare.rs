//! One shader held against another: the error of the second, with the first as the original.
//!
//! Both are drawn in one scene, each with its own stages and its own bindings, by the machinery that measures levels. A
//! shader that was emitted is given the `autoLOD` of each distance, so that it draws the level that a host would choose.

use super::search::{Read, Ready, vertex_program};
use super::{Files, Request, normal_form};
use crate::emit::control::{self, pipeline_constant};
use crate::emit::{figure, writable};
use crate::error::ErrorFigures;
use crate::eval::image::{encode_png, to_byte};
use crate::eval::program::{Program, Refused};
use crate::eval::programs::Stand;
use crate::eval::refusal;
use crate::front::Source;
#[cfg(feature = "gpu")]
use crate::gpu::{Gpu, Stages};
use crate::report::{ComparedAt, Comparison, Input};
use crate::scene::Scene;
#[cfg(feature = "gpu")]
use crate::search::drawn::{Compiled, Device};
use crate::search::{Measured, OverBlack, SampleSet, Samples, threshold};
use crate::{Diagnostic, Result};
use lodc_passes::autolod;
use naga::back::pipeline_constants::process_overrides;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// What is compared, and where from.
#[derive(Clone, Debug, Default)]
pub struct CompareRequest {
    /// The original, how it is read, its scene, and how errors are held against the bound. Entry points, modules and a
    /// vertex file go for the other shader too, as far as it has no vertex stage of its own.
    pub original: Request,
    /// The shader whose error it is.
    pub other: PathBuf,
    /// The distances; by default that of `autolod`, else those of the scene.
    pub at: Vec<f64>,
    /// The other shader's `autoLOD`; by default that of each distance.
    pub autolod: Option<f64>,
    /// The folder that pictures are written to.
    pub images: Option<PathBuf>,
    /// What draws.
    pub renderer: DrawnBy,
}

/// What draws the pictures that are compared.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum DrawnBy {
    /// The evaluator, on the CPU.
    #[default]
    Evaluator,
    /// The best GPU, or the one that a part of its name is given of.
    #[cfg(feature = "gpu")]
    Gpu {
        /// Words of the adapter's label.
        adapter: Option<String>,
    },
}

/// What a comparison gives.
#[derive(Debug)]
#[non_exhaustive]
pub struct Compared {
    /// The pictures, to be written.
    pub files: Files,
    /// What was found.
    pub comparison: Comparison,
    /// What should be known, located.
    pub warnings: Vec<Box<Diagnostic>>,
}

/// How much larger differences are drawn.
const GAIN: u8 = 4;

/// Compares two shaders. `goes_on` is called whenever another picture has been drawn, or several.
///
/// # Errors
/// When an input cannot be read or is wrong, at its place; when the shaders do not fit one scene; when a distance or a
/// level of detail is none; when the GPU that is asked for is not there, or cannot draw them.
pub fn compare(request: &CompareRequest, goes_on: &dyn Fn()) -> Result<Compared> {
    let (a, mut b) = read(request)?;
    let vertex = a.vertex()?;
    a.ends(&vertex)?;
    b.ends(&b.vertex()?)?;
    if let Some(folder) = &request.images {
        // What cannot be written should be known before pictures are drawn.
        writable(&[(folder.join("a.png"), Vec::new())])?;
    }
    let chooses = chooses(&b);
    let mut files = Files::new();
    let mut distances = Vec::new();
    let judge = Judge::evaluator(&a, &vertex);
    #[cfg(feature = "gpu")]
    let gpu = match &request.renderer {
        DrawnBy::Gpu { adapter } => Some(Gpu::open(adapter.as_deref())?),
        DrawnBy::Evaluator => None,
    };
    #[cfg(feature = "gpu")]
    let judge = match &gpu {
        Some(gpu) => Judge::gpu(gpu, &a)?,
        None => judge,
    };
    let mut judge = judge;
    for distance in distances_of(request, &a.scene)? {
        // As thresholds are rounded, so that a level is seen where it starts.
        let wanted = request
            .autolod
            .unwrap_or_else(|| threshold(&a.scene, distance));
        b.scene.set_auto_lod(wanted);
        let other = (&specialised(&b.source, wanted)?, &b.scene);
        let judged = judge.judge(other, distance, request.images.is_some(), goes_on)?;
        let at = (distance, chooses.then_some(wanted));
        let measured = judged.measured.as_ref();
        distances.push(ComparedAt::new(at, &judged.error, judged.flip, measured));
        if let (Some(folder), Some(pictures)) = (&request.images, judged.pictures) {
            files.extend(sheets(folder, distance, &pictures)?);
        }
    }
    let adapter = judge.adapter();
    let inputs: Vec<PathBuf> = a.inputs(&a.request).chain(b.inputs(&b.request)).collect();
    request.original.spare(&files, &inputs)?;
    let warnings = warnings(request, &a.scene, &b.scene, chooses);
    Ok(Compared {
        comparison: comparison(request, (&a, &b), adapter, distances, &warnings),
        files,
        warnings: warnings.into_iter().map(Box::new).collect(),
    })
}

/// What was measured of the other shader at a distance.
struct Judged {
    error: ErrorFigures,
    flip: f64,
    /// Executed work of a covered fragment of the original and of the other, where it is counted.
    measured: Option<[Measured; 2]>,
    /// Of the original and of the other, when they are wanted.
    pictures: Option<[Vec<OverBlack>; 2]>,
}

/// What measures: a renderer with the original.
enum Judge<'a> {
    Evaluator {
        original: Stand<'a>,
    },
    #[cfg(feature = "gpu")]
    Gpu {
        device: Box<Device<'a>>,
        original: Box<Compiled<'a>>,
    },
}

impl<'a> Judge<'a> {
    fn evaluator(a: &'a Ready, vertex: &'a Program) -> Self {
        Self::Evaluator {
            original: Stand {
                base: &a.base,
                vertex,
                scene: &a.scene,
            },
        }
    }

    #[cfg(feature = "gpu")]
    fn gpu(gpu: &'a Gpu, a: &'a Ready) -> Result<Self> {
        let device = Box::new(Device::new(gpu)?);
        let original = device.compile(stages(&a.source, &a.scene)?, &a.scene)?;
        Ok(Self::Gpu {
            device,
            original: Box::new(original),
        })
    }

    /// The adapter's label, where there is one.
    fn adapter(&self) -> Option<String> {
        match self {
            Self::Evaluator { .. } => None,
            #[cfg(feature = "gpu")]
            Self::Gpu { device, .. } => Some(device.gpu().label().to_string()),
        }
    }

    /// Measures a shader in its scene at a distance.
    fn judge(
        &mut self,
        (source, scene): (&Source, &Scene),
        distance: f64,
        wants_pictures: bool,
        goes_on: &dyn Fn(),
    ) -> Result<Judged> {
        match self {
            Self::Evaluator { original } => {
                let base = normal_form(source)?;
                let vertex =
                    vertex_program(scene, &base).map_err(|refused| refusal(&refused, source))?;
                let other = Stand {
                    base: &base,
                    vertex: &vertex,
                    scene,
                };
                let judged = evaluated([original, &other], distance, wants_pictures);
                goes_on();
                // The original has been compiled once; what is refused by now is the other's.
                judged.map_err(|refused| refusal(&refused, source))
            }
            #[cfg(feature = "gpu")]
            Self::Gpu { device, original } => {
                let other = device.compile(stages(source, scene)?, scene)?;
                let (error, flip) = device.compare([&**original, &other], distance, goes_on)?;
                let pictures = match wants_pictures {
                    true => Some([
                        device.pictures(original, distance, goes_on)?,
                        device.pictures(&other, distance, goes_on)?,
                    ]),
                    false => None,
                };
                Ok(Judged {
                    error,
                    flip,
                    measured: None,
                    pictures,
                })
            }
        }
    }
}

/// What the evaluator measures of the second shader.
fn evaluated(
    stands: [&Stand<'_>; 2],
    distance: f64,
    wants_pictures: bool,
) -> std::result::Result<Judged, Refused> {
    let [a, b] = SampleSet::of_two(stands, distance, Samples::Full)?;
    let [original, other] = stands.map(|stand| stand.base);
    Ok(Judged {
        error: b.figures(other)?,
        flip: b.flip(other)?,
        measured: Some([a.original(), b.measure(other)?]),
        pictures: match wants_pictures {
            true => Some([a.pictures(original)?, b.pictures(other)?]),
            false => None,
        },
    })
}

/// The stages that a device draws, as they are written.
#[cfg(feature = "gpu")]
fn stages<'s>(source: &'s Source, scene: &'s Scene) -> Result<Stages<'s>> {
    Stages::of_source(source, scene)
        .ok_or_else(|| Diagnostic::error(format!("`{}` has no vertex stage", source.name)))
}

/// Both shaders, each with the scene as it is for that shader.
fn read(request: &CompareRequest) -> Result<(Ready, Ready)> {
    let a = Read::new(&request.original)?;
    let of_b = Request {
        shader: request.other.clone(),
        ..request.original.clone()
    };
    let b = Read::beside(&of_b, a.scene_file.clone())?;
    let scene_file = a.scene_file.as_deref();
    let (scene_of_a, scene_of_b) = Scene::read_both(&a.source, &b.source, scene_file)?;
    Ok((a.ready(scene_of_a), b.ready(scene_of_b)))
}

/// Whether a shader's level is chosen by `autoLOD`.
fn chooses(ready: &Ready) -> bool {
    pipeline_constant(&ready.source.module).is_some() || ready.scene.has_auto_lod()
}

/// The distances that are looked at, nearest first.
fn distances_of(request: &CompareRequest, scene: &Scene) -> Result<Vec<f64>> {
    let wrong = |option: &str, value: f64, wants: &str, way: &str| {
        Err(Diagnostic::error(format!("`{option} {value}` is {wants}")).with_note(way))
    };
    if let Some(value) = request
        .autolod
        .filter(|value| !(0.0..=MOST_HALVINGS).contains(value))
    {
        return wrong(
            "--autolod",
            value,
            "no level of detail",
            "it counts halvings of scale on screen since the nearest distance: 0 to 64",
        );
    }
    let inside = |distance: &&f64| !(distance.is_finite() && **distance > scene.sphere.radius);
    if let Some(&value) = request.at.iter().find(inside) {
        let radius = figure(scene.sphere.radius);
        let way = format!(
            "a distance is from the eye to the centre of the object's bounding sphere, whose radius is {radius}; the scene's are {} to {}",
            figure(scene.nearest),
            figure(scene.farthest)
        );
        return wrong("--at", value, "no distance outside of the object", &way);
    }
    let mut distances = match (request.at.as_slice(), request.autolod) {
        ([], Some(value)) => {
            let view = scene.view(scene.nearest);
            vec![autolod::distance_of(value, scene.rho0(), &view)]
        }
        ([], None) => scene.distances.clone(),
        (at, _) => at.to_vec(),
    };
    distances.sort_by(f64::total_cmp);
    distances.dedup();
    Ok(distances)
}

/// The most halvings of scale that are asked for: by then nothing is left of any object.
const MOST_HALVINGS: f64 = 64.0;

/// A source with its pipeline constant `autoLOD` set, if it has one.
fn specialised(source: &Source, autolod: f64) -> Result<Source> {
    let Some((handle, key)) = pipeline_constant(&source.module) else {
        return Ok(source.clone());
    };
    let constants = [(key, autolod)].into_iter().collect();
    let made = process_overrides(&source.module, &source.info, None, &constants);
    let (module, info) = made.map_err(|error| {
        let at = source.module.overrides.get_span(handle);
        source
            .error(
                format!("the pipeline constants cannot be set: {error}"),
                at,
                "",
            )
            .with_note("give each `override` a default")
    })?;
    Ok(Source {
        module: module.into_owned(),
        info: info.into_owned(),
        ..source.clone()
    })
}

/// The pictures of a distance as files: for each view the original's, the other's, and their difference.
fn sheets(folder: &Path, distance: f64, [a, b]: &[Vec<OverBlack>; 2]) -> Result<Files> {
    let mut files = Files::new();
    for (view, (a, b)) in a.iter().zip(b).enumerate() {
        let difference: Vec<[f32; 3]> = a.pixels.iter().zip(&b.pixels).map(apart).collect();
        let three = [
            ("a", &a.pixels),
            ("b", &b.pixels),
            (&*format!("difference_x{GAIN}"), &difference),
        ];
        for (what, pixels) in three {
            let bytes = pixels
                .iter()
                .map(|[r, g, b]| [to_byte(*r), to_byte(*g), to_byte(*b), 255]);
            let bytes: Vec<[u8; 4]> = bytes.collect();
            let name = format!("{}_view{}_{what}.png", figure(distance), view + 1);
            files.push((folder.join(name), encode_png(a.width, a.height, &bytes)?));
        }
    }
    Ok(files)
}

/// How far apart two colours are, enlarged. A NaN is as far as can be.
fn apart((a, b): (&[f32; 3], &[f32; 3])) -> [f32; 3] {
    std::array::from_fn(|i| match a[i].is_nan() || b[i].is_nan() {
        true => 1.0,
        false => f32::from(GAIN) * (a[i] - b[i]).abs(),
    })
}

/// What should be known of the scenes, each thing once.
fn warnings(request: &CompareRequest, a: &Scene, b: &Scene, chooses: bool) -> Vec<Diagnostic> {
    let mut said = BTreeSet::new();
    let all = a.warnings.iter().chain(&b.warnings);
    let once = all.filter(|warning| said.insert(&warning.message));
    let mut warnings: Vec<_> = once.cloned().collect();
    if request.autolod.is_some() && !chooses {
        let other = request.other.display();
        let does = match request.at.as_slice() {
            [] => "it only says how far away the eye is",
            _ => "it changes nothing",
        };
        warnings.push(
            *Diagnostic::warning(format!("`{other}` declares no `{}`: {does}", control::NAME))
                .with_note("a shader that lodc emitted has one, unless it has the form `files`"),
        );
    }
    warnings
}

fn comparison(
    request: &CompareRequest,
    (a, b): (&Ready, &Ready),
    adapter: Option<String>,
    distances: Vec<ComparedAt>,
    warnings: &[Diagnostic],
) -> Comparison {
    let mut inputs: Vec<Input> = a.read_files();
    for input in b.read_files() {
        if !inputs.iter().any(|known| known.file == input.file) {
            inputs.push(input);
        }
    }
    let mut inferences = a.inferred();
    for inference in b.inferred() {
        if !inferences.contains(&inference) {
            inferences.push(inference);
        }
    }
    Comparison {
        version: env!("CARGO_PKG_VERSION"),
        command: request.original.command.clone(),
        original: a.source.name.clone(),
        other: b.source.name.clone(),
        scene: a.scene.name.clone(),
        renderer: match adapter {
            Some(_) => "gpu",
            None => "evaluator",
        },
        adapter,
        seed: a.scene.seed,
        inputs,
        rho0: a.scene.rho0(),
        pixels_per_degree: a.scene.pixels_per_degree,
        bound: a.scene.reading.name(),
        distances,
        warnings: warnings.iter().map(|w| w.message.clone()).collect(),
        inferences,
    }
}
