//! Which pairs are about as fast as the fastest: among those a path is looked for whose transitions are seen least, and of those that
//! a model puts there the time is worth measuring.
//!
//! This work is based on: Liang 2022, algorithm 2, lines 15 to 23.

/// How much slower than the fastest a candidate may be, as a share of that one's time: Liang's T.
pub const NEAR: f64 = 0.05;

/// Which times are within a share of the least, the fastest first, and of equal ones the first: their places. What is not a
/// number is not among them.
pub fn near_fastest(times: &[f64], share: f64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..times.len()).filter(|at| !times[*at].is_nan()).collect();
    order.sort_by(|a, b| times[*a].total_cmp(&times[*b]));
    let least = order.first().map(|first| times[*first]);
    order.retain(|at| least.is_some_and(|least| times[*at] <= least * (1.0 + share)));
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_within_reach_is_kept_in_order() {
        assert_eq!(
            near_fastest(&[1.0, 0.5, 0.52, 0.53, f64::NAN, 0.5], NEAR),
            [1, 5, 2]
        );
        assert_eq!(near_fastest(&[f64::NAN], NEAR), []);
        assert_eq!(near_fastest(&[0.0, 0.0, 0.1], NEAR), [0, 1]);
    }
}
