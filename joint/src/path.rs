//! The candidates of neighbouring distances whose transitions are seen least, all together.
//!
//! The candidates of a distance are joined with those of the next one, by what is seen where the one takes the other's place (equation 5).
//! What is looked for is the shortest path from the first distance to the last. The paper asks Dijkstra's algorithm; but the graph has
//! a layer for each distance and no edge goes back, so that one pass over the layers finds it: O(edges), without a heap, and each
//! edge is measured once. Algorithm 3, as printed, never goes on to the next layer; here it does.
//!
//! This work is based on: Liang 2022, section 6.1, algorithm 3.

/// The smoothest path through `candidates`, of which each distance has so many: for each of them which one, and the sum of the transitions.
/// `transition` says what is seen where, at the distance `at`, the candidate `b` of that distance takes the place of the candidate `a` of
/// the one before. Of paths that are equally smooth that one which has the earlier candidates at the last place in which they differ.
/// Nothing where a distance has no candidates.
///
/// # Errors
/// What `transition` fails with.
pub fn smoothest<E>(
    candidates: &[usize],
    mut transition: impl FnMut(usize, usize, usize) -> Result<f64, E>,
) -> Result<Option<(Vec<usize>, f64)>, E> {
    let Some((first, rest)) = candidates.split_first() else {
        return Ok(Some((Vec::new(), 0.0)));
    };
    if candidates.contains(&0) {
        return Ok(None);
    }
    let mut sums = vec![0.0; *first];
    let mut before: Vec<Vec<usize>> = Vec::with_capacity(rest.len());
    for (at, count) in (1..).zip(rest) {
        let mut next = Vec::with_capacity(*count);
        let mut came = Vec::with_capacity(*count);
        for b in 0..*count {
            let mut best = (0, f64::INFINITY);
            for (a, sum) in sums.iter().enumerate() {
                let sum = sum + transition(at, a, b)?;
                if sum < best.1 {
                    best = (a, sum);
                }
            }
            came.push(best.0);
            next.push(best.1);
        }
        sums = next;
        before.push(came);
    }
    let mut at = 0;
    for (place, sum) in sums.iter().enumerate() {
        if *sum < sums[at] {
            at = place;
        }
    }
    let sum = sums[at];
    let mut path = vec![at];
    for came in before.iter().rev() {
        at = came[at];
        path.push(at);
    }
    path.reverse();
    Ok(Some((path, sum)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use std::convert::Infallible;

    /// All ways to choose one of each.
    fn all_paths(counts: &[usize]) -> Vec<Vec<usize>> {
        let mut paths = vec![Vec::new()];
        for count in counts {
            let longer = paths.iter().flat_map(|path: &Vec<usize>| {
                (0..*count).map(move |next| [path.as_slice(), &[next]].concat())
            });
            paths = longer.collect();
        }
        paths
    }

    #[test]
    fn no_path_is_smoother() {
        let mut random = Random(3);
        for _ in 0..200 {
            let layers = 1 + random.below(5);
            let counts: Vec<usize> = (0..layers).map(|_| 1 + random.below(4)).collect();
            let weights: Vec<f64> = (0..layers * 16).map(|_| random.unit()).collect();
            let weight = |at: usize, a: usize, b: usize| weights[at * 16 + a * 4 + b];
            let found = smoothest(&counts, |at, a, b| Ok::<_, Infallible>(weight(at, a, b)));
            let Ok(Some((path, sum))) = found else {
                panic!("each distance has candidates");
            };
            let sum_of = |path: &[usize]| -> f64 {
                let pairs = (1..).zip(path.windows(2));
                pairs.map(|(at, pair)| weight(at, pair[0], pair[1])).sum()
            };
            assert_eq!(sum, sum_of(&path));
            for other in all_paths(&counts) {
                assert!(sum <= sum_of(&other) + 1e-12, "{path:?} {other:?}");
            }
        }
    }

    #[test]
    fn each_edge_is_measured_once() {
        let mut measured = Vec::new();
        let found = smoothest(&[2, 3, 1], |at, a, b| {
            measured.push((at, a, b));
            Ok::<_, Infallible>(1.0)
        });
        let Ok(Some((path, sum))) = found else {
            panic!("each distance has candidates");
        };
        assert_eq!((path, sum), (vec![0, 0, 0], 2.0));
        assert_eq!(measured.len(), 2 * 3 + 3);
        measured.dedup();
        assert_eq!(measured.len(), 9);
    }

    #[test]
    fn there_is_none_where_a_distance_has_no_candidates() {
        let none = smoothest(&[2, 0], |_, _, _| Ok::<_, Infallible>(0.0));
        assert_eq!(none, Ok(None));
        let empty = smoothest(&[], |_, _, _| Ok::<_, Infallible>(0.0));
        assert_eq!(empty, Ok(Some((Vec::new(), 0.0))));
        assert_eq!(smoothest(&[1, 1], |_, _, _| Err("refused")), Err("refused"));
    }
}
