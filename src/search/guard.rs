//! What a search set does not show, learnt from variants that all samples refused.
//!
//! A search set has a few squares of pixels of every frame: enough to tell the mean error, too few for the worst tile.
//! So a variant that the search took for good is drawn in full; the tiles that speak against it are kept, each as
//! all samples have it, and the search goes on from the last variant that they allow. A few such tiles stand for all:
//! what spoils one highlight spoils the others.

use super::kept::Kept;
use super::samples::{Measured, SampleSet, Tiles};
use crate::emit::shared_locations;
use crate::error::Details;
use crate::eval::program::Refused;
use crate::eval::programs::{Programs, Stand};
use crate::stability::{Battery, Failure};
use lodc_passes::{Candidate, Recipe, Shader};
use std::sync::{Mutex, PoisonError};

/// How many tiles of one distance are kept of a variant.
const TILES: usize = 16;
/// How much more than its bound a search set may say, at most, that a variant uses up, when all samples say less.
const HIGHEST: f64 = 1.5;
/// How much lower the limit becomes at least when all samples refuse a variant for its mean error.
const LOWER: f64 = 0.95;

/// Of how many unstable variants of an interval it is said why.
const MOST_UNSTABLE: usize = 4;

/// What a variant has to pass before it is worth a step.
pub(crate) struct Guard<'a> {
    stand: &'a Stand<'a>,
    /// What the user wants kept.
    kept: &'a Kept,
    /// Tiles that a variant was refused for, a set for each distance and each time.
    tiles: Vec<SampleSet<'a>>,
    /// How much of its bound a variant may use up on the search set.
    limit: f64,
    /// The levels that the shader has already: what all hand over from stage to stage has to have room.
    levels: Vec<Shader>,
    /// What a variant has to hold beyond the pictures.
    battery: Option<&'a Battery<'a>>,
    /// Steps that fail on a device.
    forbidden: Vec<Candidate>,
    /// Variants that did not, with what they fail on: one for each last step, and not many.
    unstable: Mutex<Vec<(Recipe, Failure)>>,
}

impl<'a> Guard<'a> {
    /// Nothing is known yet.
    pub(crate) fn new(stand: &'a Stand<'a>, kept: &'a Kept) -> Self {
        Self {
            stand,
            kept,
            tiles: Vec::new(),
            limit: 1.0,
            levels: Vec::new(),
            battery: None,
            forbidden: Vec::new(),
            unstable: Mutex::default(),
        }
    }

    /// Variants have to hold this, too.
    pub(crate) fn with(self, battery: Option<&'a Battery<'a>>) -> Self {
        Self { battery, ..self }
    }

    /// Nothing is over a bound: only what is to be kept counts.
    pub(crate) fn unbounded(stand: &'a Stand<'a>, kept: &'a Kept) -> Self {
        Self {
            limit: f64::INFINITY,
            ..Self::new(stand, kept)
        }
    }

    /// From now on no variant may have this step.
    pub(crate) fn forbid(&mut self, step: Candidate) {
        self.forbidden.push(step);
    }

    /// From now on a level is to stand beside another one.
    pub(crate) fn beside(&mut self, level: Shader) {
        self.levels.push(level);
    }

    /// Whether a shader of all levels has room for what this one hands over.
    pub(crate) fn has_room(&self, shader: &Shader) -> bool {
        let levels = self.levels.iter().chain([shader]);
        shader.handing_over().is_none()
            || shared_locations(self.stand.base, levels, self.kept.apart)
                <= self.stand.base.most_locations()
    }

    /// What it knows of an interval that starts at a distance.
    pub(crate) fn start_at(&mut self, distance: f64) {
        self.tiles.retain(|set| set.distance() >= distance);
        self.limit = 1.0;
    }

