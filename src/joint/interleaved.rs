//! Pairs that are made for each other: each shader of a generation gets a mesh of its own, simplified as that shader draws it, and the
//! fastest pairs have the next generation of shaders.
//!
//! ```text
//! generation of shaders --simplify, each to the bound--> pairs --fastest fifth--> parents
//! parents --every change, the frontier of what is within the bound--> the next generation
//! ```
//!
//! The paper simplifies from the original mesh each time. Here a shader's mesh goes on from a mesh that the original shader's pictures gave,
//! where it has used up little of the bound: what is left to do is that which depends on the shader.
//!
//! This work is based on: Liang 2022, section 4.3.

use super::Settings;
use super::seen::Seen;
use crate::eval::program::Refused;
use crate::eval::programs::{Programs, Stand};
use crate::mesh::{Simplifier, Subject, Triangles, Until};
use crate::scene::Scene;
use crate::search::{Found, Kept, SampleSet, Samples, changes};
use crate::time::model::Model;
use lodc_mesh::Mesh;
use lodc_passes::{Fingerprint, Recipe, Shader, recipe};
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::sync::Arc;

/// How many generations there are.
const GENERATIONS: usize = 3;
/// How many shaders a generation has at most.
const BROOD: usize = 8;
/// How many of its pairs have children, as a share: Liang's N.
const PARENTS: f64 = 0.2;
/// How much of the bound the mesh that a simplification begins with may have used up.
const BEGUN: f64 = 0.25;
/// Of so many meshes of a simplification one is taken.
const KEPT: usize = 8;

/// What came of it.
pub(super) struct Spawned {
    pub(super) meshes: Vec<Arc<Mesh>>,
    /// With what makes them from what the exact tier made.
    pub(super) shaders: Vec<(Recipe, Shader)>,
    /// For each distance but the first the fastest pairs, as places of meshes and shaders.
    pub(super) pairs: Vec<Vec<(usize, usize)>>,
}

/// What pairs are made from.
pub(super) struct Nest<'a> {
    pub(super) stand: &'a Stand<'a>,
    /// The original.
    pub(super) subject: Subject<'a>,
    pub(super) found: &'a Found,
    pub(super) kept: &'a Kept,
    pub(super) model: Model,
    /// Meshes that were simplified with the original shader, the scene's own first.
    pub(super) meshes: &'a [Arc<Mesh>],
}

/// A shader on its way to a pair.
#[derive(Clone)]
struct Grown {
    recipe: Recipe,
    shader: Shader,
}

/// A pair within the bound.
struct Paired {
    grown: Grown,
    mesh: Arc<Mesh>,
    time: f64,
}

