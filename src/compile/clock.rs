//! The clock of a search: variants as text, timed on a device, found in what was timed before, or found in recordings.
//!
//! ```text
//! Shader --emit--> text --Key--> recording, cache, or a device in a child process --> Timing
//! ```

use super::search::Ready;
use super::textures::{self, Made};
use super::{Recorded, Request, RunTime};
use crate::emit::{self, EmitLevel, Form, Output};
use crate::front::Source;
use crate::scene::Scene;
use crate::search::Level;
use crate::stability::{self, Asked};
use crate::time::clock::Clock;
use crate::time::handed_over;
use crate::time::model::{Calibration, Model};
use crate::time::store::{Key, Recording};
use crate::time::{Timing, TimingWarning, Verdict};
use crate::{Diagnostic, Result};
use lodc_mesh::Mesh;
use lodc_passes::Shader;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

#[cfg(feature = "gpu")]
use super::Measuring;
#[cfg(feature = "gpu")]
use crate::gpu::worker::{Subject, Variant, Worker};
#[cfg(feature = "gpu")]
use crate::time::store::{Cache, MOST};

/// What times the variants of one shader in its scene.
pub(super) struct Watch<'a> {
    source: &'a Source,
    scene: &'a Scene,
    /// The hash of all that is drawn beside the variant.
    drawn: Key,
    adapters: Vec<String>,
    /// What ranks variants before they are timed.
    model: Model,
    taken: Taken,
    /// What was timed, and where it was found.
    pub(super) counts: Timings,
    /// What could not be timed, said once each.
    problems: BTreeSet<String>,
}

/// How many timings there were.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Timings {
    /// Taken on the device.
    pub taken: usize,
    /// Found in the cache, or in recordings.
    pub found: usize,
    /// That nobody could give.
    pub missing: usize,
}

/// Where timings come from.
enum Taken {
    #[cfg(feature = "gpu")]
    Device(Box<Device>),
    Recordings(Vec<Recording>),
}

#[cfg(feature = "gpu")]
struct Device {
    worker: Worker,
    subject: Subject,
    measuring: Measuring,
    cache: Option<Cache>,
    /// All that was timed here.
    recording: Recording,
    /// Where textures and meshes are handed over that were made for variants; it goes with this.
    folder: PathBuf,
}

#[cfg(feature = "gpu")]
impl Drop for Device {
    fn drop(&mut self) {
        // It is there only when something was made.
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

/// A text that is timed.
struct Text {
    text: String,
    /// What `autoLOD` is in it, where it chooses by that.
    auto_lod: Option<f64>,
    /// The textures that were made for it.
    made: Vec<Made>,
    /// The mesh that it is drawn on, where that is not the scene's own.
    mesh: Option<MeshFile>,
}

/// A mesh as it is handed to a device.
#[derive(Clone)]
struct MeshFile {
    #[cfg_attr(
        not(feature = "gpu"),
        allow(dead_code, reason = "recordings know it by its hash")
    )]
    bytes: Vec<u8>,
    hash: String,
}

