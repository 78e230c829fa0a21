//! Numerical stability: a variant must not blow up where its original holds.
//!
//! ```text
//! Scene x interface --inputs--> exhibits          what pictures show, and what the interface allows beyond them
//! original, variant x exhibit --run, rounding--> which fragments are not finite, under nine arithmetics
//! variant x exhibits --hunt--> new exhibits       inputs that go down on the margins of obligations
//! variant x inputs near trouble --asked--> whether a device fails on them
//! failure x recipe --blame--> candidate, operation, input, value in f32 and f64
//! ```
//!
//! The law: where the original is finite and within its target's range on reachable and declared inputs, so is the variant,
//! in the evaluator's own arithmetic and in eight whose roundings are as bad as WGSL lets them be; no divisor of the
//! variant changes its sign where the same one of the original has one sign only; and no operation comes much closer to
//! trouble than the same one of the original, unless it is safe all the same.
//! How often something happens is not proved by not seeing it: with n inputs and no failure the rate is below 3/n at 95 %
//! confidence, for inputs like these (Hanley and Lippman-Hand, "If nothing goes wrong, is everything all right?", 1983).

mod asked;
mod blame;
mod fed;
mod hostile;
mod hunt;
mod inputs;
mod law;
mod obligations;
mod run;
mod stiff;

pub use asked::{Asked, Device, OnDevice};
pub use blame::{Blamed, Number};
pub use fed::Fed;
pub use hostile::Hostile;
pub use hunt::Hunt;
pub use law::Breach;
pub use run::Failure;
pub use stiff::{Change, Stiff, Ways};

use crate::eval::program::Refused;
use crate::eval::programs::{Programs, Stand};
use crate::eval::raster::{Coverage, Frame, rasterize};
use crate::eval::rough::Arithmetic;
use crate::scene::Split;
use inputs::{Group, Interface};
use law::{Operands, Paths};
use lodc_passes::{Recipe, Shader, Stage};
use rayon::prelude::*;
use run::{Bad, Subject};
use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError};

/// Groups of declared inputs.
const GROUPS: usize = 24;
/// Pictures of the scene that reachable inputs are of, and squares of 2 x 2 pixels of each.
const PICTURES: usize = 8;
const SQUARES: usize = inputs::QUADS;
/// Fragments of an exhibit that a lint explains.
const LINTED: usize = 2;

/// Where inputs come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Reach {
    /// From pictures of the scene.
    Reachable,
    /// From what the interface and the scene's ranges allow.
    Declared,
}

impl Reach {
    /// In a word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Reachable => "reachable",
            Self::Declared => "declared",
        }
    }
}

/// Inputs that are run together: they share their uniforms.
#[derive(Clone)]
pub(crate) struct Exhibit {
    /// What uniforms and textures hold, and the triangles.
    frame: Frame,
    inputs: Inputs,
    /// Where what comes from the vertices of the original is no number already: what a fragment makes of that is its own affair.
    /// Under each arithmetic.
    hostile: Vec<Bad>,
    /// Where the original is bad, or its input is, under each arithmetic.
    original: Vec<Bad>,
}

#[derive(Clone)]
enum Inputs {
    /// Fragments of a picture.
    Seen(Box<Coverage>),
    /// Declared ones.
    Made(Group),
}

impl Exhibit {
    fn reach(&self) -> Reach {
        match self.inputs {
            Inputs::Seen(_) => Reach::Reachable,
            Inputs::Made(_) => Reach::Declared,
        }
    }
}

/// What a shader is held against: inputs, and what the original makes of them.
pub struct Battery<'a> {
    stand: &'a Stand<'a>,
    interface: Interface<'a>,
    original: Subject,
    arithmetics: Vec<Arithmetic>,
    exhibits: Vec<Exhibit>,
    /// What the operations of the original are given.
    operands: Operands,
    /// The largest number that the target holds.
    most: f32,
    /// What variants failed on: asked first.
    hazards: Mutex<Vec<Failure>>,
}

