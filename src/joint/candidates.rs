//! What pairs are made of: meshes that are worth keeping, and shaders of the frontiers.
//!
//! This work is based on: Liang 2022, sections 5.1 and 5.2.

use super::Settings;
use crate::mesh::{Sequence, Simplifier, Subject, Triangles, Until};
use crate::search::Found;
use lodc_mesh::{Mesh, subdivide};
use lodc_passes::{Recipe, Shader};
use std::collections::BTreeSet;
use std::sync::Arc;

/// A mesh that has more than this share of the triangles of the one before is no other mesh.
const LIKE: f64 = 0.95;

/// A mesh on the way down: in which sequence, after how many steps, with how many triangles.
type Place = (usize, usize, usize);

/// Meshes, the scene's own first, each simpler than the one before. Each distance goes on from the last mesh of the one before
/// until the bound there, under the original shader. Half of them are those between which the error changes; the others lie where those are
/// farthest apart by their triangles, since a pair with a simpler shader has less of the bound left for its mesh.
pub(super) fn meshes(subject: Subject<'_>, settings: &Settings) -> Vec<Arc<Mesh>> {
    let scene = subject.scene;
    let original = &scene.mesh;
    if settings.meshes < 2 {
        return vec![Arc::clone(original)];
    }
    let distances = scene.distances.get(1..).unwrap_or_default();
    let mut simplifier = Simplifier::new(subject, settings.simplification);
    let sequences: Vec<Sequence> = (distances.iter())
        .map(|distance| {
            let until = Until::Error(scene.bound(*distance));
            simplifier.run(*distance, until, &|_| {})
        })
        .collect();
    let most = (settings.meshes / 2).div_ceil(sequences.len().max(1));
    let mut kept = Vec::new();
    for (at, sequence) in sequences.iter().enumerate() {
        let steps = sequence.worth_keeping(most).into_iter();
        kept.extend(steps.map(|steps| (at, steps, sequence.steps[steps - 1].triangles)));
    }
    let whole = original.indices.len() / 3;
    let kept = spread(whole, kept, &sequences, settings.meshes - 1);
    let made = kept.into_iter().map(|(at, steps, _)| {
        let triangles = Triangles::left(&sequences[at].surface(steps), original);
        Arc::new(triangles.mesh(original))
    });
    std::iter::once(Arc::clone(original)).chain(made).collect()
}

/// The most triangles of a finer mesh: where there are more, triangles are small already.
const MOST_FINER: usize = 200_000;

/// A mesh with four triangles for each of the original's, for shaders that compute at the vertices; nothing where there are none.
pub(super) fn finer(original: &Mesh, shaders: &[(Recipe, Shader)]) -> Option<Arc<Mesh>> {
    let mut shaders = shaders.iter();
    let is_wanted = shaders.any(|(_, shader)| shader.handing_over().is_some());
    let is_small = 4 * original.indices.len() / 3 <= MOST_FINER;
    (is_wanted && is_small).then(|| Arc::new(subdivide(original)))
}

/// Places without those that are like the one before, and with others between them where they are farthest apart, up to so many.
fn spread(whole: usize, kept: Vec<Place>, sequences: &[Sequence], most: usize) -> Vec<Place> {
    let mut places: Vec<Place> = Vec::new();
    for place in kept {
        let before = places.last().map_or(whole, |(_, _, triangles)| *triangles);
        if (place.2 as f64) < LIKE * before as f64 {
            places.push(place);
        }
    }
    let all: Vec<Place> = (sequences.iter().enumerate())
        .flat_map(|(at, sequence)| {
            let steps = (1..).zip(&sequence.steps);
            steps.map(move |(steps, step)| (at, steps, step.triangles))
        })
        .collect();
    while places.len() < most {
        let befores = std::iter::once(whole).chain(places.iter().map(|place| place.2));
        let gaps = befores.zip(places.iter().map(|place| place.2)).enumerate();
        let ratio = |(_, (before, after)): &(usize, (usize, usize))| *before as f64 / *after as f64;
        let widest = gaps.max_by(|a, b| ratio(a).total_cmp(&ratio(b)).then(b.0.cmp(&a.0)));
        let Some((at, (before, after))) = widest else {
            break;
        };
        let middle = (before as f64 * after as f64).sqrt() as usize;
        // Triangles become fewer from step to step.
        let found = all.partition_point(|place| place.2 > middle);
        let is_between = |place: &&Place| {
            (place.2 as f64) < LIKE * before as f64 && (after as f64) < LIKE * place.2 as f64
        };
        match all.get(found).filter(is_between) {
            Some(place) => places.insert(at, *place),
            None => break,
        }
    }
    places
}

/// Shaders with the recipes that make them from what the exact tier made: the original, what draws the same for less, where there is that, the
/// levels that were found, and what was within the bound on the frontiers, evenly from each.
pub(super) fn shaders(base: &Shader, found: &Found, most: usize) -> Vec<(Recipe, Shader)> {
    let exact = &found.exact;
    let mut shaders = vec![(Recipe::default(), base.clone())];
    let mut known = BTreeSet::from([base.fingerprint()]);
    let mut add = |recipe: &Recipe| {
        if let Ok(shader) = recipe.replay(&exact.shader)
            && known.insert(shader.fingerprint())
            && shaders.len() < most
        {
            shaders.push((recipe.clone(), shader));
        }
    };
    add(&Recipe::default());
    for level in found.levels.iter().filter(|level| !level.is_original) {
        add(&level.recipe);
    }
    let each = most.div_ceil(found.distances.len().max(1)).max(2);
    for at in &found.distances {
        let within: Vec<_> = (at.frontier.iter())
            .filter(|seen| seen.strain <= 1.0)
            .collect();
        let last = within.len().saturating_sub(1);
        for place in 0..each.min(within.len()) {
            let of = each.min(within.len()) - 1;
            add(&within[(place * last).checked_div(of).unwrap_or(0)].recipe);
        }
    }
    shaders
}
