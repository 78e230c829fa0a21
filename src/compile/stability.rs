//! `lodc stability`: where a shader, and the levels of its lock, leave what numbers can hold.

use super::Request;
use super::search::Ready;
use crate::emit::Lock;
use crate::eval::refusal;
use crate::stability::{self, Battery, Blamed, Hostile, Judged, Reach, Stiff, Verdict, Ways};
use crate::{Diagnostic, Result};
use lodc_passes::Recipe;
use std::fmt::Write;
use std::path::PathBuf;

/// What is looked at.
#[derive(Clone, Debug, Default)]
pub struct StabilityRequest {
    /// The shader, how it is read, its scene, and where its lock is.
    pub request: Request,
    /// A file of inputs to look at, too: what an earlier run wrote.
    pub replay: Option<PathBuf>,
    /// A file for the inputs that something fails on.
    pub record: Option<PathBuf>,
}

/// What a device made of a level.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum OnDevice {
    /// It was asked.
    Asked {
        /// About so many inputs.
        inputs: usize,
        /// The level fails on so many of them, and the original does not.
        fails: usize,
    },
    /// It cannot be asked: its shader takes more than single numbers from its vertices, or fills parameters.
    Unasked,
}

/// What was found.
#[derive(Debug)]
#[non_exhaustive]
pub struct Stability {
    /// How the original stands, and those of its inputs that something is wrong with.
    pub original: Judged,
    /// The same of each level of the lock, with the autoLOD where it begins.
    pub levels: Vec<(f32, Judged)>,
    /// What becomes of NaN and infinities, of the original and of each level: nothing fails for it.
    pub hostile: Vec<Hostile>,
    /// What was found, in the user's source.
    pub findings: Vec<Box<Diagnostic>>,
    /// What is stiff in the original, and what becomes of that in each level: nothing fails for it.
    pub stiff: Vec<Box<Diagnostic>>,
    /// What should be known besides.
    pub warnings: Vec<Box<Diagnostic>>,
    /// The device that was asked, and what it made of each level; nothing where none was wanted, or none was there.
    pub device: Option<(String, Vec<(f32, OnDevice)>)>,
    /// What is to be written.
    pub files: super::Files,
}

impl Stability {
    /// A line for the original and for each level.
    pub fn table(&self) -> String {
        let levels = self.levels.iter();
        let levels = levels.map(|(autolod, judged)| (format!("autoLOD {autolod}"), judged));
        let all = std::iter::once(("original".to_owned(), &self.original)).chain(levels);
        let mut text = String::new();
        let mut told = String::new();
        for (at, (title, judged)) in all.enumerate() {
            let _ = writeln!(text, "  {title:<16}{}", judged.says());
            if let Some(hostile) = self.hostile.get(at) {
                let _ = writeln!(told, "  {title:<16}{}", hostile.says());
            }
        }
        if let Some((name, levels)) = &self.device {
            let _ = writeln!(told, "  on {name}");
            for (autolod, found) in levels {
                let title = format!("autoLOD {autolod}");
                let says = match found {
                    OnDevice::Asked { inputs, fails: 0 } => {
                        format!("finite on all of {inputs} inputs on which the original is")
                    }
                    OnDevice::Asked { inputs, fails } => {
                        format!(
                            "not finite on {fails} of {inputs} inputs, on which the original is"
                        )
                    }
                    OnDevice::Unasked => "single inputs cannot be handed to it".to_owned(),
                };
                let _ = writeln!(told, "  {title:<16}{says}");
            }
        }
        text + &told
    }

    /// Whether a level fails where the original holds.
    pub fn fails(&self) -> bool {
        let mut levels = self.levels.iter();
        let mut on_device = self.device.iter().flat_map(|(_, levels)| levels);
        levels.any(|(_, judged)| judged.verdict == Verdict::Unstable)
            || on_device.any(|(_, found)| matches!(found, OnDevice::Asked { fails: 1.., .. }))
    }
}