/// How a shader stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Nothing was found against it.
    Stable,
    /// It fails where the original fails, and nowhere else.
    OriginalToo,
    /// It fails where the original holds.
    Unstable,
}

impl Verdict {
    /// In a word, as in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Stable => "stable",
            Self::OriginalToo => "unstable in the original too",
            Self::Unstable => "unstable",
        }
    }
}

/// What was found of a shader.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Judged {
    /// How it stands.
    pub verdict: Verdict,
    /// How many inputs there were.
    pub inputs: u64,
    /// On how many of them the original fails by itself.
    pub of_original: u64,
    /// Where it fails and the original does not; one for each arithmetic and each place in the shader at most.
    pub failures: Vec<Failure>,
    /// What a hunt found near trouble: for a device to be asked about.
    pub near: Asked,
}

impl Judged {
    /// What having found nothing proves: the rate of failures is below this at 95 % confidence.
    pub fn rate(&self) -> f64 {
        3.0 / self.inputs.max(1) as f64
    }

    /// The verdict, with what it rests on.
    pub fn says(&self) -> String {
        let (inputs, rate) = (self.inputs, self.rate());
        let own = self.of_original;
        match self.verdict {
            Verdict::Stable => {
                format!("stable: no failure in {inputs} inputs (under {rate:.1e} at 95 %)")
            }
            Verdict::OriginalToo => format!(
                "unstable in the original too, on {own} of {inputs} inputs; nothing was added (under {rate:.1e} at 95 %)"
            ),
            Verdict::Unstable => {
                format!("unstable: it fails where the original holds, of {inputs} inputs")
            }
        }
    }
}

impl<'a> Battery<'a> {
    /// Makes the inputs, and runs the original over them.
    ///
    /// # Errors
    /// When the evaluator refuses the original.
    pub fn new(stand: &'a Stand<'a>) -> Result<Self, Refused> {
        let scene = stand.scene;
        let interface = Interface::new(scene, scene.seed ^ 0x57ab);
        let original = Subject::new(Programs::of(stand.base)?);
        let mut arithmetics = vec![Arithmetic::OWN];
        arithmetics.extend(Arithmetic::allowed(scene.seed));
        let mut battery = Self {
            stand,
            original,
            arithmetics,
            exhibits: Vec::new(),
            operands: Operands::default(),
            most: match scene.output {
                crate::scene::Output::Linear { .. } => 65504.0,
                _ => f32::MAX,
            },
            hazards: Mutex::new(Vec::new()),
            interface,
        };
        let mut pictures = Vec::new();
        let near = battery.interface.pictures.iter();
        let apart = battery
            .interface
            .pictures
            .len()
            .div_ceil(PICTURES / 2)
            .max(1);
        pictures.extend(near.step_by(apart).cloned());
        pictures.extend(scene.frames(scene.farthest).into_iter().take(1));
        pictures.extend(scene.held_out(scene.nearest, Split::Validation, PICTURES / 2));
        let fragment = &battery.original.programs.fragment;
        let seen = pictures.into_par_iter().map(|frame| {
            let coverage = rasterize(stand.vertex, fragment, &frame);
            let squares = coverage.squares();
            let apart = squares.len().div_ceil(SQUARES).max(1);
            let kept: BTreeSet<_> = squares.into_iter().step_by(apart).collect();
            let part = coverage.part(|square| kept.contains(&square));
            (frame, Inputs::Seen(Box::new(part)))
        });
        let mut all: Vec<(Frame, Inputs)> = seen.collect();
        for group in battery.interface.declared(GROUPS) {
            let frame = battery.interface.frame(&group);
            all.push((frame, Inputs::Made(group)));
        }
        battery.exhibits = all
            .into_par_iter()
            .map(|(frame, inputs)| battery.exhibit(frame, inputs))
            .collect();
        let paths = Paths::of(stand.base);
        let operands: Vec<Operands> = battery
            .exhibits
            .par_iter()
            .map(|exhibit| battery.operands_of(&battery.original, &paths, exhibit))
            .collect();
        for each in operands {
            battery.operands.absorb(each);
        }
        Ok(battery)
    }

