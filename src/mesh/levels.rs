//! Levels of a mesh: for each distance the fewest triangles whose pictures are within a bound, as pictures say that had no
//! part in choosing them.
//!
//! Each level goes on from the mesh of the one before (Liang 2022, section 5.1). What an established simplifier makes is
//! proposed beside it, where it is built in, and taken where it has fewer triangles.

use super::{Pictures, Sequence, Settings, Simplifier, Subject, Triangles, Until, Watch};
use crate::scene::Split;
use crate::scene::mesh::Mesh;

/// How many pictures a mesh is confirmed by, and how many say what its error is.
const HELD_OUT: usize = 24;

/// What a level is made for.
#[derive(Clone, Copy, Debug)]
pub struct Wanted {
    /// From the eye to the object's centre, world units.
    pub distance: f64,
    /// How far it is simplified.
    pub until: Until,
}

/// What made a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Maker {
    /// Our own simplification by pictures.
    Pictures,
    /// meshoptimizer, by positions alone.
    Meshopt,
    /// meshoptimizer, by attributes too.
    MeshoptAttributes,
}

impl Maker {
    /// What a table calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pictures => "pictures",
            Self::Meshopt => "meshopt",
            Self::MeshoptAttributes => "meshopt with attributes",
        }
    }
}

/// A mesh for a distance.
#[derive(Clone, Debug)]
pub struct MeshLevel {
    /// What it was made for.
    pub wanted: Wanted,
    /// What is drawn.
    pub triangles: Triangles,
    /// What made it.
    pub maker: Maker,
    /// What it adds to the original's error on pictures that had no part in making it: excess of the RMSE, 0..1.
    pub excess: f64,
    /// The original's own error on the same pictures, as a root.
    pub floor: f64,
    /// For each other maker that was asked: how many triangles it needs for the same, or what it adds with as many.
    pub others: Vec<(Maker, Other)>,
}

/// What another maker does where a level is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Other {
    /// So many triangles for the same bound.
    Triangles(usize),
    /// So much excess with as many triangles.
    Excess(f64),
}

/// Makes levels of the mesh of a subject's scene, the nearest first. `watch` is told how far it is: the level, from 0, and its
/// simplification.
pub fn levels(
    subject: Subject<'_>,
    wanted: &[Wanted],
    settings: Settings,
    watch: &dyn Fn(usize, Watch),
) -> Vec<MeshLevel> {
    let mut simplifier = Simplifier::new(subject, settings);
    let mut levels = Vec::new();
    for (number, wanted) in wanted.iter().enumerate() {
        let mesh = &subject.scene.mesh;
        let sequence = simplifier.run(wanted.distance, wanted.until, &|now| watch(number, now));
        let bound = match wanted.until {
            Until::Triangles(_) => None,
            Until::Error(bound) => Some((bound, held_out(subject, wanted, Split::Validation))),
        };
        let steps = match &bound {
            None => sequence.steps.len(),
            Some((bound, pictures)) => confirmed(&sequence, pictures, *bound, mesh),
        };
        simplifier.go_back(&sequence, steps);
        let own = Triangles::left(simplifier.surface(), mesh);
        let test = held_out(subject, wanted, Split::Test);
        let mut level = MeshLevel {
            wanted: *wanted,
            excess: test.excess(&own),
            floor: test.floor().sqrt(),
            triangles: own,
            maker: Maker::Pictures,
            others: Vec::new(),
        };
        propose(mesh, &mut level, bound.as_ref(), &test);
        levels.push(level);
    }
    levels
}

fn held_out<'a>(subject: Subject<'a>, wanted: &Wanted, split: Split) -> Pictures<'a> {
    Pictures::held_out(subject, wanted.distance, split, HELD_OUT)
}

/// After how many steps a sequence is last within a bound on these pictures. Errors rise with the steps, but for what is too
/// small to matter.
fn confirmed(sequence: &Sequence, pictures: &Pictures<'_>, bound: f64, mesh: &Mesh) -> usize {
    let is_within = |steps: &usize| {
        let triangles = Triangles::left(&sequence.surface(*steps), mesh);
        pictures.excess(&triangles) <= bound
    };
    let all = sequence.steps.len();
    if is_within(&all) {
        return all;
    }
    let (mut good, mut bad) = (0, all);
    while bad - good > 1 {
        let half = good.midpoint(bad);
        match is_within(&half) {
            true => good = half,
            false => bad = half,
        }
    }
    good
}

#[cfg(not(feature = "meshopt"))]
fn propose(_: &Mesh, _: &mut MeshLevel, _: Option<&(f64, Pictures<'_>)>, _: &Pictures<'_>) {}

/// Asks meshoptimizer for the same, and takes what it makes where that has fewer triangles.
#[cfg(feature = "meshopt")]
fn propose(
    mesh: &Mesh,
    level: &mut MeshLevel,
    bound: Option<&(f64, Pictures<'_>)>,
    test: &Pictures<'_>,
) {
    use super::baseline::to_triangles;
    for (maker, attributes) in [(Maker::Meshopt, false), (Maker::MeshoptAttributes, true)] {
        let Some((bound, validation)) = bound else {
            let made = to_triangles(mesh, level.triangles.count(), attributes);
            level
                .others
                .push((maker, Other::Excess(test.excess(&made))));
            continue;
        };
        // To a hundredth, which is closer than it hits a number.
        let (mut good, mut bad) = (mesh.indices.len() / 3, 0);
        let mut best = None;
        while good - bad > good / 100 + 1 {
            let half = good.midpoint(bad);
            let made = to_triangles(mesh, half, attributes);
            if validation.excess(&made) <= *bound {
                good = half;
                best = Some(made);
            } else {
                bad = half;
            }
        }
        let count = best
            .as_ref()
            .map_or(mesh.indices.len() / 3, Triangles::count);
        level.others.push((maker, Other::Triangles(count)));
        if let Some(made) = best.filter(|made| made.count() < level.triangles.count()) {
            level.excess = test.excess(&made);
            let ours = Other::Triangles(level.triangles.count());
            if level.maker == Maker::Pictures {
                level.others.insert(0, (Maker::Pictures, ours));
            }
            level.others.retain(|(other, _)| *other != maker);
            (level.triangles, level.maker) = (made, maker);
        }
    }
}
