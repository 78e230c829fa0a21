//! How far two meshes are apart: from the points of one to the nearest places of the other, both ways.
//!
//! This work is based on: Pan, Zhou and Shi, equation 1, which takes the mean over the vertices of both meshes.

use std::thread;

use glam::{DVec3, Vec3};

use crate::{Mesh, Tree};

/// How many points are summed before sums are. It is the same for any number of threads, and so are the sums.
const CHUNK: usize = 4096;

/// The distances from points of one mesh to another mesh, in the meshes' units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Way {
    /// How many points there are.
    pub points: usize,
    /// The mean distance; over vertices each counts as one, over samples each as the area that it stands for.
    pub mean: f64,
    /// The largest distance.
    pub largest: f64,
}

/// How far two meshes are apart, in their units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distance {
    /// From the points of the original to the other mesh.
    pub there: Way,
    /// From the points of the other mesh to the original.
    pub back: Way,
    /// The diagonal of the original's bounding box.
    pub diagonal: f64,
}

impl Distance {
    /// The mean over the points of both: Pan's approximation error, equation 1, when the points are the vertices.
    pub fn mean(&self) -> f64 {
        let (there, back) = (self.there.points as f64, self.back.points as f64);
        if there + back == 0.0 {
            return 0.0;
        }
        (self.there.mean * there + self.back.mean * back) / (there + back)
    }

    /// The largest distance either way.
    pub fn largest(&self) -> f64 {
        self.there.largest.max(self.back.largest)
    }
}

/// A mesh that others are measured against.
#[derive(Clone, Debug)]
pub struct Reference<'a> {
    mesh: &'a Mesh,
    tree: Tree,
}