impl Ready {
    /// The clock that a request asks for; none where times are estimated. What keeps it from being used comes by itself: a search goes
    /// on with estimates.
    pub(super) fn watch(
        &self,
        request: &Request,
    ) -> Result<std::result::Result<Option<Watch<'_>>, Box<Diagnostic>>> {
        let model = match &request.model {
            Some(file) => Calibration::read(file)?.model,
            None => Model::estimated(),
        };
        let watch = |adapters, taken| Watch {
            source: &self.source,
            scene: &self.scene,
            drawn: self.drawn(),
            adapters,
            model,
            taken,
            counts: Timings::default(),
            problems: BTreeSet::new(),
        };
        match &request.time {
            RunTime::Estimated => Ok(Ok(None)),
            RunTime::Recorded(Recorded { files }) => {
                let all = files.iter().map(|file| Recording::read(file));
                let all: Vec<Recording> = all.collect::<Result<_>>()?;
                let adapters = all.iter().map(|recording| recording.adapter.clone());
                let adapters = adapters.collect();
                let taken = Taken::Recordings(all);
                Ok(Ok(Some(watch(adapters, taken))))
            }
            #[cfg(feature = "gpu")]
            RunTime::Measured(measuring) => Ok(match self.device(measuring) {
                Ok(device) => {
                    let adapters = vec![device.recording.adapter.clone()];
                    Ok(Some(watch(adapters, Taken::Device(Box::new(device)))))
                }
                Err(error) => Err(error),
            }),
            #[cfg(not(feature = "gpu"))]
            RunTime::Measured(_) => {
                let error = Diagnostic::error("this lodc was built without the feature `gpu`");
                Ok(Err(error))
            }
        }
    }

    #[cfg(feature = "gpu")]
    fn device(&self, measuring: &Measuring) -> Result<Device> {
        let adapter = measuring.adapter.clone();
        let program = measuring.program.clone();
        let mut worker = Worker::new(program, adapter.clone(), PATIENCE);
        let name = worker.label();
        let name = name.map_err(|failure| failure.diagnostic(adapter.as_deref()))?;
        let cache = measuring.cache.as_ref();
        let cache = cache.map(|folder| Cache::new(folder, &name));
        if let Some(cache) = &cache {
            cache.sweep(MOST);
        }
        Ok(Device {
            worker,
            subject: Subject::new(
                self.request.shader.clone(),
                self.scene_file.clone(),
                &self.request.stages,
                &self.request.modules,
            ),
            measuring: measuring.clone(),
            cache,
            recording: Recording::new(&name),
            folder: std::env::temp_dir().join(format!("lodc-{}", std::process::id())),
        })
    }

    /// The hash of everything that decides what is drawn, but the variant and the distance.
    fn drawn(&self) -> Key {
        let inputs = self.scene.inputs.iter().map(|input| input.hash.clone());
        let definitions = self.request.modules.definitions.iter();
        let stages = [
            self.source.vertex.clone(),
            Some(self.source.fragment.clone()),
        ];
        let words: Vec<String> = inputs
            .chain(stages.into_iter().map(Option::unwrap_or_default))
            .chain(definitions.map(ToString::to_string))
            .collect();
        Key::of(words.iter().map(String::as_bytes))
    }
}

/// How long a device may be silent: a timing, with the compilation of its shaders. Software takes its time.
#[cfg(feature = "gpu")]
const PATIENCE: std::time::Duration = std::time::Duration::from_secs(120);

#[cfg(feature = "gpu")]
fn unwritten(error: &std::io::Error) -> String {
    format!("a texture or a mesh cannot be written for the device: {error}")
}

pub(super) fn untimed(error: &Diagnostic) -> Box<Diagnostic> {
    let mut warning = Diagnostic::warning(format!(
        "nothing was timed, and all times are estimated: {}",
        error.message
    ));
    warning.notes.clone_from(&error.notes);
    warning
}

