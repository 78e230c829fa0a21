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
pub struct LevelMesh {
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
    /// What the other makers that were asked do in its place.
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

/// Makes levels of the mesh of a subject's scene, one after another.
pub struct Levels<'a> {
    subject: Subject<'a>,
    simplifier: Simplifier<'a>,
    /// At the distance of the last level: what confirms a mesh, and what its error is told by.
    judges: Option<(f64, [Pictures<'a>; 2])>,
}

impl<'a> Levels<'a> {
    /// None made yet.
    pub fn new(subject: Subject<'a>, settings: Settings) -> Self {
        Self {
            subject,
            simplifier: Simplifier::new(subject, settings),
            judges: None,
        }
    }

    /// The pictures that meshes are confirmed by at a distance, and those that their error is told by.
    fn judges(&mut self, distance: f64) -> &[Pictures<'a>; 2] {
        let subject = self.subject;
        let kept = self.judges.take().filter(|(at, _)| *at == distance);
        let made = kept.unwrap_or_else(|| {
            let splits = [Split::Validation, Split::Test];
            let held_out = |split| Pictures::held_out(subject, distance, split, HELD_OUT);
            (distance, splits.map(held_out))
        });
        &self.judges.insert(made).1
    }

    /// Makes the next level, from the mesh of the last one. `watch` is told how far it is.
    pub fn make(&mut self, wanted: Wanted, watch: &dyn Fn(Watch)) -> LevelMesh {
        let mesh = &self.subject.scene.mesh;
        let sequence = self.simplifier.run(wanted.distance, wanted.until, watch);
        let [validation, test] = self.judges(wanted.distance);
        let steps = match wanted.until {
            Until::Triangles(_) => sequence.steps.len(),
            Until::Error(bound) => confirmed(&sequence, validation, bound, mesh),
        };
        let own = Triangles::left(&sequence.surface(steps), mesh);
        let level = LevelMesh {
            wanted,
            excess: test.excess(&own),
            floor: test.floor().sqrt(),
            triangles: own,
            maker: Maker::Pictures,
            others: Vec::new(),
        };
        self.simplifier.go_back(&sequence, steps);
        level
    }

    /// Asks established simplifiers for the same, and takes what they make where that has fewer triangles within the bound.
    #[cfg(feature = "meshopt")]
    pub fn propose(&mut self, level: &mut LevelMesh) {
        use super::baseline::to_triangles;
        let mesh = &self.subject.scene.mesh;
        let [validation, test] = self.judges(level.wanted.distance);
        for (maker, attributes) in [(Maker::Meshopt, false), (Maker::MeshoptAttributes, true)] {
            let Until::Error(bound) = level.wanted.until else {
                let made = to_triangles(mesh, level.triangles.count(), attributes);
                let excess = test.excess(&made);
                level.others.push((maker, Other::Excess(excess)));
                continue;
            };
            // To a hundredth, which is closer than it hits a number.
            let (mut good, mut bad) = (mesh.indices.len() / 3, 0);
            let mut best = None;
            while good - bad > good / 100 + 1 {
                let half = good.midpoint(bad);
                let made = to_triangles(mesh, half, attributes);
                if validation.excess(&made) <= bound {
                    good = half;
                    best = Some(made);
                } else {
                    bad = half;
                }
            }
            let all = mesh.indices.len() / 3;
            let count = best.as_ref().map_or(all, Triangles::count);
            let before = (level.maker, Other::Triangles(level.triangles.count()));
            match best.filter(|made| made.count() < level.triangles.count()) {
                Some(made) => {
                    level.others.push(before);
                    level.excess = test.excess(&made);
                    (level.triangles, level.maker) = (made, maker);
                }
                None => level.others.push((maker, Other::Triangles(count))),
            }
        }
    }
}

/// After how many steps a sequence is last within a bound on these pictures. Errors rise with the steps, but for what is too
/// small to matter.
fn confirmed(sequence: &Sequence, pictures: &Pictures<'_>, bound: f64, mesh: &Mesh) -> usize {
    let is_within = |steps: usize| {
        let triangles = Triangles::left(&sequence.surface(steps), mesh);
        pictures.excess(&triangles) <= bound
    };
    let all = sequence.steps.len();
    if is_within(all) {
        return all;
    }
    let (mut good, mut bad) = (0, all);
    while bad - good > 1 {
        let half = good.midpoint(bad);
        match is_within(half) {
            true => good = half,
            false => bad = half,
        }
    }
    good
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compile::normal_form;
    use crate::eval::program::Program;
    use crate::front::Source;
    use crate::scene::Scene;
    use lodc_passes::Stage;
    use std::path::Path;

    #[test]
    fn levels_are_within_their_bounds_and_each_goes_on_from_the_one_before() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata/materials/clay.wgsl");
        let source = Source::read(&path).expect("it parses");
        let base = normal_form(&source).expect("it is small");
        let [vertex, fragment] = [Stage::Vertex, Stage::Fragment].map(|stage| {
            let entry = base.index(stage).expect("it has one");
            Program::compile(base.module(), entry, &[]).expect("it runs")
        });
        let mut scene = Scene::read_on(&source, None, "torus-knot").expect("it resolves");
        scene.resolution = [96, 96];
        let subject = Subject {
            vertex: &vertex,
            fragment: &fragment,
            scene: &scene,
        };
        let settings = Settings {
            views: 8,
            ..Settings::default()
        };
        let wanted = [(3.0, 0.01), (6.0, 0.02), (12.0, 0.04)].map(|(distance, bound)| Wanted {
            distance,
            until: Until::Error(bound),
        });
        let mut levels = Levels::new(subject, settings);
        let mut before = scene.mesh.indices.len() / 3;
        for wanted in wanted {
            let level = levels.make(wanted, &|_| {});
            let Until::Error(bound) = wanted.until else {
                unreachable!("each has one");
            };
            let [validation, _] = levels.judges(wanted.distance);
            assert!(validation.excess(&level.triangles) <= bound);
            // Pictures that nobody has seen agree, but for chance: a few pixels of outline in small pictures.
            assert!(level.excess <= 2.0 * bound, "{} {bound}", level.excess);
            let count = level.triangles.count();
            assert!(count < before, "{count} of {before}");
            before = count;
        }
    }
}