    /// What the user wants kept.
    pub(crate) fn kept(&self) -> &'a Kept {
        self.kept
    }

    /// Whether the search set is content with what was measured on it.
    pub(crate) fn admits(&self, measured: &Measured) -> bool {
        measured.strain <= self.limit
    }

    /// Whether nothing that is known speaks against a variant and the shader that it makes.
    pub(crate) fn allows(&self, recipe: &Recipe, shader: &Shader, measured: &Measured) -> bool {
        self.admits(measured)
            && !recipe.0.iter().any(|step| self.forbidden.contains(step))
            && self.kept.holds(shader)
            && self.has_room(shader)
            && Programs::of(shader).is_ok_and(|programs| {
                let mut sets = self.tiles.iter();
                sets.all(|set| set.strain_of_tiles(&programs) <= 1.0)
            })
            && self
                .battery
                .is_none_or(|battery| match battery.objection(shader) {
                    Ok(None) => true,
                    Ok(Some(failure)) => {
                        self.note(recipe, failure);
                        false
                    }
                    Err(_) => false,
                })
    }

    /// Keeps a variant that is unstable, so that it can be said why.
    fn note(&self, recipe: &Recipe, failure: Failure) {
        let mut unstable = self.unstable.lock().unwrap_or_else(PoisonError::into_inner);
        let last = |recipe: &Recipe| recipe.0.last().map(|step| step.site.clone());
        let known = unstable
            .iter()
            .any(|(known, _)| last(known) == last(recipe));
        if !known && unstable.len() < MOST_UNSTABLE {
            unstable.push((recipe.clone(), failure));
        }
    }

    /// The variants that were unstable since this was asked the last time, with what they fail on.
    pub(crate) fn unstable(&mut self) -> Vec<(Recipe, Failure)> {
        let unstable = self.unstable.get_mut();
        std::mem::take(unstable.unwrap_or_else(PoisonError::into_inner))
    }

    /// Keeps the tiles of a set that speak against a variant.
    pub(crate) fn keep(&mut self, set: &SampleSet<'_>, details: &Details) -> Result<(), Refused> {
        let tiles: Tiles = set.worst_tiles(details, TILES);
        if !tiles.is_empty() {
            let set = SampleSet::of_tiles(self.stand, set.distance(), &tiles)?;
            self.tiles.push(set);
        }
        Ok(())
    }

    /// All samples refuse a variant, and `strain` is what they say of its mean error.
    pub(crate) fn lower(&mut self, measured: &Measured, strain: f64) {
        let part = (1.0 / strain).min(LOWER);
        self.limit = self.limit.min(measured.strain) * part;
    }

    /// All samples allow a variant, and `strain` is what they say of its mean error. Returns whether more is allowed
    /// than before.
    pub(crate) fn raise(&mut self, measured: &Measured, strain: f64) -> bool {
        let limit = LOWER * measured.strain / strain;
        let limit = if limit.is_nan() {
            HIGHEST
        } else {
            limit.min(HIGHEST)
        };
        let more = limit * LOWER > self.limit;
        if more {
            self.limit = limit;
        }
        more
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compile::normal_form;
    use crate::eval::program::Program;
    use crate::front::Source;
    use crate::scene::Scene;
    use crate::search::Samples;
    use crate::search::interval::Interval;
    use lodc_passes::recipe;

    #[test]
    fn tiles_that_spoke_against_a_variant_are_remembered() {
        // A spot that is too small for the mean error.
        let source = Source::parse(
            "spot.wgsl",
            "@fragment fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
                 let spot = saturate(1.0 - 80.0 * distance(uv, vec2f(0.5)));
                 return vec4f(vec3f(0.3 + spot * (1.0 - 0.1 * uv.x)), 1.0);
             }",
        )
        .expect("it parses");
        let base = normal_form(&source).expect("it is small");
        let scene = Scene::read(&source, None).unwrap_or_else(|e| panic!("{e}"));
        let stage = scene.vertex_stage.as_ref().expect("lodc supplies one");
        let vertex = Program::compile(&stage.module, 0, &[]).expect("it is plain");
        let stand = Stand {
            base: &base,
            vertex: &vertex,
            scene: &scene,
        };
        let [near, far] = [scene.distances[1], scene.distances[2]];
        let search = Interval::new(&stand, &[near], Samples::Search).expect("it runs");
        let facts = search.start().facts(&base);
        let candidates = recipe::candidates(&base, &facts);
        let mean = candidates
            .iter()
            .find(|c| c.site.path() == "fs_main.spot" && c.choice == "mean")
            .expect("it is offered");
        let flat = recipe::apply(&base, mean).expect("it applies");
        let measured = search.measure(&flat).expect("it runs");
        let kept = Kept::default();
        let mut guard = Guard::new(&stand, &kept);
        let plain = Recipe::default();
        assert!(guard.allows(&plain, &flat, &measured), "{measured:?}");

        let full = SampleSet::new(&stand, near, Samples::Full).expect("it runs");
        let programs = Programs::of(&flat).expect("it runs");
        let (details, all) = full.in_full(&programs);
        let figures = full.figures_of(&details);
        assert!(
            figures.strain_of_means() < 1.0 && all.strain > 1.0,
            "{figures:?}"
        );
        guard.keep(&full, &details).expect("it runs");
        assert!(!guard.allows(&plain, &flat, &measured));
        assert!(guard.allows(&plain, &base, &search.start().original()));
        // Some tiles say what all say.
        assert_eq!(
            guard.tiles[0].strain_of_tiles(&programs),
            figures.strain_of_tiles()
        );
        guard.start_at(far);
        assert!(guard.allows(&plain, &flat, &measured));
    }

    #[test]
    fn the_limit_follows_what_all_samples_say() {
        // Measured on the search set alone.
        let measured = |strain| Measured {
            strain,
            ..Measured::default()
        };
        let (base, vertex, scene) = nothing();
        let stand = Stand {
            base: &base,
            vertex: &vertex,
            scene: &scene,
        };
        let kept = Kept::default();
        let mut guard = Guard::new(&stand, &kept);
        // All samples see a quarter more than the search: so much less is allowed.
        guard.lower(&measured(0.9), 1.25);
        assert!(guard.admits(&measured(0.71)) && !guard.admits(&measured(0.73)));
        // Refused for another reason, it still has to become less.
        guard.lower(&measured(0.7), 0.5);
        assert!(!guard.admits(&measured(0.67)));
        guard.start_at(0.0);
        assert!(guard.admits(&measured(1.0)));
        // All samples see less: more is allowed, but not without end.
        assert!(guard.raise(&measured(1.0), 0.8));
        assert!(guard.admits(&measured(1.18)) && !guard.admits(&measured(1.2)));
        assert!(!guard.raise(&measured(1.18), 0.99));
        assert!(guard.raise(&measured(1.0), 0.0));
        assert!(guard.admits(&measured(HIGHEST)) && !guard.admits(&measured(HIGHEST + 0.1)));
    }

    fn nothing() -> (Shader, Program, Scene) {
        let text = "@fragment fn fs_main() -> @location(0) vec4f { return vec4f(1.0); }";
        let source = Source::parse("nothing.wgsl", text).expect("it parses");
        let base = normal_form(&source).expect("it is small");
        let scene = Scene::read(&source, None).unwrap_or_else(|e| panic!("{e}"));
        let stage = scene.vertex_stage.as_ref().expect("lodc supplies one");
        let vertex = Program::compile(&stage.module, 0, &[]).expect("it is plain");
        (base, vertex, scene)
    }
}
