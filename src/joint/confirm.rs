//! What makes a pair a level: all samples confirm it over the whole of its interval, pictures that the search has not seen do not
//! contradict, and its shader holds inputs that no picture shows.

use super::seen::Candidates;
use super::set_of;
use super::table::Run;
use crate::error::{ErrorFigures, HeldOut, exceeds};
use crate::eval::program::Refused;
use crate::scene::{Scene, Split};
use crate::search::{Level, Measured, Samples, threshold};
use crate::stability::{Battery, Judged};
use lodc_passes::{Recipe, Shader};
use std::collections::BTreeMap;

/// The least that what is known of a pair is corrected by, so that it does not fail by the same again.
const CORRECTION: f64 = 1.05;

/// Why a pair is no level where it was to be used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Refuted {
    /// It is over the bound; how much of it it uses up.
    Over(f64),
    /// Its shader fails on an input on which the original holds.
    Unstable,
}

/// What all samples say of a pair where it begins.
#[derive(Clone, Debug)]
pub(super) struct Pieces {
    distance: f64,
    error: ErrorFigures,
    flip: f64,
    held_out: HeldOut,
    measured: Measured,
    time: f64,
    /// How its shader stands, where that was asked.
    stability: Option<Judged>,
}

/// Confirms pairs.
pub(super) struct Confirmer<'a> {
    candidates: &'a Candidates<'a>,
    battery: Option<&'a Battery<'a>>,
    /// What was confirmed, or not, by the pair and the bits of the ends of its interval.
    known: BTreeMap<(usize, usize, u64, u64), Result<Pieces, Refuted>>,
    /// How shaders stand.
    judged: BTreeMap<usize, Judged>,
}

impl<'a> Confirmer<'a> {
    /// With what shaders have to hold, where that is asked.
    pub(super) fn new(candidates: &'a Candidates<'a>, battery: Option<&'a Battery<'a>>) -> Self {
        Self {
            candidates,
            battery,
            known: BTreeMap::new(),
            judged: BTreeMap::new(),
        }
    }

    /// Judges a pair where it is to be used.
    pub(super) fn judge(&mut self, run: &Run) -> Result<Result<Pieces, Refuted>, Refused> {
        let pair = run.pair;
        let key = (
            pair.mesh,
            pair.shader,
            run.from.to_bits(),
            run.until.to_bits(),
        );
        if let Some(known) = self.known.get(&key) {
            return Ok(known.clone());
        }
        // What draws the same as the original on its own mesh is there to fall back on.
        let (recipe, _) = &self.candidates.shaders[pair.shader];
        let is_trusted = pair.mesh == 0 && recipe.0.is_empty();
        let stability = match is_trusted {
            true => None,
            false => self.stand_of(pair.shader)?,
        };
        let found = match &stability {
            Some(judged) if !judged.failures.is_empty() => Err(Refuted::Unstable),
            _ => self.look(run, is_trusted)?,
        };
        let found = found.map(|pieces| Pieces {
            stability,
            ..pieces
        });
        self.known.insert(key, found.clone());
        Ok(found)
    }

    /// How a shader stands, where that is asked.
    fn stand_of(&mut self, shader: usize) -> Result<Option<Judged>, Refused> {
        let Some(battery) = self.battery else {
            return Ok(None);
        };
        if let Some(known) = self.judged.get(&shader) {
            return Ok(Some(known.clone()));
        }
        let (_, variant) = &self.candidates.shaders[shader];
        let judged = battery.judge_and_hunt(variant)?;
        self.judged.insert(shader, judged.clone());
        Ok(Some(judged))
    }

    fn look(&self, run: &Run, is_trusted: bool) -> Result<Result<Pieces, Refuted>, Refused> {
        let Candidates {
            stands, programs, ..
        } = self.candidates;
        let (pair, scene) = (run.pair, stands[0].scene);
        let programs = &programs[pair.shader];
        let (_, shader) = &self.candidates.shaders[pair.shader];
        let full = |distance| set_of(stands, pair.mesh, distance, Samples::Full);
        let start = full(run.from)?;
        let (details, measured) = start.in_full(programs);
        let error = start.figures_of(&details);
        let mut strain = error.strain();
        for distance in [(run.from * run.until).sqrt(), run.until] {
            if strain > 1.0 {
                break;
            }
            let (_, measured) = full(distance)?.in_full(programs);
            strain = strain.max(measured.strain);
        }
        if strain > 1.0 && !is_trusted {
            return Ok(Err(Refuted::Over(strain.max(CORRECTION))));
        }
        for distance in [run.from, run.until] {
            let samples = Samples::HeldOut(Split::Validation);
            let set = set_of(stands, pair.mesh, distance, samples)?;
            let (details, original) = set.pair(shader)?;
            let bound = (scene.bound(distance), scene.reading);
            if !is_trusted && exceeds(&details, original, bound) {
                return Ok(Err(Refuted::Over(CORRECTION)));
            }
        }
        let test = set_of(stands, pair.mesh, run.from, Samples::HeldOut(Split::Test))?;
        let (details, original) = test.pair(shader)?;
        Ok(Ok(Pieces {
            distance: run.from,
            error,
            flip: start.flip(shader)?,
            held_out: HeldOut::new(&details, original),
            time: self.candidates.time(pair.mesh, &start, &measured)?,
            measured,
            stability: None,
        }))
    }
}

impl Pieces {
    /// The level, of a shader and what makes it.
    pub(super) fn level(
        self,
        scene: &Scene,
        (recipe, shader): (&Recipe, &Shader),
        is_original: bool,
    ) -> Level {
        Level {
            autolod: threshold(scene, self.distance),
            distance: self.distance,
            is_original,
            recipe: recipe.clone(),
            shader: shader.clone(),
            error: self.error,
            flip: self.flip,
            held_out: Some(self.held_out),
            used: self.measured.used,
            cost: self.time,
            time: self.time,
            timed: Vec::new(),
            branching: Vec::new(),
            with_parameters: None,
            with_textures: None,
            stability: self.stability,
            unstable: Vec::new(),
            stiff: Vec::new(),
            error_after: Vec::new(),
        }
    }
}