/// Looks for inputs on which a shader, or a level of the lock beside it, is not finite.
///
/// # Errors
/// As [`super::compile`]; when the lock is there and stale; when the file of inputs cannot be read.
pub fn stability(asked: &StabilityRequest) -> Result<Stability> {
    let request = &asked.request;
    let ready = Ready::read(request)?;
    let vertex = ready.vertex()?;
    ready.ends(&vertex)?;
    let stand = ready.stand(&vertex);
    let refused = |refused| refusal(&refused, &ready.source);
    let mut battery = Battery::new(&stand).map_err(refused)?;
    if let Some(path) = &asked.replay {
        battery.replay(&crate::front::read_text(path, "file of inputs")?, path)?;
    }
    let original = battery.original_alone();
    let lint = battery.lint();
    let diagnostic = |blamed: &Blamed| blamed.diagnostic(&ready.base, &ready.source);
    let mut findings: Vec<Box<Diagnostic>> = lint.iter().map(|(b, _)| diagnostic(b)).collect();
    let ways = Ways::new(&stand).map_err(refused)?;
    let stiffness = |stiff: &Stiff| stiff.diagnostic(&ready.base, &ready.source);
    let mut stiff: Vec<Box<Diagnostic>> = ways.of_original().iter().map(stiffness).collect();
    let mut worst: Vec<_> = lint.into_iter().map(|(_, failure)| failure).collect();
    let own = ready.scene.warnings.iter().cloned();
    let mut warnings: Vec<Box<Diagnostic>> = own.map(Box::new).collect();
    // Whoever names an adapter wants that one.
    let mut watch = ready.watch(request)??;
    let mut on_device = Vec::new();
    let mut levels = Vec::new();
    let mut hostile = vec![battery.hostile_inputs(&ready.base).map_err(refused)?];
    if request.lock().is_file() {
        let (lock, text) = Lock::read(&request.lock())?;
        let name = request.lock().display().to_string();
        let shaders = lock.replay(&ready.base, &name, &text)?;
        for (level, emitted) in lock.levels.iter().zip(&shaders) {
            let judged = battery.judge_and_hunt(&emitted.shader);
            let judged = judged.map_err(refused)?;
            let steps = lock.exact.0.iter().chain(&level.recipe.0);
            let whole = Recipe(steps.cloned().collect());
            if let Some(failure) = judged.failures.first() {
                let blamed = battery.blame((&ready.base, &whole), failure);
                findings.push(diagnostic(&blamed));
                worst.push(failure.clone());
            }
            if let Some(watch) = &mut watch {
                let of = (&ready.base, &whole);
                let found = battery.on_device(watch, of, &emitted.shader, &judged.near);
                let blamed = found.as_ref().and_then(|found| found.blamed.as_ref());
                findings.extend(blamed.map(&diagnostic));
                let found = found.map_or(OnDevice::Unasked, |found| OnDevice::Asked {
                    inputs: found.inputs,
                    fails: found.fails,
                });
                on_device.push((level.autolod, found));
            }
            let changed = ways.compare((&ready.base, &whole), &emitted.shader);
            for changed in changed.map_err(refused)? {
                let found = stiffness(&changed);
                let note = format!("from autoLOD {} on", level.autolod);
                stiff.push(found.with_note(note));
            }
            let of_level = battery.hostile_inputs(&emitted.shader);
            hostile.push(of_level.map_err(refused)?);
            levels.push((level.autolod, judged));
        }
    }
    let mut files = super::Files::new();
    if let Some(path) = &asked.record {
        files.push((path.clone(), battery.recorded(&worst).into_bytes()));
    }
    if let Some(watch) = &watch {
        warnings.extend(watch.warnings(&[]));
    }
    Ok(Stability {
        original,
        levels,
        hostile,
        findings,
        stiff,
        warnings,
        device: watch.map(|watch| (stability::Device::name(&watch).to_owned(), on_device)),
        files,
    })
}

impl Reach {
    /// Whether pictures of the scene show it.
    pub fn is_seen(self) -> bool {
        self == Self::Reachable
    }
}