impl Watch<'_> {
    /// A variant as a text of its own, where it can be written.
    fn text(&mut self, shader: &Shader) -> Option<Text> {
        let text = emit::variant(self.source, shader).and_then(|(text, textures)| {
            Ok(Text {
                text,
                auto_lod: None,
                made: textures::make(self.scene, &textures)?,
                mesh: None,
            })
        });
        match text {
            Ok(text) => Some(text),
            Err(error) => {
                self.problems.insert(error.message);
                None
            }
        }
    }

    /// Times texts against the original at a distance; for each one timing for each adapter, or none at all.
    fn take(&mut self, texts: &[Option<Text>], distance: f64) -> Vec<Vec<Timing>> {
        let drawn = self.drawn.to_string();
        let key = |text: &Text, effort: &[u8]| {
            let auto_lod = text.auto_lod.map_or([0; 8], f64::to_le_bytes);
            let distance = distance.to_le_bytes();
            let fixed = [
                drawn.as_bytes(),
                text.text.as_bytes(),
                &auto_lod,
                &distance,
                effort,
            ];
            let made = text.made.iter().map(|made| made.locked.hash.as_bytes());
            let mesh = text.mesh.iter().map(|mesh| mesh.hash.as_bytes());
            Key::of(fixed.into_iter().chain(made).chain(mesh))
        };
        let timings: Vec<Vec<Timing>> = match &mut self.taken {
            Taken::Recordings(recordings) => texts
                .iter()
                .map(|text| {
                    let key = key(text.as_ref()?, b"");
                    let each = recordings.iter().map(|of| of.timings.get(&key).cloned());
                    each.collect::<Option<Vec<Timing>>>()
                })
                .map(|found| {
                    self.counts.found += usize::from(found.is_some());
                    found.unwrap_or_default()
                })
                .collect(),
            #[cfg(feature = "gpu")]
            Taken::Device(device) => {
                let effort = serde_json::to_vec(&device.measuring.effort).unwrap_or_default();
                let keys: Vec<Option<[Key; 2]>> = (texts.iter())
                    .map(|text| {
                        text.as_ref()
                            .map(|text| [key(text, b""), key(text, &effort)])
                    })
                    .collect();
                device.take(texts, &keys, distance, &mut self.counts, &mut self.problems)
            }
        };
        self.counts.missing += timings.iter().filter(|of| of.is_empty()).count();
        timings
    }

    /// Times the text that holds all levels and branches by a uniform, at each level.
    pub(super) fn branches(&mut self, base: &Shader, levels: &mut [Level], emitted: &[EmitLevel]) {
        let output = Output {
            form: Form::Uniform,
            ..Output::default()
        };
        let timed = levels.iter_mut().filter(|level| !level.timed.is_empty());
        let timed: Vec<&mut Level> = timed.collect();
        let at: Vec<(f64, f64)> = (timed.iter())
            .map(|level| (level.autolod, level.distance))
            .collect();
        let whole = self.whole((base, emitted), output, &at);
        for (level, timings) in timed.into_iter().zip(whole) {
            level.branching = timings;
        }
    }

    /// Times the text that holds all levels at values of autoLOD and distances; nothing where there is no such text.
    pub(super) fn whole(
        &mut self,
        (base, emitted): (&Shader, &[EmitLevel]),
        output: Output,
        at: &[(f64, f64)],
    ) -> Vec<Vec<Timing>> {
        let text = emit::emit_as(self.source, base, emitted, output, "variant").and_then(|files| {
            let mut files = files.into_iter();
            let is_shader = |name: &Path| name.extension().is_some_and(|e| e == "wgsl");
            let text = files.find(|(name, _)| is_shader(name));
            let text = text.and_then(|(_, bytes)| String::from_utf8(bytes).ok());
            let textures = emit::generated_textures(self.source, emitted, output.form)?;
            Ok(Text {
                text: text.unwrap_or_default(),
                auto_lod: None,
                made: textures::make(self.scene, &textures)?,
                mesh: None,
            })
        });
        let mut text = match text {
            Ok(text) => [Some(text)],
            Err(error) => {
                self.problems.insert(error.message);
                return Vec::new();
            }
        };
        let mut timings = Vec::new();
        for (auto_lod, distance) in at {
            if let [Some(text)] = &mut text {
                text.auto_lod = Some(*auto_lod);
            }
            timings.extend(self.take(&text, *distance));
        }
        timings
    }

    /// What should be known: levels whose gain the branch eats, and what could not be timed.
    #[allow(clippy::vec_box, reason = "as diagnostics are handed around")]
    pub(super) fn warnings(&self, levels: &[Level]) -> Vec<Box<Diagnostic>> {
        let mut warnings = Vec::new();
        let eaten = levels.iter().enumerate().filter(|(_, level)| {
            let pairs = level.timed.iter().zip(&level.branching);
            let mut pairs = pairs.map(|(alone, branching)| (alone.verdict(), branching.verdict()));
            pairs.any(|(alone, branching)| alone == Verdict::Faster && branching != Verdict::Faster)
        });
        let eaten: Vec<String> = eaten.map(|(at, _)| at.to_string()).collect();
        if !eaten.is_empty() {
            warnings.push(
                Diagnostic::warning(format!(
                    "the branch by a uniform eats what level {} gains",
                    eaten.join(", ")
                ))
                .with_note("`--form override` and `--form files` have no branch left"),
            );
        }
        let taken = |warning| {
            let mut all = levels.iter().flat_map(|level| &level.timed);
            all.any(|timing| timing.warnings.contains(&warning))
        };
        for (warning, says) in [
            (
                TimingWarning::ClockDrift,
                "the clock of the adapter drifted while levels were timed",
            ),
            (
                TimingWarning::FewSamples,
                "the time for timing ran out before the intervals were as narrow as they should be",
            ),
            (
                TimingWarning::SoftwareAdapter,
                "times are those of a program on the CPU, and say nothing about a GPU",
            ),
            (
                TimingWarning::TimerTooCoarse,
                "the adapter's timer is too coarse for what was timed",
            ),
            (
                TimingWarning::Throttled,
                "the adapter got slower while levels were timed",
            ),
        ] {
            if taken(warning) {
                warnings.push(Diagnostic::warning(format!("{warning}: {says}")));
            }
        }
        if let Some(problem) = self.problems.iter().next() {
            let count = self.counts.missing;
            warnings.push(
                Diagnostic::warning(format!("{count} timings could not be taken: {problem}"))
                    .with_note("what they are of was chosen by estimated times"),
            );
        } else if self.counts.missing > 0 && matches!(self.taken, Taken::Recordings(..)) {
            let count = self.counts.missing;
            warnings.push(
                Diagnostic::warning(format!("{count} timings are not in the recordings"))
                    .with_note("what they are of was chosen by estimated times; a recording fits the shader, the scene and the flags that it was made with"),
            );
        }
        warnings
    }

    /// What could not be timed, and why, a line each.
    pub(super) fn problems(&self) -> impl Iterator<Item = &String> {
        self.problems.iter()
    }

    /// The recording of what was timed here, and where it is to be written.
    pub(super) fn recording(&self) -> Option<(PathBuf, String)> {
        match &self.taken {
            #[cfg(feature = "gpu")]
            Taken::Device(device) => {
                let file = device.measuring.record.clone()?;
                Some((file, device.recording.json()))
            }
            Taken::Recordings(..) => None,
        }
    }
}

