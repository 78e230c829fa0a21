//! The exact tier: everything that costs no error, made before a search, so that no lossy change is credited with it.
//!
//! Its changes are those of the passes that are exact, as long as there are any. Of the uniforms that the scene states only
//! those are folded that save work with the others: the levels go on reading the rest. What a number switches off goes into a
//! branch on it where the samples execute less for that. What comes out draws the same pictures, to the last bit of what is
//! displayed; that is looked at. The vertex stage is made exact as well where that saves enough of it, since levels then have one of
//! their own; it hands over the same numbers, which is looked at, too, so that the search goes on with the original's.

use super::kept::Kept;
use super::samples::{Measured, SampleSet, Samples};
use crate::eval::program::{Program, Refused};
use crate::eval::programs::Stand;
use crate::eval::raster::hand_over_the_same;
use lodc_passes::recipe::{self, Considered};
use lodc_passes::texture_removal::TextureRemoval;
use lodc_passes::{Candidate, Pass, Recipe, Shader, Stage, Used, Work, cost, specialize};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Rounds after which no more is looked for.
const ROUNDS: usize = 16;

/// What has to be saved of the vertex stage's work for levels to have one of their own, as a share.
const WORTH_A_STAGE: f64 = 0.04;

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
        let exact = steps.needed_of(stand.base, (&sets, Stage::Fragment));
        let made = |recipe: Vec<Candidate>| {
            let recipe = Recipe(recipe);
            let shader = recipe.replay(stand.base).ok()?;
            Some((recipe, shader))
        };
        // What the samples of a search did not show, all samples may.
        let only = |wanted: fn(&Candidate) -> bool| -> Vec<Candidate> {
            exact.iter().filter(|c| wanted(c)).cloned().collect()
        };
        let unbranched = only(|c| !is_branch(c));
        let (read, only_fixed) = (only(|c| !is_branch(c) && !is_read(c)), only(is_fixed));
        for recipe in [exact, unbranched, read, only_fixed] {
            if let Some((recipe, shader)) = made(recipe)
                && nearest.same(stand.base, &shader)?
            {
                let both = [nearest.original(), nearest.measure(&shader)?];
                let mut exact = Self {
                    recipe,
                    declined: declined(&sets[0], &shader),
                    used: both.map(|one| one.used),
                    costs: both.map(|one| one.cost),
                    shader,
                };
                exact.make_vertices(&steps, &sets);
                return Ok(exact);
            }
        }
        Ok(Self::none(stand, nearest))
    }
}

/// What one invocation of a stage does when all branches are taken once; nothing without the stage.
pub(crate) fn work_of(shader: &Shader, stage: Stage) -> Work {
    let function = shader.function(stage);
    let work = function.map(|function| cost::of_function(shader.module(), function));
    work.and_then(Result::ok).unwrap_or_default()
}

impl Exact {
    /// Makes the vertex stage exact, where that is worth a stage of its own.
    fn make_vertices(&mut self, steps: &Steps<'_>, sets: &[SampleSet<'_>]) {
        let found = steps.needed_of(&self.shader, (sets, Stage::Vertex));
        let (recipe, all) = (Recipe(found), &self.shader);
        let Ok(shader) = recipe.replay_from(all, steps.stand.base) else {
            return;
        };
        let [before, after] = [all, &shader].map(|shader| work_of(shader, Stage::Vertex).total());
        let hands_over_the_same = || {
            let [one, other] = [all, &shader].map(|shader| {
                let entry = shader.index(Stage::Vertex)?;
                Program::compile(shader.module(), entry, &[]).ok()
            });
            let (Some(one), Some(other)) = (one, other) else {
                return false;
            };
            let mut frames = sets.iter().flat_map(|set| &set.frames);
            frames.all(|frame| hand_over_the_same([&one, &other], &frame.frame))
        };
        if after < before * (1.0 - WORTH_A_STAGE) && hands_over_the_same() {
            self.recipe.0.extend(recipe.0);
            self.shader = shader;
        }
    }
}

/// Whether a change folds what the scene states.
fn is_fixed(candidate: &Candidate) -> bool {
    specialize::folded(candidate).is_some()
}

/// Whether a change puts into a branch what a number switches off.
fn is_branch(candidate: &Candidate) -> bool {
    specialize::branched(candidate).is_some()
}

/// Whether a change removes reads of a texture that has one colour.
fn is_read(candidate: &Candidate) -> bool {
    candidate.pass == TextureRemoval.name()
}

/// What looks for the steps.
struct Steps<'a> {
    stand: &'a Stand<'a>,
    kept: &'a Kept,
}

