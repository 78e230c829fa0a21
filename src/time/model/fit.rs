//! Fits a model to what was measured.
//!
//! What is made small is the sum of the squares of the logarithms' differences, so that a draw that takes microseconds
//! counts as much as one that takes milliseconds, and far differences count less than their squares (a pseudo-Huber loss):
//! some measurements are plain wrong. Weights are fitted as logarithms, so that none is negative. Where the measurements
//! say nothing a prior holds: each weight is thought to lie within a factor of what it was before.
//!
//! This work is based on: Levenberg, "A method for the solution of certain non-linear problems in least squares", 1944;
//! Marquardt, "An algorithm for least-squares estimation of nonlinear parameters", 1963.

use super::{Features, Model, Parameters, TABLE, TERMS};

/// The weights, two exponents and the share of stamps.
const COUNT: usize = TERMS + 3;
/// How far from what it predicts a measurement is thought to be, as a natural logarithm: the model is no better.
const NOISE: f64 = 0.1;
/// Beyond so many times the noise a difference counts by its size and not by its square.
const FAR: f64 = 1.5;
/// How far a weight is thought to be from its prior before anything was measured, as a natural logarithm.
const WIDE: f64 = 2.0;
/// The same of a model that was fitted to other measurements.
const NARROW: f64 = 0.7;
/// How many steps are made at most.
const STEPS: usize = 200;

/// The parameters as they are fitted, each from minus to plus infinity.
type Point = [f64; COUNT];

/// A measurement.
struct Row<'a> {
    of: &'a Features,
    /// Where it is a ratio: to what.
    to: Option<&'a Features>,
    /// The natural logarithm of what was measured.
    measured: f64,
}

/// What is known of a point beforehand.
struct Prior {
    at: Point,
    /// How far off it is thought to be.
    within: Point,
}

impl Model {
    /// The model of an adapter, fitted to times in milliseconds. Rows whose time is not above 0 are left out; without any
    /// it is the model that nothing was measured for.
    pub fn fit(rows: &[(Features, f64)], adapter: &str) -> Self {
        let rows: Vec<Row<'_>> = rows
            .iter()
            .filter(|(_, ms)| ms.is_finite() && *ms > 0.0)
            .map(|(features, ms)| Row {
                of: features,
                to: None,
                measured: ms.ln(),
            })
            .collect();
        if rows.is_empty() {
            return Self::estimated();
        }
        let guess = Parameters::guess();
        // How long an operation takes nobody knows beforehand: the median says.
        let mut scales: Vec<f64> = rows
            .iter()
            .map(|row| row.measured - guess.time(row.of).ln())
            .collect();
        scales.sort_by(f64::total_cmp);
        let scale = scales[scales.len() / 2].exp();
        let guess = Parameters {
            weights: guess.weights.map(|weight| weight * scale),
            ..guess
        };
        let prior = Prior {
            at: point(&guess),
            within: [WIDE; COUNT],
        };
        Self::of(&parameters(&least(&rows, &prior)), Some(adapter))
    }

    /// The same model after ratios were measured: of variants, each with the original at its distance. A few change a
    /// calibrated model little. One that is not calibrated still says no milliseconds, but better ratios.
    #[must_use]
    pub fn refined(&self, ratios: &[(Features, Features, f64)]) -> Self {
        let rows: Vec<Row<'_>> = ratios
            .iter()
            .filter(|(.., ratio)| ratio.is_finite() && *ratio > 0.0)
            .map(|(variant, original, ratio)| Row {
                of: variant,
                to: Some(original),
                measured: ratio.ln(),
            })
            .collect();
        // The static weights have nothing for much that takes time.
        let (guess, within) = match self.is_calibrated() {
            true => (self.parameters(), NARROW),
            false => (Parameters::guess(), WIDE),
        };
        let prior = Prior {
            at: point(&guess),
            within: [within; COUNT],
        };
        match rows.is_empty() {
            true => self.clone(),
            false => Self::of(&parameters(&least(&rows, &prior)), self.adapter.as_deref()),
        }
    }
}

impl Parameters {
    /// What is thought before anything was measured, in scalar operations at full rate.
    fn guess() -> Self {
        Self {
            weights: TABLE.map(|(.., prior)| prior),
            fragment_p: 1.5,
            geometry_p: 2.0,
            stamp_share: 0.3,
        }
    }
}

fn point(parameters: &Parameters) -> Point {
    let mut point = [0.0; COUNT];
    for (to, weight) in point.iter_mut().zip(parameters.weights) {
        // A file may hold a weight of 0.
        *to = weight.max(1e-30).ln();
    }
    let above_one = |p: f64| (p - 1.0).max(0.05).ln();
    let share = parameters.stamp_share.clamp(0.02, 0.98);
    point[TERMS] = above_one(parameters.fragment_p);
    point[TERMS + 1] = above_one(parameters.geometry_p);
    point[TERMS + 2] = (share / (1.0 - share)).ln();
    point
}

