//! What a joint search of meshes and shaders has looked at, as the report has it.

use crate::joint::Joint;
use lodc_joint::Score;
use serde::Serialize;

/// A joint search.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct JointReport {
    /// How pairs were looked for: `separate`, `exhaustive` or `interleaved`.
    pub search: &'static str,
    /// How many meshes there were to choose from, with the original.
    pub meshes: usize,
    /// How many shaders, with the original.
    pub shaders: usize,
    /// How many pairs of a mesh that was made for its shader there were besides.
    #[serde(skip_serializing_if = "is_none")]
    pub spawned: usize,
    /// What was looked at, at each distance.
    pub walked: Vec<WalkReport>,
    /// What the prices are: of a unit of transition error, and of a switch, in times of the original.
    pub prices: PricesReport,
    /// What was chosen comes to.
    pub chosen: ScoreReport,
    /// What the paper's steps would have chosen among the same pairs.
    pub paper: ScoreReport,
    /// The fastest pair of each bin of distances.
    pub fastest: ScoreReport,
    /// Levels of simpler meshes under the original shader, among the same pairs.
    pub only_mesh: ScoreReport,
    /// Levels of simpler shaders on the scene's own mesh.
    pub only_shader: ScoreReport,
    /// Levels of the pairs that a walk along the boundary looks at, where others were looked at, too.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub walk: Option<ScoreReport>,
}

/// What was looked at, at one distance.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct WalkReport {
    /// In world units.
    pub distance: f64,
    /// How many pairs, on the way.
    pub pairs: usize,
    /// How many with a finer mesh than the scene's own, besides.
    pub finer: usize,
    /// Pairs of those of which one is simpler than the other.
    pub compared: usize,
    /// Those of them of which the simpler one has less error.
    pub violated: usize,
    /// Those of them of which the simpler one alone is within the bound.
    pub misleading: usize,
}

/// What transitions and switches cost.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct PricesReport {
    /// For each unit of transition error.
    pub transition: f64,
    /// For each switch.
    pub switch: f64,
}

/// What a choice of levels comes to.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct ScoreReport {
    /// All together.
    pub j: f64,
    /// The mean time over the distances, as a share of the original's.
    pub time: f64,
    /// The sum of what transitions show.
    pub transition: f64,
    /// How many switches there are.
    pub switches: usize,
}

fn is_none(count: &usize) -> bool {
    *count == 0
}

impl JointReport {
    /// Of a search that was looked for in this way.
    pub(crate) fn new(joint: &Joint, search: &'static str) -> Self {
        let score = |score: &Score| ScoreReport {
            j: score.j,
            time: score.time,
            transition: score.transition,
            switches: score.switches,
        };
        let walked = joint.walked.iter().map(|walked| WalkReport {
            distance: walked.distance,
            pairs: walked.pairs,
            finer: walked.finer,
            compared: walked.monotonicity.compared,
            violated: walked.monotonicity.violated,
            misleading: walked.monotonicity.misleading,
        });
        Self {
            search,
            meshes: joint.meshes.len() - joint.finer - joint.spawned,
            shaders: joint.shaders,
            spawned: joint.spawned,
            walked: walked.collect(),
            prices: PricesReport {
                transition: joint.prices.transition,
                switch: joint.prices.switch,
            },
            chosen: score(&joint.scores.chosen),
            paper: score(&joint.scores.paper),
            fastest: score(&joint.scores.fastest),
            only_mesh: score(&joint.scores.meshes),
            only_shader: score(&joint.scores.shaders),
            walk: joint.scores.walk.as_ref().map(score),
        }
    }

    /// A few lines for people.
    pub(super) fn summary(&self) -> String {
        let looked = self.walked.iter().map(|walked| walked.pairs + walked.finer);
        let looked: usize = looked.sum();
        let (compared, violated) = (self.walked.iter()).fold((0, 0), |(c, v), walked| {
            (c + walked.compared, v + walked.violated)
        });
        format!(
            "  pairs           {} meshes, {} shaders: {looked} pairs looked at, at {} distances; simpler was better in {violated} of {compared} cases\n  \
             chosen          J {:.3}: time {:.3}, {} switches that show {:.3} together; by the paper's steps {:.3}, the fastest everywhere {:.3}\n",
            self.meshes,
            self.shaders,
            self.walked.len(),
            self.chosen.j,
            self.chosen.time,
            self.chosen.switches,
            self.chosen.transition,
            self.paper.j,
            self.fastest.j,
        ) + &format!(
            "  {:<16}meshes alone J {:.3}: time {:.3}; shaders alone J {:.3}: time {:.3}\n",
            "", self.only_mesh.j, self.only_mesh.time, self.only_shader.j, self.only_shader.time,
        )
    }
}