impl Steps<'_> {
    /// The exact changes of a stage that may be made, without those that fold what saves no work.
    fn needed_of(&self, start: &Shader, of: (&[SampleSet<'_>], Stage)) -> Vec<Candidate> {
        let all = self.of(start, of, &|_| true);
        let needed = needed(start, &all, of.1);
        match needed.len() == all.len() {
            true => all,
            false => self.of(start, of, &|candidate| {
                !is_fixed(candidate) || needed.contains(&candidate.choice)
            }),
        }
    }

    /// The exact changes of a stage that may be made, one after another, until there are none.
    fn of(
        &self,
        start: &Shader,
        (sets, stage): (&[SampleSet<'_>], Stage),
        wanted: &dyn Fn(&Candidate) -> bool,
    ) -> Vec<Candidate> {
        let mut shader = start.clone();
        let mut steps = Vec::new();
        for _ in 0..ROUNDS {
            let before = steps.len();
            let offered = offered(sets, &shader, stage);
            // Folding brings out the zeros and ones, and what goes with those needs no branch.
            let (fixed, rest): (Vec<_>, Vec<_>) = offered.into_iter().partition(is_fixed);
            let (branches, absent): (Vec<_>, Vec<_>) = rest.into_iter().partition(is_branch);
            for round in [fixed, absent, branches] {
                for candidate in round {
                    if !wanted(&candidate) || self.kept.refuses(&candidate) {
                        continue;
                    }
                    if let Ok(next) = recipe::apply(&shader, &candidate)
                        && self.kept.holds(&next)
                        && (!is_branch(&candidate) || saves(sets, &shader, &next))
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

/// Whether a variant executes less than another over all sets.
fn saves(sets: &[SampleSet<'_>], before: &Shader, after: &Shader) -> bool {
    let work = |shader: &Shader| -> Result<f64, Refused> {
        let works = sets.iter().map(|set| Ok(set.measure(shader)?.cost));
        works.sum()
    };
    matches!((work(before), work(after)), (Ok(before), Ok(after)) if after < before)
}

/// The exact changes of a stage that every set of samples has nothing against.
fn offered(sets: &[SampleSet<'_>], shader: &Shader, stage: Stage) -> Vec<Candidate> {
    let mut offered: Option<Vec<Candidate>> = None;
    for set in sets {
        let facts = match stage {
            Stage::Vertex => set.vertex_facts(shader),
            _ => set.facts(shader),
        };
        let free = shader.passes().iter().flat_map(|pass| {
            let candidates = pass.candidates(shader, &facts).into_iter();
            candidates.filter(|c| pass.is_free(c) && specialize::stage(shader, c) == Some(stage))
        });
        let here: Vec<Candidate> = free.collect();
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
    let passes = shader.passes().iter().filter(|pass| pass.is_exact());
    let considered = passes.flat_map(|pass| pass.consider(shader, &facts));
    let of_fragments =
        |c: &Considered| specialize::stage(shader, &c.candidate) == Some(Stage::Fragment);
    let declined = considered.filter(|c| c.declined.is_some() && of_fragments(c));
    declined.collect()
}

/// The choices of those steps which fold something without which there is more work.
fn needed(base: &Shader, steps: &[Candidate], stage: Stage) -> BTreeSet<String> {
    let (fixed, rest): (Vec<_>, Vec<_>) = steps.iter().cloned().partition(is_fixed);
    let work = |fixed: &[Candidate]| {
        let mut shader = specialize::together(base, fixed);
        for candidate in rest.iter().filter(|candidate| is_read(candidate)) {
            shader = recipe::apply(&shader, candidate).unwrap_or(shader);
        }
        for _ in 0..ROUNDS {
            let before = shader.fingerprint();
            shader = specialize::together(&shader, &rest);
            if shader.fingerprint() == before {
                break;
            }
        }
        static_work(&shader, stage)
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

/// What a stage does when all branches are taken once, as one number, control flow included: a test that goes is worth
/// something too.
fn static_work(shader: &Shader, stage: Stage) -> f64 {
    let Some(function) = shader.function(stage) else {
        return 0.0;
    };
    let mut branches = 0;
    lodc_passes::operands::walk(&function.body, &mut |statement| {
        branches += u32::from(matches!(
            statement,
            naga::Statement::If { .. }
                | naga::Statement::Switch { .. }
                | naga::Statement::Loop { .. }
        ));
    });
    work_of(shader, stage).total() + f64::from(branches)
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
    fn what_a_sampled_number_switches_off_goes_into_a_branch() {
        let source = Source::parse("flags.wgsl", FLAGS).expect("it parses");
        let path = Path::new("flags.toml");
        let scene = |coat: &str| {
            let fixed = "\"material.coat\" = 0";
            SCENE.replace(fixed, &format!("\"material.coat\" = {coat}"))
        };
        let text = FLAGS.replace("pow(uv.y, 8.0)", "pow(uv.y, 8.0) * exp(sin(uv.x) * uv.y)");
        let lit = Source::parse("flags.wgsl", text).expect("it parses");
        let branches = |found: &Exact| {
            let steps = found.recipe.0.iter();
            steps.filter(|step| is_branch(step)).count()
        };
        let [never, always, sampled] = [
            "{ samples = [0.25, 0.5] }",
            "{ dynamic = 0.0 }",
            "{ samples = [0.0, 0.5] }",
        ]
        .map(|coat| {
            let (found, same) = exact(&lit, path, &scene(coat), &[]);
            assert!(same, "{coat}");
            (branches(&found), found.cost())
        });
        assert_eq!([never.0, always.0, sampled.0], [0, 1, 1]);
        assert!(
            always.1 < sampled.1 && sampled.1 < never.1,
            "{always:?} {sampled:?} {never:?}"
        );
        // It is too little without the others.
        let (found, _) = exact(&source, path, &scene("{ dynamic = 0.0 }"), &[]);
        assert_eq!(branches(&found), 0, "{:?}", found.recipe);
        // What is to be kept is.
        let kept = exact(
            &lit,
            path,
            &scene("{ samples = [0.0, 0.5] }"),
            &["material.coat"],
        )
        .0;
        assert_eq!(branches(&kept), 1);
    }

    #[test]
    fn a_texture_of_one_colour_is_not_read() {
        let source = Source::parse("flags.wgsl", FLAGS).expect("it parses");
        let folder = std::env::temp_dir().join(format!("lodc-one-colour-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("it can be made");
        let texels = [[77, 130, 201, 255]; 256];
        let png = crate::eval::image::encode_png(16, 16, &texels).expect("it is small");
        std::fs::write(folder.join("coat.png"), png).expect("it can be written");
        let scene = SCENE
            .replace("= 5", "= { dynamic = 2 }")
            .replace("\"dynamic\"", "\"coat.png\"");
        let (found, same) = exact(&source, &folder.join("flags.toml"), &scene, &[]);
        std::fs::remove_dir_all(&folder).expect("it is there");
        assert!(same);
        assert!(found.recipe.0.iter().any(is_read), "{:?}", found.recipe);
        assert_eq!(found.used.map(|used| used.work.samples), [1.0, 0.0]);
    }

    #[test]
    fn the_vertex_stage_is_made_exact_where_that_is_worth_one_of_its_own() {
        let text = "
            struct Mesh { flags: u32, scale: f32, matrix: mat4x4f }
            @group(0) @binding(0) var<uniform> mesh: Mesh;
            struct Varyings { @builtin(position) clip: vec4f, @location(0) normal: vec3f }
            @vertex fn vs_main(@location(0) position: vec3f, @location(1) normal: vec3f) -> Varyings {
                var at = position;
                if (mesh.flags & 1u) != 0u { at += normal * sin(position.x * 9.0) * 0.1; }
                return Varyings(mesh.matrix * vec4f(at * mesh.scale, 1.0), normal);
            }
            @fragment fn fs_main(in: Varyings) -> @location(0) vec4f { return vec4f(in.normal, 1.0); }";
        let source = Source::parse("bulge.wgsl", text).expect("it parses");
        let base = normal_form(&source).expect("it is small");
        let of_base = base.stage_fingerprint(Stage::Vertex);
        let scene = |flags: &str, scale: &str| {
            format!(
                "resolution = [24, 24]
                 [uniforms]
                 \"mesh.matrix\" = \"model-view-projection\"
                 \"mesh.flags\" = {flags}
                 \"mesh.scale\" = {scale}"
            )
        };
        let made = |flags: &str, scale: &str| {
            let path = Path::new("bulge.toml");
            let (found, same) = exact(&source, path, &scene(flags, scale), &[]);
            assert!(same);
            let is_its_own = found.shader.stage_fingerprint(Stage::Vertex) != of_base;
            let changes = found.recipe.0.len();
            (
                is_its_own,
                changes,
                work_of(&found.shader, Stage::Vertex).total(),
            )
        };
        let before = work_of(&base, Stage::Vertex).total();
        let (is_its_own, changes, work) = made("6", "{ samples = [1.0, 0.5] }");
        assert!(
            is_its_own && changes == 1 && work < 0.8 * before,
            "{changes} {work} {before}"
        );
        // With the scale, which is 1, its product goes too.
        let (_, more, less) = made("6", "1.0");
        assert!(more == 3 && less < work, "{more} {less}");
        assert_eq!(
            made("{ dynamic = 6 }", "{ dynamic = 1.0 }"),
            (false, 0, before)
        );
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