    fn exhibit(&self, frame: Frame, inputs: Inputs) -> Exhibit {
        let mut exhibit = Exhibit {
            frame,
            inputs,
            hostile: Vec::new(),
            original: Vec::new(),
        };
        for arithmetic in &self.arithmetics {
            let hostile = self.hostile(&exhibit, *arithmetic);
            let bad = self.run(&self.original, &exhibit, *arithmetic);
            exhibit.original.push(bad.or(&hostile));
            exhibit.hostile.push(hostile);
        }
        exhibit
    }

    /// How many fragments are run.
    fn inputs(&self) -> u64 {
        let all = self
            .exhibits
            .iter()
            .filter_map(|exhibit| exhibit.hostile.first());
        all.map(|hostile| hostile.lanes - hostile.count()).sum()
    }

    /// On how many inputs the original fails by itself, in any arithmetic.
    fn of_original(&self) -> u64 {
        let all = self.exhibits.iter();
        all.map(|exhibit| Bad::any(&exhibit.original) - Bad::any(&exhibit.hostile))
            .sum()
    }

    /// Holds a shader against all inputs.
    ///
    /// # Errors
    /// When the evaluator refuses it.
    pub fn judge(&self, shader: &Shader) -> Result<Judged, Refused> {
        let subject = Subject::new(Programs::of(shader)?);
        let found: Vec<Vec<Failure>> = (0..self.exhibits.len())
            .into_par_iter()
            .map(|at| self.failures_of(&subject, at))
            .collect();
        let mut failures: Vec<Failure> = found.into_iter().flatten().collect();
        if failures.is_empty() {
            failures.extend(self.broken(&subject, shader));
        }
        failures.sort_by_key(|failure| failure.reach);
        let of_original = self.of_original();
        Ok(Judged {
            verdict: match (failures.is_empty(), of_original) {
                (false, _) => Verdict::Unstable,
                (true, 0) => Verdict::Stable,
                (true, _) => Verdict::OriginalToo,
            },
            inputs: self.inputs(),
            of_original,
            failures,
            near: Asked::default(),
        })
    }

    /// What speaks against a shader, of what is quick to see: what others failed on, and the evaluator's own arithmetic.
    ///
    /// # Errors
    /// When the evaluator refuses it.
    pub fn objection(&self, shader: &Shader) -> Result<Option<Failure>, Refused> {
        let subject = Subject::new(Programs::of(shader)?);
        let hazards = self.hazards.lock().unwrap_or_else(PoisonError::into_inner);
        let hazards = hazards.clone();
        let mut known = hazards.into_iter();
        if let Some(known) = known.find(|hazard| self.fails(&subject, shader, hazard)) {
            return Ok(Some(known));
        }
        let exhibits = self.exhibits.par_iter().enumerate();
        Ok(exhibits.find_map_first(|(at, exhibit)| {
            let bad = self.run(&subject, exhibit, Arithmetic::OWN);
            let (block, lane) = bad.first_beyond(exhibit.original.first()?)?;
            Some(Failure {
                exhibit: at,
                group: None,
                block,
                lane,
                arithmetic: 0,
                law: None,
                reach: exhibit.reach(),
            })
        }))
    }

    /// How the original stands by itself.
    pub fn original_alone(&self) -> Judged {
        let of_original = self.of_original();
        Judged {
            verdict: match of_original {
                0 => Verdict::Stable,
                _ => Verdict::OriginalToo,
            },
            inputs: self.inputs(),
            of_original,
            failures: Vec::new(),
            near: Asked::default(),
        }
    }

