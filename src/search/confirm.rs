//! What makes a variant a level: all samples confirm it over its whole interval, and pictures that the search has not
//! seen do not contradict.

use super::descend::Confirmed;
use super::guard::Guard;
use super::kept::Kept;
use super::levels::{Level, Struck, threshold};
use super::parameters;
use super::samples::{Measured, SampleSet, Samples};
use super::textures;
use crate::error::{Details, exceeds};
use crate::eval::program::Refused;
use crate::eval::programs::{Programs, Stand};
use crate::scene::Split;
use crate::stability::{Battery, Device, Failure};
use lodc_passes::{Recipe, Shader};

/// The samples of one interval.
pub(super) struct Checks<'a> {
    stand: &'a Stand<'a>,
    /// What recipes are replayed on.
    base: &'a Shader,
    /// All of them, at the start, in the middle and at the end.
    full: [SampleSet<'a>; 3],
    /// The validation split, at the start and at the end.
    validation: [SampleSet<'a>; 2],
    /// What it has to hold, where that is asked.
    battery: Option<&'a Battery<'a>>,
}

/// What the checks say of a variant.
pub(super) struct Verdict {
    pub(super) finding: Finding,
    /// What all samples say of its mean error and of its worst view: how much of its bound it uses up, the most in its
    /// interval.
    pub(super) strain_of_means: f64,
    /// The input that it fails on, where it is unstable.
    pub(super) failure: Option<Failure>,
    /// What was measured at each place of the interval.
    details: Vec<Details>,
}

/// Whether a variant may be a level.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(
    clippy::large_enum_variant,
    reason = "few are there at a time, and most are confirmed"
)]
pub(super) enum Finding {
    /// It may; what was measured at the start.
    Confirmed(Measured),
    /// It is over its bound.
    Over,
    /// Within its bound on the scene's samples, and over it on the validation split.
    Withdrawn,
    /// Within its bound, and not finite on an input on which the original is.
    Unstable,
}

impl<'a> Checks<'a> {
    /// The samples at the start, in the middle and at the end of an interval; recipes are replayed on `base`; those of the interval before end where
    /// this one starts.
    pub(super) fn new(
        stand: &'a Stand<'a>,
        base: &'a Shader,
        [start, middle, end]: [f64; 3],
        battery: Option<&'a Battery<'a>>,
        before: Option<Self>,
    ) -> Result<Self, Refused> {
        let full = |distance| SampleSet::new(stand, distance, Samples::Full);
        let unseen =
            |distance| SampleSet::new(stand, distance, Samples::HeldOut(Split::Validation));
        let (first, first_unseen) = match before {
            Some(Self {
                full: [_, _, last],
                validation: [_, last_unseen],
                ..
            }) => (last, last_unseen),
            None => (full(start)?, unseen(start)?),
        };
        Ok(Self {
            stand,
            base,
            full: [first, full(middle)?, full(end)?],
            validation: [first_unseen, unseen(end)?],
            battery,
        })
    }

