//! What is measured of pairs at one distance: how far each is from the original, how long it takes, and what is seen where one takes
//! the place of another.

use crate::error::ErrorFigures;
use crate::eval::program::Refused;
use crate::eval::programs::{Programs, Stand};
use crate::search::{Measured, SampleSet, Samples};
use crate::time::model::Model;
use lodc_joint::Pair;
use lodc_passes::{Recipe, Shader};
use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

/// Meshes and shaders to make pairs of.
pub(super) struct Candidates<'a> {
    /// For each mesh what it is drawn with; the first is the scene's own.
    pub(super) stands: &'a [Stand<'a>],
    /// The shaders, the original first.
    pub(super) shaders: &'a [(Recipe, Shader)],
    /// For each shader.
    pub(super) programs: Vec<Programs>,
    model: Model,
}

/// What was measured of a pair at a distance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    /// How much of a bound of 1 it would use up.
    pub(super) load: f64,
    /// Its time as a share of the original's, by the model.
    pub(super) time: f64,
}

impl Seen {
    /// Measures programs over samples; `original` is what the original takes by the model.
    pub(super) fn of(
        set: &SampleSet<'_>,
        programs: &Programs,
        model: &Model,
        original: f64,
    ) -> Self {
        let (details, measured) = set.in_full(programs);
        let figures = ErrorFigures {
            bound: 1.0,
            ..set.figures_of(&details)
        };
        Self {
            load: figures.strain(),
            time: share(model.time(&set.features(&measured)), original),
        }
    }

    /// How much of a bound it uses up.
    pub(super) fn strain(&self, bound: f64) -> f64 {
        strain(self.load, bound)
    }
}

/// How much of a bound something uses up that uses up so much of a bound of 1.
pub(super) fn strain(load: f64, bound: f64) -> f64 {
    match load > 0.0 {
        true => load / bound,
        false => 0.0,
    }
}

impl<'a> Candidates<'a> {
    pub(super) fn new(
        stands: &'a [Stand<'a>],
        shaders: &'a [(Recipe, Shader)],
        model: Model,
    ) -> Result<Self, Refused> {
        let programs = shaders.iter().map(|(_, shader)| Programs::of(shader));
        Ok(Self {
            stands,
            shaders,
            programs: programs.collect::<Result<_, _>>()?,
            model,
        })
    }

    /// What a pair takes at a distance as a share of the original, from what all samples of its mesh say there.
    pub(super) fn time(
        &self,
        mesh: usize,
        set: &SampleSet<'_>,
        measured: &Measured,
    ) -> Result<f64, Refused> {
        let time = self.model.time(&set.features(measured));
        let own;
        let whole = match mesh {
            0 => set,
            _ => {
                own = SampleSet::new(&self.stands[0], set.distance(), Samples::Search)?;
                &own
            }
        };
        let original = self.model.time(&whole.features(&set.original()));
        Ok(share(time, original))
    }
}

/// A time as a share of the original's; 1 where that takes none.
fn share(time: f64, original: f64) -> f64 {
    match original > 0.0 {
        true => time / original,
        false => 1.0,
    }
}

/// The samples at one distance, for some of the meshes.
pub(super) struct At<'a> {
    candidates: &'a Candidates<'a>,
    sets: BTreeMap<usize, SampleSet<'a>>,
    /// What the original takes.
    original: f64,
    /// How many pixels the reference covers, counted once for each offset, at least 1.
    coverage: f64,
    known: Mutex<BTreeMap<Pair, Seen>>,
}

impl<'a> At<'a> {
    /// For meshes that begin with the scene's own.
    pub(super) fn new(
        candidates: &'a Candidates<'a>,
        meshes: &[usize],
        distance: f64,
    ) -> Result<Self, Refused> {
        let stands = meshes.iter().map(|mesh| &candidates.stands[*mesh]);
        let stands: Vec<&Stand<'a>> = stands.collect();
        let sets = SampleSet::of_meshes(&stands, distance, Samples::Tiles)?;
        let sets: BTreeMap<usize, SampleSet<'_>> = meshes.iter().copied().zip(sets).collect();
        let whole = &sets[&0];
        let original = whole.original();
        Ok(Self {
            candidates,
            original: candidates.model.time(&whole.features(&original)),
            coverage: original.error.coverage.max(1.0),
            sets,
            known: Mutex::default(),
        })
    }

    /// Measures a pair, once.
    pub(super) fn seen(&self, pair: Pair) -> Seen {
        let known = || self.known.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(seen) = known().get(&pair) {
            return *seen;
        }
        let programs = &self.candidates.programs[pair.shader];
        let set = &self.sets[&pair.mesh];
        let seen = Seen::of(set, programs, &self.candidates.model, self.original);
        known().insert(pair, seen);
        seen
    }

    /// Shaders by their error on the scene's own mesh, least first.
    pub(super) fn by_error(&self, shaders: std::ops::Range<usize>) -> Vec<usize> {
        let load = |shader| self.seen(Pair { mesh: 0, shader }).load;
        let mut order: Vec<usize> = shaders.collect();
        order.sort_by(|a, b| load(*a).total_cmp(&load(*b)));
        order
    }

    /// What a pair leaves at each pixel.
    pub(super) fn left(&self, pair: Pair) -> Vec<[f32; 6]> {
        self.sets[&pair.mesh].left(&self.candidates.programs[pair.shader])
    }

    /// What is seen where one pair takes the place of another, from what both leave: eq. 5, as a root mean square, 0..1.
    pub(super) fn between(&self, one: &[[f32; 6]], other: &[[f32; 6]]) -> f64 {
        let pixels = one.iter().zip(other);
        let squares = pixels.map(|(one, other)| {
            let channels = one.iter().zip(other);
            let squares = channels.map(|(a, b)| f64::from(a - b).powi(2));
            squares.sum::<f64>() / 6.0
        });
        (squares.sum::<f64>() / self.coverage).sqrt()
    }
}
