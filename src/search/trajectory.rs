//! How far simplification goes at one distance when no bound ends it: Olano's own loop, step by step.
//!
//! This work is based on: Marc Olano, Bob Kuehne, Maryann Simmons, "Automatic Shader Level of Detail", 2003, section 2
//! and table 1.

use super::frontier::Frontier;
use super::greedy::{Descent, Prices, Stop, Variant};
use super::guard::Guard;
use super::interval::Interval;
use super::kept::Kept;
use super::samples::{Measured, Samples};
use crate::eval::program::Refused;
use crate::eval::programs::Stand;
use crate::time::Timing;
use crate::time::clock::Clock;
use lodc_passes::{Recipe, Shader, Used};

/// One variant on the way from the original to the end, as the samples of a search see it.
#[derive(Clone, Debug)]
pub struct Step {
    /// How it is made from the original.
    pub recipe: Recipe,
    /// What it uses up.
    pub used: Used,
    /// What it costs by the scene's goal, as a share of the original's.
    pub cost: f64,
    /// What it adds to the original's error, of display values in 0..1.
    pub excess: f64,
    /// How much of its bound it uses up: within it when at most 1.
    pub strain: f64,
    /// Its run time at that distance, of each adapter; none where it was not timed.
    pub timed: Vec<Timing>,
}

/// The variants that the greedy loop passes through at a distance, the original first, until nothing is left that saves
/// anything by the scene's goal.
///
/// # Errors
/// When the evaluator refuses the original, at the expression.
pub fn trajectory(
    stand: &Stand<'_>,
    kept: &Kept,
    distance: f64,
    clock: Option<&mut dyn Clock>,
) -> Result<Vec<Step>, Refused> {
    let interval = Interval::new(stand, &[distance], Samples::Search)?;
    let guard = Guard::unbounded(stand, kept);
    let original = Variant::new(&interval, Recipe::default(), stand.base.clone())?;
    let mut way = vec![Stop::from(original)];
    Descent {
        interval: &interval,
        asks: true,
        guard: &guard,
        progress: &|_, _| {},
    }
    .run(&mut way, &mut Prices::default(), &mut Frontier::default());
    let shaders: Vec<&Shader> = way.iter().map(|stop| &stop.variant.shader).collect();
    let mut timed = clock
        .map(|clock| clock.time(&shaders, distance).into_iter())
        .into_iter()
        .flatten();
    let timed: Vec<Vec<Timing>> = (0..way.len())
        .map(|_| timed.next().unwrap_or_default())
        .collect();
    let floor = interval.start().original().error.square();
    let steps = way.into_iter().zip(timed).map(|(stop, timed)| {
        let Variant {
            recipe, measured, ..
        } = stop.variant;
        let Measured {
            error,
            strain,
            used,
            cost,
            ..
        } = measured;
        Step {
            recipe,
            used,
            cost: interval.start().share(cost),
            excess: (error.square() - floor).max(0.0).sqrt(),
            strain,
            timed,
        }
    });
    Ok(steps.collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compile::normal_form;
    use crate::eval::program::Program;
    use crate::front::Source;
    use crate::scene::Scene;
    use lodc_passes::Stage;
    use lodc_passes::goal::{Goal, Resource};
    use std::path::Path;

    /// The steps of leather's reads of textures at its farthest distance, by a goal.
    fn leather(goal: Resource) -> Vec<Step> {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata/materials");
        let source = Source::read(&folder.join("leather.wgsl")).expect("it parses");
        let path = folder.join("leather.toml");
        let text = std::fs::read_to_string(&path).expect("it is there");
        let text = text.replace("e_max = 0.05", "e_max = 0.025\nresolution = [64, 64]");
        let mut scene =
            Scene::resolve(&source, Some((&path, &text))).unwrap_or_else(|e| panic!("{e}"));
        scene.goal = Goal::only(goal);
        let base = normal_form(&source).expect("it is small");
        let vertex = base.index(Stage::Vertex).expect("it has one");
        let vertex = Program::compile(base.module(), vertex, &[]).expect("it runs");
        let stand = Stand {
            base: &base,
            vertex: &vertex,
            scene: &scene,
        };
        let kept = Kept {
            only: ["texture-removal".to_owned()].into(),
            ..Kept::default()
        };
        trajectory(&stand, &kept, scene.farthest, None).expect("it runs")
    }

    #[test]
    fn accesses_go_down_as_far_as_in_the_paper() {
        let steps = leather(Resource::Accesses);
        let accesses = |step: &Step| step.used.work.samples;
        let reduction = |step: &Step| 1.0 - accesses(step) / accesses(&steps[0]);
        let within = steps.iter().take_while(|step| step.strain <= 1.0).last();
        let within = within.map_or(0.0, reduction);
        assert!(within >= 0.49, "{within}");
        let last = &steps[steps.len() - 1];
        assert_eq!((reduction(last), last.used.textures), (1.0, 0));
    }

    #[test]
    fn every_step_saves_what_the_goal_names() {
        for goal in [Resource::Textures, Resource::Memory] {
            let steps = leather(goal);
            assert!(steps.len() > 3);
            for pair in steps.windows(2) {
                let [before, after] = [&pair[0], &pair[1]].map(|step| step.used.of(goal));
                assert!(after < before, "{goal:?}: {before} {after}");
                assert!(pair[1].cost < pair[0].cost);
            }
            let last = &steps[steps.len() - 1];
            assert_eq!((last.used.of(goal), last.cost), (0.0, 0.0), "{goal:?}");
        }
    }
}
