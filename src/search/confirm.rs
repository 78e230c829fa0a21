//! What makes a variant a level: all samples confirm it over its whole interval, and pictures that the search has not
//! seen do not contradict.

use super::error::exceeds;
use super::frontier::Seen;
use super::levels::{Level, threshold};
use super::samples::{Measured, SampleSet, Samples, Stand};
use crate::eval::program::Refused;
use crate::scene::Split;
use lodc_passes::{Recipe, Shader};

/// The samples of one interval.
pub(super) struct Checks<'a> {
    stand: &'a Stand<'a>,
    /// All of them, at the start, in the middle and at the end.
    full: [SampleSet<'a>; 3],
    /// The validation split, at the start and at the end.
    validation: [SampleSet<'a>; 2],
}

/// What the checks say of a variant.
enum Verdict {
    /// It may be a level; what was measured at the start.
    Confirmed(Measured),
    /// It is over its bound.
    Over,
    /// Within its bound on the scene's samples, and over it on the validation split.
    Withdrawn,
}

impl<'a> Checks<'a> {
    /// The samples at the start, in the middle and at the end of an interval; those of the interval before end where
    /// this one starts.
    pub(super) fn new(
        stand: &'a Stand<'a>,
        [start, middle, end]: [f64; 3],
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
            full: [first, full(middle)?, full(end)?],
            validation: [first_unseen, unseen(end)?],
        })
    }

    /// All samples where the interval starts.
    pub(super) fn start(&self) -> &SampleSet<'a> {
        &self.full[0]
    }

    /// Whether a shader passes every check.
    pub(super) fn hold(&self, shader: &Shader) -> bool {
        matches!(self.judge(shader), Ok(Verdict::Confirmed(_)))
    }

    fn judge(&self, shader: &Shader) -> Result<Verdict, Refused> {
        let mut start = None;
        for set in &self.full {
            let measured = set.measure(shader)?;
            if measured.strain > 1.0 {
                return Ok(Verdict::Over);
            }
            start.get_or_insert(measured);
        }
        for set in &self.validation {
            let (details, original) = set.pair(shader)?;
            let scene = self.stand.scene;
            let bound = (scene.bound(set.distance()), scene.reading);
            if exceeds(&details, original, bound) {
                return Ok(Verdict::Withdrawn);
            }
        }
        Ok(start.map_or(Verdict::Over, Verdict::Confirmed))
    }

    /// The cheapest member that passes every check, as a level, and how many were withdrawn on the way. Error falls as
    /// cost rises along a frontier, so the place is found by bisection.
    pub(super) fn cheapest(&self, members: &[&Seen]) -> (Option<Level>, usize) {
        let (mut low, mut high) = (0, members.len());
        let mut best = None;
        let mut withdrawn = 0;
        while low < high {
            let middle = low + (high - low) / 2;
            let shader = members[middle].recipe.replay(self.stand.base).ok();
            let shader = shader.filter(|shader| shader.validate().is_ok());
            match shader.map(|shader| self.judge(&shader)) {
                Some(Ok(Verdict::Confirmed(measured))) => {
                    best = Some((members[middle], measured));
                    high = middle;
                }
                Some(Ok(Verdict::Withdrawn)) => {
                    withdrawn += 1;
                    low = middle + 1;
                }
                _ => low = middle + 1,
            }
        }
        let level = best.and_then(|(member, measured)| self.level(member, &measured));
        (level, withdrawn)
    }

    /// A confirmed member as a level.
    fn level(&self, member: &Seen, measured: &Measured) -> Option<Level> {
        let start = self.start();
        let distance = start.distance();
        let recipe = minimal(self.stand.base, &member.recipe);
        let shader = recipe.replay(self.stand.base).ok()?;
        Some(Level {
            autolod: threshold(self.stand.scene, distance),
            distance,
            error: start.figures(&shader).ok()?,
            flip: start.flip(&shader).ok()?,
            held_out: None,
            shader,
            work: measured.work,
            cost: measured.work.total() / start.original().work.total(),
            error_after: error_after(self.stand, &recipe, start),
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

/// The RMSE after each step of a recipe.
fn error_after(stand: &Stand<'_>, recipe: &Recipe, set: &SampleSet<'_>) -> Vec<f64> {
    let mut shader = stand.base.clone();
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
