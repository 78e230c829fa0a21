//! The best numbers that a candidate can bake: those that leave the least displayed error.
//!
//! The mean of a value is the constant nearest to the value; what counts is the constant that makes the picture
//! nearest to the reference. To first order that is the mean weighted by the squared derivative of each displayed
//! pixel with respect to the value, and the derivative is at hand: the shader is drawn once more for each number, with
//! that number a little larger. Several numbers, such as the components of a colour, are solved for together, so that
//! what one does is not done again by another. This is a step of Gauss and Newton on the measured error itself.

use super::interval::Interval;
use super::samples::{Measured, SampleSet};
use crate::eval::programs::Programs;
use lodc_passes::least_squares::LeastSquares;
use lodc_passes::{Candidate, Shader, recipe};
use rayon::prelude::*;

/// Steps towards the best numbers: displays are not linear, so that one is not quite enough.
const STEPS: usize = 2;
/// How often a step that overshoots is halved.
const HALVINGS: usize = 2;
/// What a second step must be hoped to gain, by what the first one gained, in units of the square of the bound.
const LEAST_GAIN: f64 = 0.01;
/// The part of a number, or of [`SMALL`], by which it is made larger.
const FORWARD: f32 = 1.0 / 64.0;
/// What a number near 0 is taken for when it is made larger.
const SMALL: f32 = 1.0 / 16.0;
/// What is added to the normal equations' diagonal, as a part of its mean: what nothing shows stays as it is.
const DAMPING: f64 = 1e-4;

/// A change with better numbers, and what was measured of it.
pub(super) struct Better {
    pub(super) candidate: Candidate,
    pub(super) shader: Shader,
    pub(super) measured: Measured,
}

/// The change that a candidate makes to a shader, with the numbers that leave the least error. `measured` is what the
/// candidate itself leaves. Returns nothing when its numbers are not free, or are as good as any.
pub(super) fn best(
    interval: &Interval<'_>,
    shader: &Shader,
    candidate: &Candidate,
    measured: &Measured,
) -> Option<Better> {
    let pass = shader.passes().of_name(&candidate.pass).ok()?;
    let made = |numbers: &[f32]| -> Option<(Candidate, Shader)> {
        let other = pass.with_numbers(candidate, numbers)?;
        let made = recipe::apply(shader, &other).ok()?;
        Some((other, made))
    };
    let mut numbers: Vec<f32> = candidate.numbers().collect();
    let mut load = measured.load;
    let mut found = None;
    for _ in 0..STEPS {
        let Some(step) = step(interval, &numbers, &made) else {
            break;
        };
        let mut part = 1.0;
        let better = (0..=HALVINGS).find_map(|_| {
            let next: Vec<f32> = numbers
                .iter()
                .zip(&step)
                .map(|(number, step)| (f64::from(*number) + part * step) as f32)
                .collect();
            part *= 0.5;
            let (candidate, shader) = made(&next)?;
            let measured = interval.measure(&shader).ok()?;
            (measured.load < load).then_some(Better {
                candidate,
                shader,
                measured,
            })
        });
        let Some(better) = better else {
            break;
        };
        let gained = load - better.measured.load;
        load = better.measured.load;
        numbers = better.candidate.numbers().collect();
        found = Some(better);
        if gained < LEAST_GAIN {
            break;
        }
    }
    found
}

/// By how much each number should change, to first order.
fn step(
    interval: &Interval<'_>,
    numbers: &[f32],
    made: &impl Fn(&[f32]) -> Option<(Candidate, Shader)>,
) -> Option<Vec<f64>> {
    let forward: Vec<f32> = numbers
        .iter()
        .map(|number| FORWARD * number.abs().max(SMALL))
        .collect();
    let mut programs = Vec::with_capacity(numbers.len() + 1);
    programs.push(Programs::of(&made(numbers)?.1).ok()?);
    for (i, forward) in forward.iter().enumerate() {
        let mut moved = numbers.to_vec();
        moved[i] += forward;
        programs.push(Programs::of(&made(&moved)?.1).ok()?);
    }
    let mut normal = LeastSquares::new(numbers.len());
    for set in interval.sets() {
        linearise(set, &programs, &forward, &mut normal);
    }
    normal.solve(DAMPING)
}

/// Adds what a set of samples shows to the normal equations. The first program has the numbers as they are, each
/// other one has one of them moved forward.
fn linearise(
    set: &SampleSet<'_>,
    programs: &[Programs],
    forward: &[f32],
    normal: &mut LeastSquares,
) {
    let output = set.stand.scene.output;
    // As much as each squared difference has in the load.
    let weight = set.load_of_square().sqrt();
    let sums: Vec<LeastSquares> = set
        .frames
        .par_iter()
        .map(|frame| {
            let differences = frame.differences(programs, output);
            let mut normal = LeastSquares::new(forward.len());
            let mut slopes = vec![0.0; forward.len()];
            let [here, moved @ ..] = &differences[..] else {
                return normal;
            };
            for (pixel, here) in here.iter().enumerate() {
                for (channel, here) in here.iter().enumerate() {
                    for ((slope, moved), forward) in slopes.iter_mut().zip(moved).zip(forward) {
                        let moved = moved[pixel][channel] - here;
                        *slope = weight * f64::from(moved) / f64::from(*forward);
                    }
                    normal.add(&slopes, -weight * f64::from(*here));
                }
            }
            normal
        })
        .collect();
    for sum in &sums {
        normal.merge(sum);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compile::normal_form;
    use crate::eval::program::Program;
    use crate::eval::programs::Stand;
    use crate::front::Source;
    use crate::scene::Scene;
    use crate::search::Samples;

    #[test]
    fn the_best_constant_leaves_less_error_than_the_mean() {
        // The picture shows the value through a steep curve, so that most of its range does not matter.
        let source = Source::parse(
            "curve.wgsl",
            "@fragment fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
                 let value = uv.x * 0.9;
                 return vec4f(vec3f(pow(value, 8.0 + uv.y * 0.01)), 1.0);
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
        let set = Interval::new(&stand, &[scene.nearest], Samples::Search).expect("it runs");
        let facts = set.start().facts(&base);
        let candidates = recipe::candidates(&base, &facts);
        let mean = candidates
            .iter()
            .find(|c| c.site.path() == "fs_main.value" && c.choice == "mean")
            .expect("it is offered");
        let after = |candidate: &Candidate| {
            let shader = recipe::apply(&base, candidate).expect("it applies");
            set.measure(&shader).expect("it runs")
        };
        let with_mean = after(mean);
        let best = best(&set, &base, mean, &with_mean).expect("the mean is not the best");
        assert_eq!(best.candidate.choice, "best");
        assert_eq!(after(&best.candidate), best.measured);
        let squares = [&best.measured, &with_mean].map(|measured| measured.error.square());
        assert!(squares[0] < 0.95 * squares[1], "{squares:?}");
        let number = |candidate: &Candidate| candidate.numbers().next().unwrap_or(f32::NAN);
        // No constant nearby does better.
        for part in [0.85, 1.15] {
            let pass = base.passes().of_name(&mean.pass).expect("it has one");
            let moved = pass
                .with_numbers(mean, &[part * number(&best.candidate)])
                .expect("a constant is free");
            assert!(
                after(&moved).error.square() > squares[0],
                "{}",
                best.candidate
            );
        }
    }
}