fn parameters(point: &Point) -> Parameters {
    let mut weights = [0.0; TERMS];
    for (to, weight) in weights.iter_mut().zip(point) {
        *to = weight.exp();
    }
    // Beyond 32 a norm is the longest part.
    let p = |x: f64| 1.0 + x.exp().min(31.0);
    Parameters {
        weights,
        fragment_p: p(point[TERMS]),
        geometry_p: p(point[TERMS + 1]),
        stamp_share: 1.0 / (1.0 + (-point[TERMS + 2]).exp()),
    }
}

/// The differences between prediction and measurement, in units of the noise.
fn differences(rows: &[Row<'_>], point: &Point) -> Vec<f64> {
    let parameters = parameters(point);
    let time = |features: &Features| parameters.time(features).max(f64::MIN_POSITIVE).ln();
    let said = rows
        .iter()
        .map(|row| time(row.of) - row.to.map_or(0.0, time));
    let both = said.zip(rows);
    both.map(|(said, row)| (said - row.measured) / NOISE)
        .collect()
}

/// What is to be made small.
fn loss(differences: &[f64], point: &Point, prior: &Prior) -> f64 {
    let of_rows: f64 = differences
        .iter()
        .map(|d| 2.0 * FAR * FAR * ((1.0 + (d / FAR).powi(2)).sqrt() - 1.0))
        .sum();
    let of_prior: f64 = (0..COUNT)
        .map(|k| ((point[k] - prior.at[k]) / prior.within[k]).powi(2))
        .sum();
    of_rows + of_prior
}

/// The point of least loss that is found from the prior.
fn least(rows: &[Row<'_>], prior: &Prior) -> Point {
    let mut at = prior.at;
    let mut now = differences(rows, &at);
    let mut least = loss(&now, &at, prior);
    let mut damping = 1.0;
    for _ in 0..STEPS {
        let (matrix, slope) = normal_equations(rows, &at, &now, prior);
        let mut better = None;
        // A longer step was tried before each shorter one.
        while damping < 1e9 && better.is_none() {
            let mut damped = matrix;
            for (k, row) in damped.iter_mut().enumerate() {
                row[k] += damping * row[k].max(1e-9);
            }
            if let Some(step) = solve(damped, slope) {
                let mut next = at;
                for (to, step) in next.iter_mut().zip(step) {
                    *to -= step.clamp(-2.0, 2.0);
                }
                let differences = differences(rows, &next);
                let loss = loss(&differences, &next, prior);
                if loss < least {
                    better = Some((next, differences, loss));
                }
            }
            damping *= if better.is_some() { 0.3 } else { 4.0 };
        }
        let Some((next, differences, loss)) = better else {
            break;
        };
        let gained = least - loss;
        (at, now, least) = (next, differences, loss);
        if gained < 1e-7 * least {
            break;
        }
    }
    at
}

type Matrix = [[f64; COUNT]; COUNT];

/// The matrix and the right side of the step that would lead to the least loss, were all differences straight lines.
fn normal_equations(rows: &[Row<'_>], at: &Point, now: &[f64], prior: &Prior) -> (Matrix, Point) {
    const APART: f64 = 1e-5;
    let mut columns: Vec<Vec<f64>> = Vec::with_capacity(COUNT);
    for k in 0..COUNT {
        let mut beside = *at;
        beside[k] += APART;
        let there = differences(rows, &beside);
        let column = there
            .iter()
            .zip(now)
            .map(|(there, now)| (there - now) / APART);
        columns.push(column.collect());
    }
    let weights: Vec<f64> = now
        .iter()
        .map(|d| 1.0 / (1.0 + (d / FAR).powi(2)).sqrt())
        .collect();
    let mut matrix = [[0.0; COUNT]; COUNT];
    let mut slope = [0.0; COUNT];
    for k in 0..COUNT {
        for l in 0..=k {
            let both = columns[k].iter().zip(&columns[l]).zip(&weights);
            let sum: f64 = both.map(|((a, b), weight)| a * b * weight).sum();
            matrix[k][l] = sum;
            matrix[l][k] = sum;
        }
        let both = columns[k].iter().zip(now).zip(&weights);
        slope[k] = both.map(|((a, d), weight)| a * d * weight).sum();
        let sharpness = 1.0 / prior.within[k].powi(2);
        matrix[k][k] += sharpness;
        slope[k] += sharpness * (at[k] - prior.at[k]);
    }
    (matrix, slope)
}

/// Solves a symmetric system whose matrix is positive definite (Cholesky); `None` where it is not.
fn solve(mut matrix: Matrix, mut right: Point) -> Option<Point> {
    for k in 0..COUNT {
        for l in 0..=k {
            let sum: f64 = (0..l).map(|i| matrix[k][i] * matrix[l][i]).sum();
            let rest = matrix[k][l] - sum;
            matrix[k][l] = if k == l {
                if rest <= 0.0 || !rest.is_finite() {
                    return None;
                }
                rest.sqrt()
            } else {
                rest / matrix[l][l]
            };
        }
    }
    for k in 0..COUNT {
        let sum: f64 = (0..k).map(|i| matrix[k][i] * right[i]).sum();
        right[k] = (right[k] - sum) / matrix[k][k];
    }
    for k in (0..COUNT).rev() {
        let sum: f64 = (k + 1..COUNT).map(|i| matrix[i][k] * right[i]).sum();
        right[k] = (right[k] - sum) / matrix[k][k];
    }
    right.iter().all(|x| x.is_finite()).then_some(right)
}

#[cfg(test)]
mod tests {
    use super::super::features::{COUNT as NUMBERS, Features};
    use super::super::{judged, spearman};
    use super::*;
    use crate::scene::chance::{child, unit};

    /// Features of draws that differ in everything, each number between a tenth of and all of what it usually is.
    fn varied(seed: u64) -> Features {
        let usual = [
            300.0, 60.0, 8.0, 10.0, 10.0, 6.0, 6.0, 40.0, 4.0, 6.0, 40.0, 5.0, 2.0, 1.0, 60.0, 2.0,
            12.0, 4.0, 20_000.0, 25_000.0, 40_000.0, 1500.0, 3000.0, 2000.0, 48.0, 8.0,
        ];
        let mut row: [f64; NUMBERS] =
            std::array::from_fn(|i| usual[i] * 10_f64.powf(-unit(child(seed, i as u64))));
        // Lanes are no fewer than fragments, and stamps no fewer than lanes.
        row[19] = row[18] * 1.3;
        row[20] = row[19] * (1.2 + unit(child(seed, 99)));
        Features::of_row(&row)
    }

    fn truth() -> Parameters {
        let mut weights = TABLE.map(|(.., prior)| 1e-6 * prior);
        // What is known beforehand is wrong by factors.
        for (k, weight) in weights.iter_mut().enumerate() {
            *weight *= 2_f64.powf(2.0 * unit(child(7, k as u64)) - 1.0);
        }
        weights[0] *= 2.5;
        weights[10] *= 4.0;
        Parameters {
            weights,
            fragment_p: 2.2,
            geometry_p: 4.0,
            stamp_share: 0.6,
        }
    }

    fn noise(seed: u64) -> f64 {
        // The sum of twelve is as good as a normal one.
        let sum: f64 = (0..12).map(|i| unit(child(seed, i))).sum();
        0.05 * (sum - 6.0)
    }

    #[test]
    fn the_fit_finds_what_made_the_times() {
        let truth = truth();
        let rows: Vec<(Features, f64)> = (0..600)
            .map(|seed| {
                let features = varied(seed);
                // One in twenty is plain wrong.
                let wrong = if seed % 20 == 3 { 4.0 } else { 1.0 };
                let ms = truth.time(&features) * noise(1000 + seed).exp() * wrong;
                (features, ms)
            })
            .collect();
        let model = Model::fit(&rows, "none");
        let pairs: Vec<(f64, f64)> = (5000..5200)
            .map(|seed| {
                let features = varied(seed);
                (model.time(&features), truth.time(&features))
            })
            .collect();
        let judged = judged(&pairs);
        assert!(judged.error < 0.03, "{judged:?}");
        assert!(spearman(&pairs) > 0.995, "{judged:?}");
        let found = model.parameters();
        // What takes a good part of the time is found by itself.
        for k in [0, 10] {
            let off = found.weights[k] / truth.weights[k];
            assert!((0.7..1.4).contains(&off), "{}: {off}", TABLE[k].0);
        }
        assert!((1.6..3.2).contains(&found.fragment_p), "{found:?}");
        assert!(model.weights().all(|(_, weight)| weight >= 0.0));
        // The same rows give the same model.
        assert_eq!(Model::fit(&rows, "none"), model);
    }

    #[test]
    fn without_measurements_a_model_stays_as_it_was() {
        assert_eq!(Model::fit(&[], "none"), Model::estimated());
        let useless = [(varied(1), 0.0), (varied(2), f64::NAN)];
        assert_eq!(Model::fit(&useless, "none"), Model::estimated());
        assert_eq!(Model::estimated().refined(&[]), Model::estimated());
    }

    #[test]
    fn ratios_refine_a_model() {
        let truth = truth();
        let known = |seeds: std::ops::Range<u64>| -> Vec<(Features, Features, f64)> {
            seeds
                .map(|seed| {
                    let original = varied(seed);
                    // A variant has the extent of the original.
                    let variant = Features {
                        invocation: varied(seed + 77_777).invocation,
                        ..original
                    };
                    let ratio = truth.time(&variant) / truth.time(&original);
                    (variant, original, ratio)
                })
                .collect()
        };
        let error = |model: &Model| {
            let pairs: Vec<(f64, f64)> = known(9000..9100)
                .iter()
                .map(|(variant, original, ratio)| (model.ratio(variant, original), *ratio))
                .collect();
            judged(&pairs).error
        };
        let before = Model::estimated();
        let few = before.refined(&known(0..10));
        let many = before.refined(&known(0..200));
        let [before, few, many] = [&before, &few, &many].map(error);
        assert!(
            few < before && many < few && many < 0.05,
            "{before} {few} {many}"
        );
    }
}
