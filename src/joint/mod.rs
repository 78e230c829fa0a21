//! The joint search: which pairs of a mesh and a shader are worth having, and from which distances on.
//!
//! ```text
//! scene's mesh --candidates--> meshes       worth keeping, of a simplification by pictures; and a finer one
//! Found --candidates--> shaders             of the frontiers of a search on the scene's own mesh
//! meshes x shaders --walk--> pairs          at each distance, along the boundary of what is within the bound
//! pairs x distances --seen--> errors, times, and what is seen where one replaces another
//! --table, lodc_joint--> plan               which pair is used in which bin of distances
//! plan --confirm--> levels                  or the table is corrected, and another plan is made
//! ```
//!
//! What is chosen from numbers alone is [`lodc_joint`]'s. The search of shaders and the simplification of meshes do not know of
//! each other; this is where they meet. It knows nothing of the command line or of reports.
//!
//! This work is based on: Liang 2022, sections 5 and 6.

mod candidates;
mod clock;
mod confirm;
mod interleaved;
mod seen;
mod table;

use crate::eval::program::{Program, Refused};
use crate::eval::programs::Stand;
use crate::mesh::{self, Subject};
use crate::scene::Scene;
use crate::search::{Found, Kept, Level, SampleSet, Samples, examine};
use crate::stability::Battery;
use crate::time::clock::Clock;
use crate::time::model::Model;
use confirm::{Confirmer, Pieces};
use interleaved::Nest;
use lodc_joint::{
    Monotonicity, NEAR, Pair, Prices, Score, Walk, exhaustive, near_fastest, walk as walked_along,
};
use lodc_mesh::Mesh;
use seen::{At, Candidates};
use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::{Duration, Instant};
use table::{Run, Table};

/// How pairs are looked for at a distance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Way {
    /// Along the boundary of what is within the bound: at most K + L of K x L.
    #[default]
    Separate,
    /// All of them.
    Exhaustive,
    /// Along the boundary, and besides pairs whose mesh was simplified as their shader draws it.
    Interleaved,
}

/// How much is looked for.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// How pairs are looked for.
    pub way: Way,
    /// How many meshes there are at most, with the original: Liang's K.
    pub meshes: usize,
    /// How many shaders there are at most, with the original: Liang's L.
    pub shaders: usize,
    /// How many pairs of a distance are candidates for levels at most.
    pub pairs: usize,
    /// How meshes are simplified.
    pub simplification: mesh::Settings,
    /// What transitions and switches cost.
    pub prices: Prices,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            way: Way::default(),
            meshes: 16,
            shaders: 24,
            pairs: 4,
            simplification: mesh::Settings::default(),
            prices: Prices::default(),
        }
    }
}

/// What was looked at, at one distance.
#[derive(Clone, Debug)]
pub struct Walked {
    /// From the eye to the object's centre, world units.
    pub distance: f64,
    /// How many pairs, on the way.
    pub pairs: usize,
    /// How many with a finer mesh than the scene's own, besides.
    pub finer: usize,
    /// How far their errors were monotone.
    pub monotonicity: Monotonicity,
}

/// What several ways to choose among the same pairs come to, by the same errors and times. All but `paper` and `fastest` are of levels that
/// were confirmed.
#[derive(Clone, Copy, Debug)]
pub struct Scores {
    /// Of what was chosen: thresholds and pairs at once.
    pub chosen: Score,
    /// Of the paper's steps: the smoothest path through the fastest pairs of the distances, merged.
    pub paper: Score,
    /// Of the fastest pair of each bin.
    pub fastest: Score,
    /// Of simpler meshes with the original shader alone.
    pub meshes: Score,
    /// Of simpler shaders on the scene's own mesh alone.
    pub shaders: Score,
    /// Where other pairs were looked at, too: of those alone that a walk along the boundary looks at.
    pub walk: Option<Score>,
}

/// How long the stages of a joint search took.
#[derive(Clone, Copy, Debug, Default)]
pub struct Took {
    /// To simplify the mesh.
    pub meshes: Duration,
    /// To simplify meshes for shaders, where that was wanted.
    pub interleaving: Duration,
    /// To measure the errors of pairs, and what is seen between them.
    pub pairs: Duration,
    /// To time pairs, where there was a clock.
    pub timing: Duration,
    /// To choose levels and confirm them.
    pub levels: Duration,
}