impl Clock for Watch<'_> {
    fn adapters(&self) -> &[String] {
        &self.adapters
    }

    fn model(&self) -> Model {
        self.model.clone()
    }

    fn time(&mut self, variants: &[&Shader], distance: f64) -> Vec<Vec<Timing>> {
        let texts: Vec<Option<Text>> = variants.iter().map(|shader| self.text(shader)).collect();
        self.take(&texts, distance)
    }

    fn time_on(&mut self, pairs: &[(&Arc<Mesh>, &Shader)], distance: f64) -> Vec<Vec<Timing>> {
        let own = &self.scene.mesh;
        let mut files: Vec<(&Arc<Mesh>, MeshFile)> = Vec::new();
        let mut texts = Vec::new();
        for &(mesh, shader) in pairs {
            let is_own = Arc::ptr_eq(mesh, own);
            if !is_own && !files.iter().any(|(known, _)| Arc::ptr_eq(known, mesh)) {
                let bytes = handed_over::bytes(mesh);
                let hash = crate::front::hash(&bytes);
                files.push((mesh, MeshFile { bytes, hash }));
            }
            let file = files.iter().find(|(known, _)| Arc::ptr_eq(known, mesh));
            let file = file.map(|(_, file)| file.clone());
            texts.push(self.text(shader).map(|text| Text { mesh: file, ..text }));
        }
        self.take(&texts, distance)
    }

    fn device(&mut self) -> Option<&mut dyn stability::Device> {
        Some(self)
    }
}

impl stability::Device for Watch<'_> {
    fn name(&self) -> &str {
        self.adapters.first().map_or("a device", String::as_str)
    }

    fn bad(&mut self, shaders: &[&Shader], asked: &Asked) -> Option<Vec<Vec<bool>>> {
        let texts: Option<Vec<Text>> = shaders.iter().map(|shader| self.text(shader)).collect();
        let texts = texts?;
        let json = serde_json::to_vec(asked).unwrap_or_default();
        let drawn = self.drawn.to_string();
        let keys = texts
            .iter()
            .map(|text| Key::of([drawn.as_bytes(), text.text.as_bytes(), &json]));
        let keys: Vec<Key> = keys.collect();
        match &mut self.taken {
            Taken::Recordings(recordings) => {
                let of_text = |key: &Key| {
                    let mut bad = vec![false; asked.count()];
                    let known = recordings.iter().filter_map(|of| of.bad.get(key));
                    for at in known.flatten() {
                        if let Some(bad) = bad.get_mut(*at as usize) {
                            *bad = true;
                        }
                    }
                    bad
                };
                Some(keys.iter().map(of_text).collect())
            }
            #[cfg(feature = "gpu")]
            Taken::Device(device) => match device.feed(&texts, asked) {
                Ok(bad) => {
                    for (key, bad) in keys.into_iter().zip(bad.iter().flatten()) {
                        let bad = (0..).zip(bad).filter(|(_, bad)| **bad).map(|(at, _)| at);
                        let bad: Vec<u32> = bad.collect();
                        if !bad.is_empty() {
                            device.recording.bad.insert(key, bad);
                        }
                    }
                    bad
                }
                Err(problem) => {
                    self.problems.insert(problem);
                    None
                }
            },
        }
    }
}

