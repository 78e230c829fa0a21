//! Which pairs of a mesh and a shader are within the bound at one distance: along the boundary of those, or all of them.
//!
//! With errors that rise along both sequences, what is within the bound is a staircase: for each shader there is a simplest mesh that
//! is, and that mesh is not simpler for a simpler shader. The walk follows the edge of the staircase from the simplest mesh with the
//! original shader to the original mesh: a pair over the bound asks for a better mesh, a pair within it allows a simpler shader.
//! It looks at no more than K + L - 1 pairs of K x L.
//!
//! Algorithm 2, as printed, ends before the last shader is looked at, since it compares an index from 0 with the length less one; here
//! all are. What errors that are measured do is not quite monotone: what was seen of that on the way is counted.
//!
//! This work is based on: Liang 2022, section 5.3, algorithm 2.

/// A mesh with a shader, by their places in the sequences that they come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Pair {
    /// Which mesh; 0 is the original.
    pub mesh: usize,
    /// Which shader; 0 is the original.
    pub shader: usize,
}

/// A pair that was looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Visit {
    /// Which one.
    pub pair: Pair,
    /// Its error as a share of the bound: up to 1 is within it.
    pub strain: f64,
}

impl Visit {
    /// Whether it is within the bound; what is not a number is not.
    pub fn is_within(&self) -> bool {
        self.strain <= 1.0
    }
}

/// What a search of pairs at one distance has seen.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Walk {
    /// The pairs in the order in which they were looked at.
    pub visits: Vec<Visit>,
}

/// How often simpler was worse, as the walk takes for granted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Monotonicity {
    /// Pairs of visits of which one is simpler than the other, in mesh or in shader or in both.
    pub compared: usize,
    /// Those of them of which the simpler one has less error.
    pub violated: usize,
    /// Those of them that also are on two sides of the bound, the simpler one within it: what may lead the walk astray.
    pub misleading: usize,
}

impl Walk {
    /// The pairs that are within the bound.
    pub fn within(&self) -> Vec<Pair> {
        let visits = self.visits.iter();
        let within = visits.filter(|visit| visit.is_within());
        within.map(|visit| visit.pair).collect()
    }

    /// How far what was seen is monotone.
    pub fn monotonicity(&self) -> Monotonicity {
        let mut seen = Monotonicity::default();
        for a in &self.visits {
            for b in &self.visits {
                let is_simpler = a.pair != b.pair
                    && a.pair.mesh <= b.pair.mesh
                    && a.pair.shader <= b.pair.shader;
                if !is_simpler {
                    continue;
                }
                seen.compared += 1;
                seen.violated += usize::from(b.strain < a.strain);
                seen.misleading += usize::from(b.is_within() && !a.is_within());
            }
        }
        seen
    }
}

/// Walks along the boundary of the pairs that are within the bound. `strain` measures a pair's error, as a share of the bound.
///
/// # Errors
/// What `strain` fails with.
pub fn walk<E>(
    meshes: usize,
    shaders: usize,
    mut strain: impl FnMut(Pair) -> Result<f64, E>,
) -> Result<Walk, E> {
    let mut walk = Walk::default();
    let mut left = meshes;
    let mut shader = 0;
    while let Some(mesh) = left.checked_sub(1)
        && shader < shaders
    {
        let pair = Pair { mesh, shader };
        let visit = Visit {
            pair,
            strain: strain(pair)?,
        };
        walk.visits.push(visit);
        match visit.is_within() {
            true => shader += 1,
            false => left = mesh,
        }
    }
    Ok(walk)
}