/// A level: a pair, from a distance on.
#[derive(Clone, Debug)]
pub struct JointLevel {
    /// The shader, with the error and the time of the pair.
    pub level: Level,
    /// Which mesh; 0 is the scene's own.
    pub mesh: usize,
    /// What is seen where it takes the place of the level before, as a root mean square, 0..1; nothing for the first.
    pub shown: Option<f64>,
}

/// What a joint search gives.
#[derive(Clone, Debug)]
pub struct Joint {
    /// The levels, nearest first; the first is the original.
    pub levels: Vec<JointLevel>,
    /// The meshes that there were to choose from: the scene's own first, then simpler ones, then a finer one, where shaders compute at
    /// vertices.
    pub meshes: Vec<Arc<Mesh>>,
    /// How many of them are finer.
    pub finer: usize,
    /// How many of them, the last ones, were made for a shader each.
    pub spawned: usize,
    /// How many shaders there were, without those that meshes were made for.
    pub shaders: usize,
    /// What was looked at.
    pub walked: Vec<Walked>,
    /// How many pairs were timed at a distance.
    pub timed: u64,
    /// What the choice comes to, beside others.
    pub scores: Scores,
    /// What transitions and switches cost.
    pub prices: Prices,
    /// How long it took.
    pub took: Took,
}