    /// What recipes are replayed on.
    pub(super) fn base(&self) -> &'a Shader {
        self.base
    }

    /// All samples where the interval starts.
    pub(super) fn start(&self) -> &SampleSet<'a> {
        &self.full[0]
    }

    /// Whether a shader passes every check.
    pub(super) fn hold(&self, shader: &Shader) -> bool {
        let verdict = self.judge(shader);
        verdict.is_ok_and(|verdict| matches!(verdict.finding, Finding::Confirmed(_)))
    }

    /// What a shader costs over its interval, as a share of the original's cost: what it does for fragments is that at the
    /// start.
    pub(super) fn cost(&self, shader: &Shader) -> Result<f64, Refused> {
        let programs = Programs::of(shader)?;
        let (_, measured) = self.start().in_full(&programs);
        let mut used = measured.used;
        if used.work.moved > 0.0 {
            for set in &self.full[1..] {
                used.work.moved += set.in_full(&programs).1.used.work.moved;
            }
            used.work.moved /= self.full.len() as f64;
        }
        let start = self.start();
        Ok(start.share(start.cost(&used)))
    }

    /// Draws a shader in full, over its whole interval.
    pub(super) fn judge(&self, shader: &Shader) -> Result<Verdict, Refused> {
        let programs = Programs::of(shader)?;
        let mut start: Option<Measured> = None;
        let mut moved = 0.0;
        let mut verdict = Verdict {
            finding: Finding::Over,
            strain_of_means: 0.0,
            failure: None,
            details: Vec::new(),
        };
        let mut strain = 0.0_f64;
        for set in &self.full {
            let (details, measured) = set.in_full(&programs);
            let figures = set.figures_of(&details);
            strain = strain.max(measured.strain);
            verdict.strain_of_means = verdict.strain_of_means.max(figures.strain_of_means());
            verdict.details.push(details);
            start.get_or_insert(measured);
            // It weighs more the fewer fragments there are.
            moved += measured.used.work.moved / self.full.len() as f64;
        }
        if let Some(start) = &mut start {
            start.used.work.moved = moved;
            start.cost = self.start().cost(&start.used);
        }
        if strain <= 1.0 {
            verdict.finding = start.map_or(Finding::Over, Finding::Confirmed);
            for set in &self.validation {
                let (details, original) = set.pair(shader)?;
                let scene = self.stand.scene;
                let bound = (scene.bound(set.distance()), scene.reading);
                if exceeds(&details, original, bound) {
                    verdict.finding = Finding::Withdrawn;
                }
            }
        }
        if let (Finding::Confirmed(_), Some(battery)) = (verdict.finding, self.battery) {
            let failures = battery.judge(shader)?.failures;
            if let Some(failure) = failures.into_iter().next() {
                battery.remember(failure.clone());
                verdict.failure = Some(failure);
                verdict.finding = Finding::Unstable;
            }
        }
        Ok(verdict)
    }

    /// Hunts for an input on which what was confirmed fails, and why it does; on a device, too, where there is one.
    pub(super) fn hunt(
        &self,
        found: &Confirmed,
        device: Option<&mut dyn Device>,
    ) -> Result<Option<Struck>, Refused> {
        let Some(battery) = self.battery else {
            return Ok(None);
        };
        let Ok(shader) = found.recipe.replay(self.base) else {
            return Ok(None);
        };
        let hunt = battery.hunt(&shader)?;
        if let Some(failure) = hunt.failure {
            let struck = self.struck(&found.recipe, &failure);
            battery.remember(failure);
            return Ok(struck);
        }
        let recipe = &found.recipe;
        let on_device = device
            .and_then(|device| battery.on_device(device, (self.base, recipe), &shader, &hunt.near));
        let blamed = on_device.and_then(|found| found.blamed);
        Ok(blamed.map(|blamed| Struck {
            recipe: recipe.clone(),
            blamed,
        }))
    }

    /// Why a variant fails on an input.
    pub(super) fn struck(&self, recipe: &Recipe, failure: &Failure) -> Option<Struck> {
        let battery = self.battery?;
        Some(Struck {
            recipe: recipe.clone(),
            blamed: battery.blame((self.base, recipe), failure),
        })
    }

    /// Has a guard keep what spoke against a variant.
    pub(super) fn teach(
        &self,
        guard: &mut Guard<'a>,
        measured: &Measured,
        verdict: &Verdict,
    ) -> Result<(), Refused> {
        let mut tiles = false;
        for (set, details) in self.full.iter().zip(&verdict.details) {
            if set.figures_of(details).strain_of_tiles() > 1.0 {
                guard.keep(set, details)?;
                tiles = true;
            }
        }
        if !tiles || verdict.strain_of_means > 1.0 {
            guard.lower(measured, verdict.strain_of_means);
        }
        Ok(())
    }

    /// A confirmed variant as a level, which asks the host for nothing unless it may; what each step leaves is measured on
    /// the search's own samples.
    pub(super) fn level(
        &self,
        Confirmed { recipe, measured }: &Confirmed,
        search: &SampleSet<'_>,
        kept: &Kept,
        asks: bool,
    ) -> Option<Level> {
        let start = self.start();
        let distance = start.distance();
        let mut recipe = minimal(self.base, recipe);
        let mut shader = recipe.replay(self.base).ok()?;
        let mut measured = *measured;
        let original = start.original();
        let mut stability = None;
        let mut with_parameters = None;
        if let Some((longer, moved)) = parameters::with_exact(&recipe, &shader, kept)
            && let Ok(less) = start.measure(&moved)
            && less.cost < measured.cost
        {
            if asks && self.stand.scene.host.parameters {
                (recipe, shader, measured) = (longer, moved, less);
            } else {
                with_parameters = Some(start.share(less.cost));
            }
        }
        let mut with_textures = None;
        if !self.stand.scene.host.textures
            && let Some(made) = textures::collapsed(&shader, &search.facts(&shader), kept)
            && let Ok(less) = start.measure(&made)
            && less.cost < measured.cost
            && less.strain <= 1.0
        {
            with_textures = Some(start.share(less.cost));
        }
        if let Some(battery) = self.battery {
            let judged = battery.judge(&shader).ok()?;
            if !judged.failures.is_empty() {
                return None;
            }
            stability = Some(judged);
        }
        Some(Level {
            stability,
            unstable: Vec::new(),
            stiff: Vec::new(),
            autolod: threshold(self.stand.scene, distance),
            distance,
            is_original: false,
            error: start.figures(&shader).ok()?,
            flip: start.flip(&shader).ok()?,
            held_out: None,
            shader,
            used: measured.used,
            cost: start.share(measured.cost),
            time: measured.used.work.total() / original.used.work.total(),
            timed: Vec::new(),
            branching: Vec::new(),
            with_parameters,
            with_textures,
            error_after: error_after(self.base, &recipe, search),
            recipe,
        })
    }
}

/// A recipe without the steps that later ones have made pointless: the same shader, with less to replay and to say.
fn minimal(base: &Shader, recipe: &Recipe) -> Recipe {
    let identity = |recipe: &Recipe| Some(recipe.replay(base).ok()?.fingerprint());
    let goal = identity(recipe);
    let mut kept = recipe.clone();
    for at in (0..recipe.0.len()).rev() {
        let mut fewer = kept.clone();
        fewer.0.remove(at);
        if goal.is_some() && identity(&fewer) == goal {
            kept = fewer;
        }
    }
    kept
}

/// The RMSE after each step of a recipe, over some samples.
fn error_after(base: &Shader, recipe: &Recipe, set: &SampleSet<'_>) -> Vec<f64> {
    let mut shader = base.clone();
    let mut errors = Vec::new();
    for candidate in &recipe.0 {
        let Ok(next) = lodc_passes::recipe::apply(&shader, candidate) else {
            break;
        };
        shader = next;
        match set.measure(&shader) {
            Ok(measured) => errors.push(measured.error.square().sqrt()),
            Err(_) => break,
        }
    }
    errors
}