#[cfg(feature = "gpu")]
impl Device {
    /// A text as the device is given it: what was made for it is in files.
    fn variant(&self, text: &Text) -> std::io::Result<Variant> {
        let mut made = Vec::new();
        for Made { locked, bytes } in &text.made {
            std::fs::create_dir_all(&self.folder)?;
            let hash = locked.hash.trim_start_matches("blake3:");
            let file = self.folder.join(hash);
            if !file.exists() {
                std::fs::write(&file, bytes)?;
            }
            made.push((locked.name.clone(), file));
        }
        let mut mesh = None;
        if let Some(MeshFile { bytes, hash }) = &text.mesh {
            std::fs::create_dir_all(&self.folder)?;
            let file = self.folder.join(hash.trim_start_matches("blake3:"));
            if !file.exists() {
                std::fs::write(&file, bytes)?;
            }
            mesh = Some(file);
        }
        Ok(Variant {
            text: Some(text.text.clone()),
            auto_lod: text.auto_lod,
            made,
            mesh,
        })
    }

    /// Which inputs are bad, for each text; or why it is not known.
    fn feed(
        &mut self,
        texts: &[Text],
        asked: &Asked,
    ) -> std::result::Result<Option<Vec<Vec<bool>>>, String> {
        let variants = texts.iter().map(|text| self.variant(text));
        let variants: std::io::Result<Vec<Variant>> = variants.collect();
        let variants = variants.map_err(|error| unwritten(&error))?;
        let adapter = self.measuring.adapter.as_deref();
        let bad = self.worker.feed(&self.subject, &variants, asked);
        bad.map_err(|failure| failure.diagnostic(adapter).message)
    }

    fn take(
        &mut self,
        texts: &[Option<Text>],
        keys: &[Option<[Key; 2]>],
        distance: f64,
        counts: &mut Timings,
        problems: &mut BTreeSet<String>,
    ) -> Vec<Vec<Timing>> {
        let mut timings: Vec<Option<Timing>> = Vec::new();
        for key in keys {
            let known = key.as_ref().and_then(|[short, whole]| {
                let here = self.recording.timings.get(short).cloned();
                here.or_else(|| self.cache.as_ref()?.get(whole))
            });
            counts.found += usize::from(known.is_some());
            timings.push(known);
        }
        let missing: Vec<usize> = (0..texts.len())
            .filter(|&at| timings[at].is_none() && texts[at].is_some())
            .collect();
        let mut variants = Vec::new();
        for text in missing.iter().filter_map(|&at| texts[at].as_ref()) {
            match self.variant(text) {
                Ok(variant) => variants.push(variant),
                Err(error) => {
                    problems.insert(unwritten(&error));
                    return timings
                        .into_iter()
                        .map(|timing| timing.into_iter().collect())
                        .collect();
                }
            }
        }
        if !variants.is_empty() {
            let effort = &self.measuring.effort;
            match self.worker.time(&self.subject, &variants, distance, effort) {
                Ok(taken) => {
                    for (&at, taken) in missing.iter().zip(taken) {
                        match taken {
                            Ok(timing) => {
                                counts.taken += 1;
                                if let (Some(cache), Some([_, whole])) = (&self.cache, &keys[at])
                                    && let Err(error) = cache.put(whole, &timing)
                                {
                                    problems.insert(format!(
                                        "a timing cannot be kept in `{}`: {error}",
                                        cache.folder().display()
                                    ));
                                    self.cache = None;
                                }
                                timings[at] = Some(timing);
                            }
                            Err(failure) => {
                                let adapter = self.measuring.adapter.as_deref();
                                problems.insert(failure.diagnostic(adapter).message);
                            }
                        }
                    }
                }
                Err(failure) => {
                    let error = failure.diagnostic(self.measuring.adapter.as_deref());
                    problems.insert(error.message.clone());
                }
            }
        }
        for (key, timing) in keys.iter().zip(&timings) {
            if let (Some([short, _]), Some(timing)) = (key, timing) {
                let timings = &mut self.recording.timings;
                timings
                    .entry(short.clone())
                    .or_insert_with(|| timing.clone());
            }
        }
        timings
            .into_iter()
            .map(|timing| timing.into_iter().collect())
            .collect()
    }
}