/// Looks for pairs of a mesh and a shader. `fragment` is the original's fragment stage; shaders are those that `found` has seen
/// on the scene's own mesh, and `kept` says what levels may not do. With a clock, the pairs that the
/// model puts within reach of the fastest are timed, and chosen by that; without, by their estimated times.
///
/// # Errors
/// When the evaluator refuses the original, at the expression.
pub fn find(
    stand: &Stand<'_>,
    fragment: &Program,
    found: &Found,
    (settings, kept): (&Settings, &Kept),
    mut clock: Option<&mut dyn Clock>,
) -> Result<Joint, Refused> {
    let scene = stand.scene;
    let subject = Subject {
        vertex: stand.vertex,
        fragment,
        scene,
    };
    let mut took = Took::default();
    let mut start = Instant::now();
    let mut meshes = candidates::meshes(subject, settings);
    took.meshes = start.elapsed();
    start = Instant::now();
    let mut shaders = candidates::shaders(stand.base, found, settings.shaders);
    // Behind those that the walk goes along.
    let simpler = meshes.len();
    let model = clock
        .as_ref()
        .map_or_else(Model::estimated, |clock| clock.model());
    let spawned = match settings.way {
        Way::Separate | Way::Exhaustive => None,
        Way::Interleaved => Some(Nest {
            stand,
            subject,
            found,
            kept,
            model: model.clone(),
            meshes: &meshes,
        }),
    };
    let spawned = spawned.map(|nest| nest.spawn(settings)).transpose()?;
    took.interleaving = start.elapsed();
    start = Instant::now();
    meshes.extend(candidates::finer(&scene.mesh, &shaders).filter(|_| settings.meshes > 1));
    // Behind those that were looked for apart.
    let (apart, of_pairs) = ([meshes.len(), shaders.len()], spawned);
    let mut bred: Vec<Vec<Pair>> = Vec::new();
    if let Some(spawned) = of_pairs {
        meshes.extend(spawned.meshes);
        shaders.extend(spawned.shaders);
        let pair = |(mesh, shader): &(usize, usize)| Pair {
            mesh: apart[0] + mesh,
            shader: apart[1] + shader,
        };
        let of_distances = spawned.pairs.iter();
        bred = of_distances
            .map(|all| all.iter().map(pair).collect())
            .collect();
    }
    let scenes: Vec<Scene> = (meshes.iter())
        .map(|mesh| {
            let mut scene = scene.clone();
            scene.mesh = Arc::clone(mesh);
            scene
        })
        .collect();
    let stands: Vec<Stand<'_>> = (scenes.iter())
        .map(|scene| Stand {
            base: stand.base,
            vertex: stand.vertex,
            scene,
        })
        .collect();
    let candidates = Candidates::new(&stands, &shaders, model)?;
    let (reach, pairs) = match clock {
        Some(_) => (clock::REACH, 2 * settings.pairs),
        None => (NEAR, settings.pairs),
    };
    // The original as it stands is drawn near by alone: what draws the same for less takes its place.
    let original = Pair { mesh: 0, shader: 0 };
    let first = usize::from(!found.exact.recipe.0.is_empty());

    let mut walked = Vec::new();
    let mut near = Vec::new();
    let always = [0, first].map(|shader| Pair { mesh: 0, shader });
    let mut chosen: BTreeSet<Pair> = always.into();
    let mut of_walk = chosen.clone();
    for distance in scene.distances.iter().copied().skip(1) {
        let all: Vec<usize> = (0..apart[0]).collect();
        let at = At::new(&candidates, &all, distance)?;
        let order = at.by_error(first..apart[1]);
        let bound = scene.bound(distance);
        let pair_of = |pair: Pair| Pair {
            shader: order[pair.shader],
            ..pair
        };
        let strain = |pair: Pair| Ok::<_, Refused>(at.seen(pair_of(pair)).strain(bound));
        let walk = match settings.way {
            Way::Separate | Way::Interleaved => walked_along(simpler, order.len(), strain)?,
            Way::Exhaustive => exhaustive(simpler, order.len(), strain)?,
        };
        // What is interpolated too coarsely on the scene's own mesh may do on a finer one.
        let coarse = order.iter().filter(|&&shader| {
            let own = Pair { mesh: 0, shader };
            candidates.programs[shader].vertex.is_some() && at.seen(own).strain(bound) > 1.0
        });
        let finer: Vec<Pair> = (simpler..apart[0])
            .flat_map(|mesh| coarse.clone().map(move |&shader| Pair { mesh, shader }))
            .collect();
        let least = |a: &Pair, b: &Pair| at.seen(*a).time.total_cmp(&at.seen(*b).time);
        let is_within = |pair: &Pair| at.seen(*pair).strain(bound) <= 1.0;
        // The fastest, and what is to choose from besides.
        let promising = |walk: &Walk| -> (Vec<Pair>, Vec<Pair>) {
            let mut within: Vec<Pair> = walk.within().into_iter().map(pair_of).collect();
            within.extend(finer.iter().filter(|pair| is_within(pair)));
            let times: Vec<f64> = within.iter().map(|pair| at.seen(*pair).time).collect();
            let fastest = near_fastest(&times, reach).into_iter().take(pairs);
            let fastest: Vec<Pair> = fastest.map(|place| within[place]).collect();
            // What a simpler mesh or a simpler shader would gain alone is there to choose too, however little that is here: one that
            // is the same at many distances needs no switch. All shaders were seen on the scene's own mesh.
            let of_meshes = (within.iter().copied()).filter(|pair| pair.shader == first);
            let of_shaders = order.iter().map(|&shader| Pair { mesh: 0, shader });
            let of_shaders = of_shaders.filter(is_within);
            let alone = [of_meshes.min_by(least), of_shaders.min_by(least)];
            let all = fastest.iter().copied().chain(alone.into_iter().flatten());
            let all = all.collect();
            (fastest, all)
        };
        let (fastest, all) = promising(&walk);
        chosen.extend(&all);
        near.push(fastest);
        match settings.way {
            Way::Separate => {}
            Way::Interleaved => of_walk.extend(all),
            Way::Exhaustive => {
                let (_, all) = promising(&walked_along(simpler, order.len(), strain)?);
                of_walk.extend(&all);
                chosen.extend(all);
            }
        }
        walked.push(Walked {
            distance,
            pairs: walk.visits.len(),
            finer: finer.len(),
            monotonicity: walk.monotonicity(),
        });
    }
    chosen.extend(bred.iter().flatten());
    took.pairs = start.elapsed();

    let battery = Battery::new(stand)?;
    let mut confirmer = Confirmer::new(&candidates, Some(&battery).filter(|_| !kept.unstable));
    start = Instant::now();
    let mut whole = Table::new(&candidates, chosen.into_iter().collect(), settings.prices)?;
    took.pairs += start.elapsed();
    start = Instant::now();
    let timed = clock.as_deref_mut().map_or(0, |clock| {
        clock::measure(&mut whole, clock, &meshes, &shaders)
    });
    took.timing = start.elapsed();
    start = Instant::now();
    // Once with all of them; and with what meshes have alone, and shaders: which plan is refused first decides what is asked next, so
    // that the plan of all might come to more than theirs.
    let only = |is: &dyn Fn(&Pair) -> bool| whole.clone().without(|pair| !is(pair));
    let mut tables = vec![
        whole.clone(),
        only(&|pair| pair.shader == first),
        only(&|pair| pair.mesh == 0),
    ];
    if settings.way != Way::Separate {
        tables.push(only(&|pair| of_walk.contains(pair)));
    }
    let mut plans = Vec::new();
    for table in &mut tables {
        plans.push(planned(table, &mut confirmer, (original, first))?);
    }
    let least = |plans: &[Planned]| {
        let places =
            (0..plans.len()).min_by(|a, b| plans[*a].score.j.total_cmp(&plans[*b].score.j));
        places.unwrap_or(0)
    };
    // What alone is better than the walk's pairs together is what the walk would have given.
    let walk = (plans.len() > 3).then(|| plans[1 + least(&plans[1..])].score);
    let table = &tables[0];
    let (fastest, paper) = (table.fastest(), table.paper(&near));
    let best = least(&plans);
    let scores = Scores {
        chosen: plans[best].score,
        paper: table.score(&paper),
        fastest: table.score(&fastest),
        meshes: plans[1].score,
        shaders: plans[2].score,
        walk,
    };
    let confirmed = plans.swap_remove(best).levels;

    let mut levels = vec![JointLevel {
        level: found.levels[0].clone(),
        mesh: 0,
        shown: None,
    }];
    let (runs, pieces): (Vec<Run>, Vec<Pieces>) = confirmed.into_iter().unzip();
    let of_runs = runs.iter().zip(pieces).map(|(run, pieces)| {
        let (recipe, shader) = &shaders[run.pair.shader];
        let is_original = first == 0 && run.pair.shader == 0;
        pieces.level(scene, (recipe, shader), is_original)
    });
    let mut of_runs: Vec<Level> = of_runs.collect();
    examine(stand, (&battery, &found.exact), &mut of_runs)?;
    let mut before = original;
    for (run, mut level) in runs.into_iter().zip(of_runs) {
        if let Some(clock) = clock.as_deref_mut() {
            clock::level(&mut level, clock, &meshes[run.pair.mesh]);
        }
        let last = &levels[levels.len() - 1].level;
        if level.autolod <= last.autolod && levels.len() > 1 {
            // Two thresholds that are the same in hundredths.
            levels.pop();
        }
        levels.push(JointLevel {
            shown: Some(shown(&candidates, [before, run.pair], run.from)?),
            level,
            mesh: run.pair.mesh,
        });
        before = run.pair;
    }
    took.levels = start.elapsed();
    Ok(Joint {
        levels,
        shaders: apart[1],
        finer: apart[0] - simpler,
        spawned: bred.iter().map(Vec::len).sum(),
        meshes,
        walked,
        timed,
        scores,
        prices: settings.prices,
        took,
    })
}