    /// Where the original fails by itself, once for each operation.
    pub fn lint(&self) -> Vec<(Blamed, Failure)> {
        let base = self.stand.base;
        let mut found: Vec<(Blamed, Failure)> = Vec::new();
        for arithmetic in 0..self.arithmetics.len() {
            for (at, exhibit) in self.exhibits.iter().enumerate() {
                // What the evaluator's own arithmetic shows is explained by that, and what comes from the vertices is not judged.
                let hostile = exhibit.hostile[arithmetic].clone();
                let known = match arithmetic {
                    0 => hostile,
                    _ => hostile.or(&exhibit.original[0]),
                };
                for (block, lane) in exhibit.original[arithmetic].some(LINTED, &known) {
                    let failure = Failure {
                        exhibit: at,
                        group: None,
                        block,
                        lane,
                        arithmetic,
                        law: None,
                        reach: exhibit.reach(),
                    };
                    let blamed = self.blame((base, &Recipe::default()), &failure);
                    let known = |(other, _): &(Blamed, Failure)| {
                        (other.stage, &other.path) == (blamed.stage, &blamed.path)
                    };
                    if !found.iter().any(known) {
                        found.push((blamed, failure));
                    }
                }
            }
        }
        found
    }

    /// Holds a shader against all inputs, and hunts for others where it holds all of these.
    ///
    /// # Errors
    /// When the evaluator refuses it.
    pub fn judge_and_hunt(&self, shader: &Shader) -> Result<Judged, Refused> {
        let mut judged = self.judge(shader)?;
        if judged.failures.is_empty() {
            let hunt = self.hunt(shader)?;
            judged.inputs += hunt.inputs;
            judged.near = hunt.near;
            if let Some(failure) = hunt.failure {
                judged.verdict = Verdict::Unstable;
                judged.failures.push(failure);
            }
        }
        Ok(judged)
    }

    /// The inputs of failures as a file that [`Self::replay`] reads. One that a picture shows is not in it: the scene has it.
    pub fn recorded(&self, failures: &[Failure]) -> String {
        let groups: Vec<Group> = failures.iter().filter_map(|f| self.alone(f)).collect();
        let mut text = serde_json::to_string_pretty(&groups).unwrap_or_default();
        text.push('\n');
        text
    }

    /// Adds the inputs of a file.
    ///
    /// # Errors
    /// When it is none that [`Self::recorded`] has made.
    pub fn replay(&mut self, text: &str, path: &std::path::Path) -> crate::Result<()> {
        let groups: Vec<Group> = serde_json::from_str(text).map_err(|error| {
            crate::Diagnostic::error(format!(
                "`{}` is no file of recorded inputs",
                path.display()
            ))
            .with_reason(error)
            .with_note("`lodc stability --record FILE` writes one")
        })?;
        for group in groups {
            let frame = self.interface.frame(&group);
            let exhibit = self.exhibit(frame, Inputs::Made(group));
            self.exhibits.push(exhibit);
        }
        Ok(())
    }

    /// The input of a failure, alone in its group; nothing for one that a picture shows.
    fn alone(&self, failure: &Failure) -> Option<Group> {
        let group = match (&failure.group, self.exhibits.get(failure.exhibit)) {
            (Some(group), _) => group,
            (None, Some(exhibit)) => match &exhibit.inputs {
                Inputs::Made(group) => group,
                Inputs::Seen(_) => return None,
            },
            (None, None) => return None,
        };
        let quad = group.quads.get(failure.quad())?;
        Some(Group {
            quads: vec![quad.clone()],
            ..group.clone()
        })
    }

    /// Keeps the input of a failure, so that it is asked of what comes.
    pub fn remember(&self, failure: Failure) {
        let mut hazards = self.hazards.lock().unwrap_or_else(PoisonError::into_inner);
        hazards.push(failure);
    }

    /// The original in normal form.
    pub fn base(&self) -> &'a Shader {
        self.stand.base
    }
}

/// The path of a value of a fragment stage.
fn path_of(shader: &Shader, origin: u32) -> Option<String> {
    let function = shader.function(Stage::Fragment)?;
    let mut all = function.expressions.iter();
    let (value, _) = all.find(|(value, _)| value.index() as u32 == origin)?;
    Some(shader.id(Stage::Fragment, value).path().to_owned())
}