impl<'a> Reference<'a> {
    /// The original.
    ///
    /// # Panics
    /// When an index is beyond the positions, here as below: what reads meshes from files refuses such a one.
    pub fn new(mesh: &'a Mesh) -> Reference<'a> {
        Reference {
            mesh,
            tree: Tree::new(mesh),
        }
    }

    /// How far another mesh is from it, by the vertices of both. Vertices at the same place are one, and those that no triangle has
    /// are none. Distances to a mesh without triangles are infinite.
    pub fn to(&self, other: &Mesh) -> Distance {
        self.by(other, vertices)
    }

    /// How far another mesh is from it, by about so many points spread evenly over either surface, at least one in each
    /// triangle.
    pub fn to_by_samples(&self, other: &Mesh, samples: usize) -> Distance {
        self.by(other, |mesh| spread(mesh, samples))
    }

    fn by(&self, other: &Mesh, points: impl Fn(&Mesh) -> Vec<(DVec3, f64)>) -> Distance {
        Distance {
            there: way(&points(self.mesh), &Tree::new(other)),
            back: way(&points(other), &self.tree),
            diagonal: diagonal(self.mesh),
        }
    }
}

/// The diagonal of the box around the vertices that triangles have; 0 without any.
pub fn diagonal(mesh: &Mesh) -> f64 {
    let mut corners = mesh
        .indices
        .iter()
        .map(|&v| Vec3::from(mesh.positions[v as usize]));
    let Some(first) = corners.next() else {
        return 0.0;
    };
    let (low, high) = corners.fold((first, first), |(low, high), p| (low.min(p), high.max(p)));
    low.as_dvec3().distance(high.as_dvec3())
}

/// The places of the vertices that triangles have, each once, with weight 1.
fn vertices(mesh: &Mesh) -> Vec<(DVec3, f64)> {
    // Adding 0 makes the two zeros one.
    let mut places: Vec<[u32; 3]> = mesh
        .indices
        .iter()
        .map(|&v| mesh.positions[v as usize].map(|c| (c + 0.0).to_bits()))
        .collect();
    places.sort_unstable();
    places.dedup();
    places
        .into_iter()
        .map(|bits| (Vec3::from(bits.map(f32::from_bits)).as_dvec3(), 1.0))
        .collect()
}

/// Points in every triangle by its area, weighted with the area that each stands for.
fn spread(mesh: &Mesh, samples: usize) -> Vec<(DVec3, f64)> {
    let triangles = mesh.indices.as_chunks::<3>().0;
    let corners = |t: &[u32; 3]| t.map(|v| Vec3::from(mesh.positions[v as usize]).as_dvec3());
    let area = |[a, b, c]: [DVec3; 3]| 0.5 * (b - a).cross(c - a).length();
    let whole: f64 = triangles.iter().map(|t| area(corners(t))).sum();
    let mut points = Vec::with_capacity(samples + triangles.len());
    for t in triangles {
        let (places, own) = (corners(t), area(corners(t)));
        let share = if whole > 0.0 { own / whole } else { 0.0 };
        let count = (share * samples as f64).ceil().max(1.0);
        let [a, b, c] = places;
        for i in 0..count as usize {
            // Roberts' sequence, which fills a square evenly, folded into a triangle.
            let (mut u, mut v) = (
                (0.5 + i as f64 * 0.754_877_666_246_692_8) % 1.0,
                (0.5 + i as f64 * 0.569_840_290_998_053_3) % 1.0,
            );
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            points.push((a + (b - a) * u + (c - a) * v, own / count));
        }
    }
    points
}

/// The distances from weighted points to the triangles of a tree.
fn way(points: &[(DVec3, f64)], tree: &Tree) -> Way {
    let sum = |points: &[(DVec3, f64)]| {
        points.iter().fold(
            (0.0, 0.0, 0.0f64),
            |(sum, weights, largest), (place, weight)| {
                let distance = tree
                    .nearest(*place)
                    .map_or(f64::INFINITY, |nearest| nearest.distance);
                (
                    sum + distance * weight,
                    weights + weight,
                    largest.max(distance),
                )
            },
        )
    };
    let chunks: Vec<&[(DVec3, f64)]> = points.chunks(CHUNK).collect();
    let threads = thread::available_parallelism()
        .map_or(1, usize::from)
        .clamp(1, chunks.len().max(1));
    let mut sums = vec![(0.0, 0.0, 0.0); chunks.len()];
    thread::scope(|scope| {
        let share = chunks.len().div_ceil(threads).max(1);
        for (chunks, sums) in chunks.chunks(share).zip(sums.chunks_mut(share)) {
            scope.spawn(|| {
                for (chunk, into) in chunks.iter().zip(sums) {
                    *into = sum(chunk);
                }
            });
        }
    });
    let (sum, weights, largest) = sums.iter().fold((0.0, 0.0, 0.0f64), |all, one| {
        (all.0 + one.0, all.1 + one.1, all.2.max(one.2))
    });
    Way {
        points: points.len(),
        mean: if weights > 0.0 { sum / weights } else { 0.0 },
        largest,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::{Random, field, sphere};

    /// Two triangles that make a square in the plane of a height.
    fn square(height: f32, side: f32) -> Mesh {
        Mesh {
            positions: [[0.0, 0.0], [side, 0.0], [side, side], [0.0, side]]
                .map(|[x, y]| [x, y, height])
                .to_vec(),
            indices: vec![0, 1, 2, 0, 2, 3],
            ..Mesh::default()
        }
    }

    #[test]
    fn squares_are_as_far_apart_as_they_are() {
        let (near, far) = (square(0.0, 1.0), square(0.25, 1.0));
        let distance = Reference::new(&near).to(&far);
        assert_eq!(
            (distance.mean(), distance.largest(), distance.diagonal),
            (0.25, 0.25, 2f64.sqrt())
        );

        // One corner of the large square is over the small one.
        let (small, large) = (square(0.0, 1.0), square(0.0, 3.0));
        let distance = Reference::new(&small).to(&large);
        assert_eq!(
            (distance.there.mean, distance.back.largest),
            (0.0, 8f64.sqrt())
        );
        assert_eq!(distance.mean(), (2.0 + 2.0 + 8f64.sqrt()) / 8.0);
        let by_samples = Reference::new(&small).to_by_samples(&large, 20_000);
        assert_eq!(by_samples.there.largest, 0.0);
        // The distance from the unit square, over the square of side 3: two strips and a corner, by integration.
        let corner = (0..400).map(|i| {
            (0..400)
                .map(|j| f64::hypot(f64::from(i) + 0.5, f64::from(j) + 0.5) / 200.0)
                .sum::<f64>()
        });
        let mean = (2.0 * 2.0 + corner.sum::<f64>() / 40_000.0) / 9.0;
        assert!(
            (by_samples.back.mean - mean).abs() < 1e-3,
            "{} and {mean}",
            by_samples.back.mean
        );
    }

    #[test]
    fn copies_of_vertices_count_once_and_unused_ones_not_at_all() {
        let mut mesh = square(0.0, 1.0);
        mesh.positions.push([-0.0, 0.0, 0.0]);
        mesh.positions.push([100.0; 3]);
        mesh.indices.extend([4, 1, 2]);
        let distance = Reference::new(&mesh).to(&square(1.0, 1.0));
        assert_eq!((distance.there.points, distance.back.points), (4, 4));
        assert_eq!(distance.diagonal, 2f64.sqrt());
    }

    #[test]
    fn nothing_is_infinitely_far_from_something() {
        let distance = Reference::new(&square(0.0, 1.0)).to(&Mesh::default());
        assert_eq!(
            (distance.there.largest, distance.back.points),
            (f64::INFINITY, 0)
        );
    }

    #[test]
    fn a_coarse_sphere_is_inside_a_fine_one() {
        let (fine, coarse) = (sphere(96, 48), sphere(12, 6));
        let distance = Reference::new(&fine).to(&coarse);
        // The vertices of the coarse one are vertices of the other.
        assert!(distance.back.largest < 1e-6);
        assert!(distance.there.mean > 0.02 && distance.there.largest < 0.1);
        let mut random = Random(3);
        let field = field(10, 0.1, &mut random);
        assert_eq!(Reference::new(&field).to(&field).largest(), 0.0);
    }
}