/// A plan whose levels hold.
struct Planned {
    score: Score,
    levels: Vec<(Run, Pieces)>,
}

/// The plan of a table that comes to least of those whose levels are confirmed. The original is given, and which shader draws the same for less.
fn planned(
    table: &mut Table<'_>,
    confirmer: &mut Confirmer<'_>,
    (original, first): (Pair, usize),
) -> Result<Planned, Refused> {
    loop {
        let plan = table.plan();
        let mut levels = Vec::new();
        let mut refuted = false;
        for mut run in table.runs(&plan).into_iter().skip(1) {
            if run.pair == original {
                // Of what draws the same, what does it for less.
                run.pair.shader = first;
            }
            match confirmer.judge(&run)? {
                Ok(level) => levels.push((run, level)),
                Err(by) => {
                    table.refute(&run, by);
                    refuted = true;
                }
            }
        }
        if !refuted {
            let score = table.score(&plan);
            return Ok(Planned { score, levels });
        }
    }
}

/// What is seen where one pair takes the place of another.
fn shown(candidates: &Candidates<'_>, pairs: [Pair; 2], distance: f64) -> Result<f64, Refused> {
    let meshes: BTreeSet<usize> = [0, pairs[0].mesh, pairs[1].mesh].into();
    let meshes: Vec<usize> = meshes.into_iter().collect();
    let at = At::new(candidates, &meshes, distance)?;
    let pictures = pairs.map(|pair| at.left(pair));
    Ok(at.between(&pictures[0], &pictures[1]))
}

/// All samples of one mesh at a distance, against the pictures of the original.
fn set_of<'a>(
    stands: &'a [Stand<'a>],
    mesh: usize,
    distance: f64,
    samples: Samples,
) -> Result<SampleSet<'a>, Refused> {
    if mesh == 0 {
        return SampleSet::new(&stands[0], distance, samples);
    }
    let [_, set] = SampleSet::of_two([&stands[0], &stands[mesh]], distance, samples)?;
    Ok(set)
}
