//! The exact tier: everything that costs no error, made before a search, so that no lossy change is credited with it.
//!
//! Its changes are those of the passes that are exact, as long as there are any. Of the uniforms that the scene states only
//! those are folded that save work with the others: the levels go on reading the rest. What comes out draws the same
//! pictures, to the last bit of what is displayed; that is looked at.

use super::kept::Kept;
use super::samples::{Measured, SampleSet, Samples, Stand};
use crate::eval::program::Refused;
use lodc_passes::recipe::{self, Considered};
use lodc_passes::{Candidate, PASSES, Recipe, Shader, Stage, Used, Work, cost, specialize};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Rounds after which no more is looked for.
const ROUNDS: usize = 16;

/// Which shaders are made exact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scope {
    /// None: every change of a level is judged by its error.
    None,
    /// The levels; level 0 is the source as it stands.
    #[default]
    Levels,
    /// Level 0 too.
    All,
}

/// What the exact tier made of a shader.
#[derive(Clone, Debug)]
pub struct Exact {
    /// How it is made from the original; empty when there was nothing to do.
    pub recipe: Recipe,
    /// What every search starts from.
    pub shader: Shader,
    /// What was thought of and declined, with the reason.
    pub declined: Vec<Considered>,
    /// What the original uses up at the nearest distance, and what is left without what costs no error.
    pub used: [Used; 2],
    /// What those cost by the goal.
    pub(super) costs: [f64; 2],
}

impl Exact {
    /// Nothing is done. The set is of the nearest distance.
    pub(super) fn none(stand: &Stand<'_>, nearest: &SampleSet<'_>) -> Self {
        let Measured { used, cost, .. } = nearest.original();
        Self {
            recipe: Recipe::default(),
            shader: stand.base.clone(),
            declined: Vec::new(),
            used: [used, used],
            costs: [cost, cost],
        }
    }

    /// The cost that is left, as a share of the original's.
    pub fn cost(&self) -> f64 {
        self.costs[1] / self.costs[0]
    }

    /// Specialises a shader to its scene, but for what is to be kept. The set is all samples at the nearest distance.
    ///
    /// # Errors
    /// When the evaluator refuses the original.
    pub(super) fn find(
        stand: &Stand<'_>,
        nearest: &SampleSet<'_>,
        kept: &Kept,
    ) -> Result<Self, Refused> {
        let distances = &stand.scene.distances;
        let ends: BTreeSet<usize> = [0, distances.len() - 1].into();
        let sets = ends
            .into_iter()
            .map(|at| SampleSet::new(stand, distances[at], Samples::Search))
            .collect::<Result<Vec<_>, _>>()?;
        let steps = Steps { stand, kept };
        let all = steps.of(&sets, &|_| true);
        let needed = needed(stand.base, &all);
        let exact = match needed.len() == all.len() {
            true => all,
            false => steps.of(&sets, &|candidate| {
                !is_fixed(candidate) || needed.contains(&candidate.choice)
            }),
        };
        let made = |recipe: Vec<Candidate>| {
            let recipe = Recipe(recipe);
            let shader = recipe.replay(stand.base).ok()?;
            Some((recipe, shader))
        };
        // What the samples of a search did not show, all samples may.
        let only_fixed = exact.iter().filter(|c| is_fixed(c)).cloned().collect();
        for recipe in [exact, only_fixed] {
            if let Some((recipe, shader)) = made(recipe)
                && nearest.same(stand.base, &shader)?
            {
                let both = [nearest.original(), nearest.measure(&shader)?];
                return Ok(Self {
                    recipe,
                    declined: declined(&sets[0], &shader),
                    used: both.map(|one| one.used),
                    costs: both.map(|one| one.cost),
                    shader,
                });
            }
        }
        Ok(Self::none(stand, nearest))
    }
}

/// Whether a change folds what the scene states.
fn is_fixed(candidate: &Candidate) -> bool {
    specialize::folded(candidate).is_some()
}

/// What looks for the steps.
struct Steps<'a> {
    stand: &'a Stand<'a>,
    kept: &'a Kept,
}