impl Nest<'_> {
    /// Spawns pairs at all distances of the search, which are all but the first; some are kept of each.
    pub(super) fn spawn(&self, settings: &Settings) -> Result<Spawned, Refused> {
        let mut spawned = Spawned {
            meshes: Vec::new(),
            shaders: Vec::new(),
            pairs: Vec::new(),
        };
        for at in &self.found.distances {
            let within = at.frontier.iter().filter(|seen| seen.strain <= 1.0);
            let recipes: Vec<&Recipe> = within.map(|seen| &seen.recipe).collect();
            let first = spread(recipes.len()).map(|place| recipes[place].clone());
            let mut paired = self.at(at.distance, settings, first.collect())?;
            paired.sort_by(|a, b| a.time.total_cmp(&b.time));
            paired.truncate(settings.pairs);
            let mut pairs = Vec::new();
            for Paired { grown, mesh, .. } in paired {
                pairs.push((spawned.meshes.len(), spawned.shaders.len()));
                spawned.meshes.push(mesh);
                spawned.shaders.push((grown.recipe, grown.shader));
            }
            spawned.pairs.push(pairs);
        }
        Ok(spawned)
    }

    /// All pairs of the generations at one distance.
    fn at(
        &self,
        distance: f64,
        settings: &Settings,
        first: Vec<Recipe>,
    ) -> Result<Vec<Paired>, Refused> {
        let scenes: Vec<Scene> = self.meshes.iter().map(|mesh| self.scene(mesh)).collect();
        let stands: Vec<Stand<'_>> = scenes.iter().map(|scene| self.stand(scene)).collect();
        let all: Vec<&Stand<'_>> = stands.iter().collect();
        let sets = SampleSet::of_meshes(&all, distance, Samples::Tiles)?;
        let exact = &self.found.exact.shader;
        let mut known: BTreeSet<Fingerprint> = BTreeSet::new();
        let grown = first.into_iter().filter_map(|recipe| {
            let shader = recipe.replay(exact).ok()?;
            known.insert(shader.fingerprint());
            Some(Grown { recipe, shader })
        });
        let mut generation: Vec<Grown> = grown.collect();
        let mut all = Vec::new();
        for number in 1..=GENERATIONS {
            let mut paired = Vec::new();
            for grown in std::mem::take(&mut generation) {
                paired.extend(self.pair(grown, distance, settings, &sets)?);
            }
            paired.sort_by(|a: &Paired, b| a.time.total_cmp(&b.time));
            let parents = (PARENTS * paired.len() as f64).ceil() as usize;
            if number < GENERATIONS {
                for parent in paired.iter().take(parents) {
                    let children = self.children(&parent.grown, &sets[0]).into_iter();
                    generation
                        .extend(children.filter(|grown| known.insert(grown.shader.fingerprint())));
                }
            }
            all.append(&mut paired);
        }
        Ok(all)
    }

    /// A shader with the simplest mesh that its own pictures allow; nothing where it is over the bound on every mesh.
    fn pair(
        &self,
        grown: Grown,
        distance: f64,
        settings: &Settings,
        sets: &[SampleSet<'_>],
    ) -> Result<Option<Paired>, Refused> {
        let bound = self.stand.scene.bound(distance);
        let programs = Programs::of(&grown.shader)?;
        // What the host fills or binds is not there when a mesh is simplified.
        if programs.parameters.is_some() || !programs.generated.is_empty() {
            return Ok(None);
        }
        let original = self.model.time(&sets[0].features(&sets[0].original()));
        let strain = |set: &SampleSet<'_>| Seen::of(set, &programs, &self.model, original);
        // Meshes become simpler from one to the next.
        let begins = sets.partition_point(|set| strain(set).strain(bound) <= BEGUN);
        let begin = begins.saturating_sub(1);
        let scene = self.scene(&self.meshes[begin]);
        let own = programs.vertex.as_ref();
        let drawn = Subject {
            vertex: own.map_or(self.stand.vertex, |(vertex, _)| vertex),
            fragment: &programs.fragment,
            scene: &scene,
        };
        let mut simplifier = Simplifier::against(self.subject, drawn, settings.simplification);
        let sequence = simplifier.run(distance, Until::Error(bound), &|_| {});
        let simpler = sequence.worth_keeping(KEPT).into_iter().rev();
        let meshes = simpler.map(|steps| {
            let left = Triangles::left(&sequence.surface(steps), &scene.mesh);
            Arc::new(left.mesh(&scene.mesh))
        });
        for mesh in meshes.chain([Arc::clone(&scene.mesh)]) {
            let scene = self.scene(&mesh);
            let stands = [self.stand, &self.stand(&scene)];
            let sets = SampleSet::of_meshes(&stands, distance, Samples::Tiles)?;
            let seen = Seen::of(&sets[1], &programs, &self.model, original);
            if seen.strain(bound) <= 1.0 {
                let time = seen.time;
                return Ok(Some(Paired { grown, mesh, time }));
            }
        }
        Ok(None)
    }

    /// Every change of a shader, of which those are left that are within the bound on the scene's own mesh and that none beats in both error and
    /// cost.
    fn children(&self, parent: &Grown, set: &SampleSet<'_>) -> Vec<Grown> {
        let facts = set.facts(&parent.shader);
        let candidates = changes(&parent.shader, &facts, [false; 2], self.kept);
        let tried: Vec<_> = (candidates.into_par_iter())
            .filter_map(|candidate| {
                let shader = recipe::apply(&parent.shader, &candidate).ok()?;
                let measured = set.measure(&shader).ok()?;
                let is_kept = measured.strain <= 1.0 && self.kept.holds(&shader);
                let mut recipe = parent.recipe.clone();
                recipe.0.push(candidate);
                is_kept.then_some((Grown { recipe, shader }, measured))
            })
            .collect();
        let mut order: Vec<usize> = (0..tried.len()).collect();
        order.sort_by(|a, b| tried[*a].1.cost.total_cmp(&tried[*b].1.cost));
        let mut least = f64::INFINITY;
        order.retain(|at| {
            let square = tried[*at].1.error.square();
            let is_better = square < least;
            least = least.min(square);
            is_better
        });
        let chosen = spread(order.len()).map(|place| tried[order[place]].0.clone());
        chosen.collect()
    }

    fn scene(&self, mesh: &Arc<Mesh>) -> Scene {
        let mut scene = self.stand.scene.clone();
        scene.mesh = Arc::clone(mesh);
        scene
    }

    fn stand<'s>(&'s self, scene: &'s Scene) -> Stand<'s> {
        Stand {
            base: self.stand.base,
            vertex: self.stand.vertex,
            scene,
        }
    }
}

/// At most a brood's places of so many, evenly from the first to the last.
fn spread(count: usize) -> impl Iterator<Item = usize> {
    let taken = BROOD.min(count);
    (0..taken).map(move |at| (at * (count - 1)).checked_div(taken - 1).unwrap_or(0))
}
