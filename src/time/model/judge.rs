//! How good a prediction of times is, and the model that ours is held against.
//!
//! This work is based on: Yong He, Tim Foley, Natalya Tatarchuk, Kayvon Fatahalian, "A system for rapid, automatic shader
//! level-of-detail", 2015, section 5: a shader costs its scalar operations and 100 for each texture operation.

use super::Features;
use crate::eval::mix::{Class, Mix};
use lodc_passes::cost::SAMPLE_WEIGHT;
use serde::{Deserialize, Serialize};

/// How good predictions are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Judged {
    /// The mean of the error as a share of what was measured: 0.2 is 20 %.
    pub error: f64,
    /// Spearman's correlation of the ranks, -1..1.
    pub spearman: f64,
    /// How many there are.
    pub count: usize,
}

/// Judges pairs of a predicted and a measured number. Those whose measured number is not above 0 do not count.
pub fn judged(pairs: &[(f64, f64)]) -> Judged {
    let pairs: Vec<(f64, f64)> = pairs.iter().copied().filter(|(_, m)| *m > 0.0).collect();
    let errors = pairs.iter().map(|(said, is)| (said / is - 1.0).abs());
    Judged {
        error: errors.sum::<f64>() / pairs.len().max(1) as f64,
        spearman: spearman(&pairs),
        count: pairs.len(),
    }
}

/// Spearman's correlation of the ranks of two numbers each; equal numbers share the mean of their ranks. 0 where one of
/// them is always the same, or there are fewer than two pairs.
pub fn spearman(pairs: &[(f64, f64)]) -> f64 {
    let (one, other): (Vec<f64>, Vec<f64>) = pairs.iter().copied().unzip();
    let [one, other] = [ranks(&one), ranks(&other)];
    // Ranks are those of 0..n, shared or not.
    let mean = (pairs.len() as f64 - 1.0) / 2.0;
    let sum = |a: &[f64], b: &[f64]| -> f64 {
        let both = a.iter().zip(b);
        both.map(|(a, b)| (a - mean) * (b - mean)).sum()
    };
    let spread = (sum(&one, &one) * sum(&other, &other)).sqrt();
    if spread > 0.0 {
        sum(&one, &other) / spread
    } else {
        0.0
    }
}

fn ranks(numbers: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..numbers.len()).collect();
    order.sort_by(|a, b| numbers[*a].total_cmp(&numbers[*b]));
    let mut ranks = vec![0.0; numbers.len()];
    let mut first = 0;
    for equal in order.chunk_by(|a, b| numbers[*a] == numbers[*b]) {
        let shared = first as f64 + (equal.len() as f64 - 1.0) / 2.0;
        for place in equal {
            ranks[*place] = shared;
        }
        first += equal.len();
    }
    ranks
}

/// He's cost of a draw: scalar operations and 100 for each texture operation, of all fragments and vertices.
pub fn he(features: &Features) -> f64 {
    let each = |mix: &Mix| {
        let operations = Class::ALL[..=Class::Uniform as usize].iter();
        let operations: f64 = operations.map(|class| mix[*class]).sum();
        operations + SAMPLE_WEIGHT * mix[Class::Sample]
    };
    features.extent.fragments * each(&features.invocation.fragment)
        + features.extent.vertices * each(&features.invocation.vertex)
}

/// The coefficient of a cost that gives the least mean error as a share of what was measured, of pairs of a cost and a
/// measured time: a median, weighted by how much each pair's error grows with the coefficient.
pub fn coefficient(pairs: &[(f64, f64)]) -> f64 {
    let mut wanted: Vec<(f64, f64)> = pairs
        .iter()
        .filter(|(cost, is)| *cost > 0.0 && *is > 0.0)
        .map(|(cost, is)| (is / cost, cost / is))
        .collect();
    wanted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half: f64 = wanted.iter().map(|(_, weight)| weight).sum::<f64>() / 2.0;
    let mut below = 0.0;
    for (coefficient, weight) in &wanted {
        below += weight;
        if below >= half {
            return *coefficient;
        }
    }
    0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ties_share_their_ranks() {
        assert_eq!(ranks(&[3.0, 1.0, 3.0, 2.0]), [2.5, 0.0, 2.5, 1.0]);
        let same = [(1.0, 10.0), (2.0, 20.0), (3.0, 40.0)];
        assert!((spearman(&same) - 1.0).abs() < 1e-12);
        let turned = same.map(|(a, b)| (a, -b));
        assert!((spearman(&turned) + 1.0).abs() < 1e-12);
        // By hand: ranks 0, 1.5, 1.5, 3 and 1, 0, 2, 3 have 3 / sqrt(4.5 * 5).
        let tied = [(1.0, 2.0), (2.0, 1.0), (2.0, 3.0), (3.0, 4.0)];
        assert!(
            (spearman(&tied) - 3.0 / 22.5_f64.sqrt()).abs() < 1e-12,
            "{}",
            spearman(&tied)
        );
        assert_eq!(spearman(&[(1.0, 2.0), (1.0, 3.0)]), 0.0);
        assert_eq!(spearman(&[]), 0.0);
    }

    #[test]
    fn errors_are_shares_of_what_was_measured() {
        let judged = judged(&[(1.0, 2.0), (3.0, 2.0), (2.0, 2.0), (1.0, 0.0)]);
        assert!((judged.error - 1.0 / 3.0).abs() < 1e-12);
        assert_eq!(judged.count, 3);
    }

    #[test]
    fn the_coefficient_has_the_least_error() {
        let pairs = [(1.0, 2.0), (2.0, 3.0), (5.0, 20.0), (1.0, 1.0), (3.0, 7.0)];
        let error = |k: f64| {
            let scaled = pairs.map(|(cost, is)| (k * cost, is));
            judged(&scaled).error
        };
        let best = coefficient(&pairs);
        for k in 1..100 {
            assert!(
                error(best) <= error(f64::from(k) * 0.1) + 1e-12,
                "{best} {k}"
            );
        }
    }

    #[test]
    fn the_cost_of_he_counts_reads_a_hundred_times() {
        let mut features = Features::default();
        features.extent.fragments = 2.0;
        features.extent.vertices = 3.0;
        features.invocation.fragment[Class::Exponential] = 4.0;
        features.invocation.fragment[Class::Float] = 1.0;
        features.invocation.fragment[Class::Sample] = 1.0;
        features.invocation.fragment[Class::Texel] = 8.0;
        features.invocation.vertex[Class::Float] = 7.0;
        assert_eq!(he(&features), 2.0 * 105.0 + 3.0 * 7.0);
    }
}