impl Steps<'_> {
    /// The exact changes that may be made, one after another, until there are none.
    fn of(&self, sets: &[SampleSet<'_>], wanted: &dyn Fn(&Candidate) -> bool) -> Vec<Candidate> {
        let mut shader = self.stand.base.clone();
        let mut steps = Vec::new();
        for _ in 0..ROUNDS {
            let before = steps.len();
            let offered = offered(sets, &shader);
            // Folding brings out the zeros and ones.
            let (fixed, absent): (Vec<_>, Vec<_>) = offered.into_iter().partition(is_fixed);
            for round in [fixed, absent] {
                for candidate in round {
                    if !wanted(&candidate) || self.kept.refuses(&candidate) {
                        continue;
                    }
                    if let Ok(next) = recipe::apply(&shader, &candidate)
                        && self.kept.holds(&next)
                    {
                        shader = next;
                        steps.push(candidate);
                    }
                }
                if steps.len() > before {
                    break;
                }
            }
            if steps.len() == before {
                break;
            }
        }
        steps
    }
}

/// The exact changes that every set of samples has nothing against.
fn offered(sets: &[SampleSet<'_>], shader: &Shader) -> Vec<Candidate> {
    let mut offered: Option<Vec<Candidate>> = None;
    for set in sets {
        let facts = set.facts(shader);
        let passes = PASSES.iter().filter(|pass| pass.is_exact());
        let here: Vec<Candidate> = passes
            .flat_map(|pass| pass.candidates(shader, &facts))
            .collect();
        match &mut offered {
            Some(offered) => offered.retain(|candidate| here.contains(candidate)),
            None => offered = Some(here),
        }
    }
    offered.unwrap_or_default()
}

/// What the exact passes still think of, and decline.
fn declined(set: &SampleSet<'_>, shader: &Shader) -> Vec<Considered> {
    let facts = set.facts(shader);
    let passes = PASSES.iter().filter(|pass| pass.is_exact());
    let considered = passes.flat_map(|pass| pass.consider(shader, &facts));
    considered.filter(|c| c.declined.is_some()).collect()
}

/// The choices of those steps which fold something without which there is more work.
fn needed(base: &Shader, steps: &[Candidate]) -> BTreeSet<String> {
    let (fixed, rest): (Vec<_>, Vec<_>) = steps.iter().cloned().partition(is_fixed);
    let work = |fixed: &[Candidate]| {
        let mut shader = specialize::together(base, fixed);
        for _ in 0..ROUNDS {
            let before = shader.fingerprint();
            shader = specialize::together(&shader, &rest);
            if shader.fingerprint() == before {
                break;
            }
        }
        static_work(&shader)
    };
    let least = work(&fixed);
    let without = |left_out: &dyn Fn(usize) -> bool| -> f64 {
        let kept = (0..fixed.len()).filter(|i| !left_out(*i));
        let kept: Vec<Candidate> = kept.map(|i| fixed[i].clone()).collect();
        work(&kept)
    };
    let idle: Vec<usize> = (0..fixed.len())
        .into_par_iter()
        .filter(|i| without(&|other| other == *i) <= least)
        .collect();
    // Of several that do the same, one has to stay.
    let mut left_out: BTreeSet<usize> = idle.iter().copied().collect();
    if without(&|i| left_out.contains(&i)) > least {
        left_out.clear();
        for i in idle {
            left_out.insert(i);
            if without(&|other| left_out.contains(&other)) > least {
                left_out.remove(&i);
            }
        }
    }
    let stay = (0..fixed.len()).filter(|i| !left_out.contains(i));
    stay.map(|i| fixed[i].choice.clone()).collect()
}

/// What the fragment stage does when all branches are taken once, as one number, control flow included: a test that goes
/// is worth something too.
fn static_work(shader: &Shader) -> f64 {
    let Some(function) = shader.function(Stage::Fragment) else {
        return 0.0;
    };
    let work = cost::of_function(shader.module(), function).unwrap_or_else(|_| Work::default());
    let mut branches = 0;
    lodc_passes::operands::walk(&function.body, &mut |statement| {
        branches += u32::from(matches!(
            statement,
            naga::Statement::If { .. }
                | naga::Statement::Switch { .. }
                | naga::Statement::Loop { .. }
        ));
    });
    work.total() + f64::from(branches)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compile::normal_form;
    use crate::eval::program::Program;
    use crate::front::Source;
    use crate::scene::Scene;
    use std::path::Path;

    /// The exact tier of a shader in a scene, but for what is to be kept.
    fn exact(source: &Source, path: &Path, scene: &str, read: &[&str]) -> (Exact, bool) {
        let scene = Scene::resolve(source, Some((path, scene))).unwrap_or_else(|e| panic!("{e}"));
        let base = normal_form(source).unwrap_or_else(|e| panic!("{e}"));
        let program = |module, at| Program::compile(module, at, &[]).expect("it runs");
        let vertex = match (&scene.vertex_stage, base.index(Stage::Vertex)) {
            (Some(stage), _) => program(&stage.module, 0),
            (None, at) => program(base.module(), at.expect("it has one")),
        };
        let stand = Stand {
            base: &base,
            vertex: &vertex,
            scene: &scene,
        };
        let kept = Kept {
            read: read.iter().map(|name| (*name).to_owned()).collect(),
            ..Kept::default()
        };
        let full = |distance| SampleSet::new(&stand, distance, Samples::Full).expect("it runs");
        let nearest = full(scene.distances[0]);
        let exact = Exact::find(&stand, &nearest, &kept).expect("it runs");
        exact.shader.validate().expect("it is valid");
        let middle = full(scene.distances[scene.distances.len() / 2]);
        let mut sets = [nearest, middle].into_iter();
        let same = sets.all(|set| set.same(&base, &exact.shader).expect("it runs"));
        (exact, same)
    }

    #[test]
    fn what_is_exact_draws_every_material_to_the_bit() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata/materials");
        for material in crate::fixtures::shaders(&folder) {
            let path = material.with_extension("toml");
            let source = Source::read(&material).unwrap_or_else(|e| panic!("{e}"));
            let scene = std::fs::read_to_string(&path).expect("it has a scene");
            let lines = scene.lines();
            let rest = lines.filter(|line| !line.starts_with("resolution"));
            let small: Vec<&str> = std::iter::once("resolution = [48, 48]")
                .chain(rest)
                .collect();
            let (exact, same) = exact(&source, &path, &small.join("\n"), &[]);
            assert!(same, "{}: {:?}", path.display(), exact.recipe);
            eprintln!(
                "{}: cost {:.3}, {} steps",
                path.display(),
                exact.cost(),
                exact.recipe.0.len()
            );
            assert!(exact.cost() <= 1.0, "{}", path.display());
        }
    }

    const FLAGS: &str = "
        struct Material { flags: u32, coat: f32, tint: vec3f, gloss: f32 }
        @group(0) @binding(0) var<uniform> material: Material;
        @group(0) @binding(1) var coat_texture: texture_2d<f32>;
        @group(0) @binding(2) var coat_sampler: sampler;
        @fragment fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
            var colour = material.tint * pow(uv.x, material.gloss);
            if (material.flags & 2u) != 0u { colour *= textureSample(coat_texture, coat_sampler, uv).rgb; }
            colour += material.coat * vec3f(pow(uv.y, 8.0));
            return vec4f(colour, 1.0);
        }";

    const SCENE: &str = "
        resolution = [24, 24]
        [uniforms]
        \"material.flags\" = 5
        \"material.coat\" = 0
        \"material.tint\" = [0.5, 0.5, 0.25]
        \"material.gloss\" = { samples = [1.0, 2.0] }
        [textures]
        coat_texture = \"dynamic\"";

    #[test]
    fn only_what_saves_work_is_folded() {
        let source = Source::parse("flags.wgsl", FLAGS).expect("it parses");
        let (found, same) = exact(&source, Path::new("flags.toml"), SCENE, &[]);
        assert!(same);
        let folded: Vec<_> = found
            .recipe
            .0
            .iter()
            .filter_map(specialize::folded)
            .collect();
        let pair = |place: &str, value: &str| (place.to_owned(), value.to_owned());
        assert_eq!(
            folded,
            [pair("material.flags", "5"), pair("material.coat", "0")]
        );
        // The product with the coat, and the sum with that product.
        assert_eq!(found.recipe.0.len(), 4, "{:?}", found.recipe);
        assert_eq!(found.shader.module().global_variables.len(), 3);
        assert!(found.cost() < 1.0 && found.used[1].work.samples == 0.0);
    }

    #[test]
    fn what_is_kept_is_not_folded() {
        let source = Source::parse("flags.wgsl", FLAGS).expect("it parses");
        let path = Path::new("flags.toml");
        let (found, _) = exact(&source, path, SCENE, &["material.flags", "material.coat"]);
        assert_eq!(found.recipe, Recipe::default());
        // A texture that is kept keeps the flag that asks for it: false, it would go.
        let scene = SCENE.replace("= 5", "= 0");
        let (found, _) = exact(&source, path, &scene, &["coat_texture"]);
        let folded: Vec<_> = found
            .recipe
            .0
            .iter()
            .filter_map(specialize::folded)
            .collect();
        assert_eq!(folded, [("material.coat".to_owned(), "0".to_owned())]);
    }
}