/// Looks at all pairs, shader by shader.
///
/// # Errors
/// What `strain` fails with.
pub fn exhaustive<E>(
    meshes: usize,
    shaders: usize,
    mut strain: impl FnMut(Pair) -> Result<f64, E>,
) -> Result<Walk, E> {
    let pairs = (0..shaders).flat_map(|shader| (0..meshes).map(move |mesh| Pair { mesh, shader }));
    let visits = pairs.map(|pair| {
        Ok(Visit {
            pair,
            strain: strain(pair)?,
        })
    });
    Ok(Walk {
        visits: visits.collect::<Result<_, E>>()?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use std::collections::BTreeSet;
    use std::convert::Infallible;

    fn ok(of: impl Fn(Pair) -> f64) -> impl Fn(Pair) -> Result<f64, Infallible> {
        move |pair| Ok(of(pair))
    }

    /// Numbers that rise, from 0.
    fn rising(random: &mut Random, count: usize) -> Vec<f64> {
        let mut sum = 0.0;
        let numbers = (0..count).map(|_| {
            let number = sum;
            sum += random.unit();
            number
        });
        numbers.collect()
    }

    #[test]
    fn the_walk_finds_the_fastest_of_all_pairs_where_errors_are_monotone() {
        let mut random = Random(7);
        for _ in 0..500 {
            let [k, l] = [(); 2].map(|()| 1 + random.below(12));
            let (mesh_errors, shader_errors) = (rising(&mut random, k), rising(&mut random, l));
            let bound = 0.1 + 4.0 * random.unit();
            let strain = |pair: Pair| {
                (mesh_errors[pair.mesh].powi(2) + shader_errors[pair.shader].powi(2)).sqrt() / bound
            };
            // Simpler meshes are faster; what a shader costs has nothing to do with its error.
            let mut of_mesh = rising(&mut random, k);
            of_mesh.reverse();
            let of_shader: Vec<f64> = (0..l).map(|_| random.unit()).collect();
            let time = |pair: &Pair| of_mesh[pair.mesh] + of_shader[pair.shader];

            let Ok(walked) = walk(k, l, ok(strain));
            let Ok(all) = exhaustive(k, l, ok(strain));
            assert!(walked.visits.len() < k + l, "{k} {l}");
            let once: BTreeSet<Pair> = walked.visits.iter().map(|visit| visit.pair).collect();
            assert_eq!(once.len(), walked.visits.len());
            assert_eq!(all.visits.len(), k * l);
            assert_eq!(walked.monotonicity().violated, 0);
            assert_eq!(all.monotonicity().violated, 0);

            let fastest = |walk: &Walk| {
                let times = walk.within().iter().map(time).collect::<Vec<f64>>();
                times.into_iter().min_by(f64::total_cmp)
            };
            assert_eq!(fastest(&walked), fastest(&all));
        }
    }

    #[test]
    fn the_last_shader_is_looked_at() {
        let Ok(walk) = walk(3, 4, ok(|_| 0.5));
        let pairs: Vec<Pair> = walk.within();
        let all: Vec<Pair> = (0..4).map(|shader| Pair { mesh: 2, shader }).collect();
        assert_eq!(pairs, all);
    }

    #[test]
    fn nothing_is_within_where_nothing_is() {
        for strain in [2.0, f64::NAN, f64::INFINITY] {
            let Ok(walk) = walk(3, 4, ok(|_| strain));
            assert_eq!(walk.visits.len(), 3);
            assert!(walk.within().is_empty());
        }
        let Ok(none) = walk(0, 4, ok(|_| 0.0));
        assert!(none.visits.is_empty());
    }

    #[test]
    fn what_is_not_monotone_is_counted() {
        // The simplest mesh is better than the one before: one comparison within a shader's own meshes.
        let errors = [0.0, 3.0, 2.0];
        let Ok(walked) = walk(3, 1, ok(|pair| errors[pair.mesh]));
        let expected = Monotonicity {
            compared: 3,
            violated: 1,
            misleading: 0,
        };
        assert_eq!(walked.monotonicity(), expected);
        let errors = [0.0, 3.0, 0.5];
        let Ok(all) = exhaustive(3, 1, ok(|pair| errors[pair.mesh]));
        let expected = Monotonicity {
            misleading: 1,
            ..expected
        };
        assert_eq!(all.monotonicity(), expected);
    }

    #[test]
    fn a_failure_ends_it() {
        let fails = |pair: Pair| match pair.mesh {
            1 => Err("refused"),
            _ => Ok(2.0),
        };
        assert_eq!(walk(3, 2, fails), Err("refused"));
        assert_eq!(exhaustive(3, 2, fails), Err("refused"));
    }
}
