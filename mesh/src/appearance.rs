//! What it costs to move a point of a surface onto a neighbour where appearance counts, guessed: by points of the surface as it
//! was.
//!
//! Points all over the original remember where they were and what its vertices handed over there. Each belongs to the triangle
//! that stands for it now, and costs the square of its distance from that and of the difference of each attribute. When edges
//! go, the points of the triangles around are projected onto those that are left. So what has gone is never forgotten, errors
//! that cancel do cancel, and outlines, borders and seams need no rules of their own. Quadrics are some times faster, but
//! carry the planes and gradients of single triangles far beyond these.
//!
//! Each triangle weighs as its user says: what moving it costs, and what changing an attribute on it costs.
//!
//! With p points for each triangle that is left, an edge takes O(p) projections onto five triangles or so.
//!
//! This work is based on: Hoppe, "Progressive meshes", 1996, section 4.

use crate::tree::{Tree, nearest_in_triangle};
use crate::{Collapse, Mesh, Surface};
use glam::DVec3;

/// How many numbers of a vertex are looked at: three of the normal, two texture coordinates, three of the colour.
pub const CHANNELS: usize = 8;

/// What changing a triangle costs, over its whole area.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Weights {
    /// For each square of a unit that it is moved off its plane.
    pub position: f64,
    /// For each square of a unit that a number of its vertices changes by, in the order of [`channels`].
    pub channels: [f64; CHANNELS],
}

/// The numbers of a vertex that are looked at; 0 where the mesh has none.
pub fn channels(mesh: &Mesh, vertex: u32) -> [f64; CHANNELS] {
    let at = vertex as usize;
    let normal = mesh.normals.get(at).copied().unwrap_or_default();
    let uv = mesh.uvs.get(at).copied().unwrap_or_default();
    let [r, g, b, _] = mesh.colours.get(at).copied().unwrap_or_default();
    let [x, y, z] = normal;
    [x, y, z, uv[0], uv[1], r, g, b].map(f64::from)
}

/// What of a triangle's weight its middle has; its corners have the rest. So integrals of squares of linear functions are exact.
const MIDDLE: f64 = 0.75;

/// A point of the surface as it was.
#[derive(Clone, Debug)]
struct Sample {
    place: DVec3,
    values: [f64; CHANNELS],
    weights: Weights,
    /// What it costs now.
    cost: f64,
}

/// Points of a surface as it was, and what became of them.
#[derive(Clone, Debug)]
pub struct Samples {
    samples: Vec<Sample>,
    /// Those that each triangle stands for.
    of_triangles: Vec<Vec<u32>>,
    /// The channels of each vertex.
    values: Vec<[f64; CHANNELS]>,
    /// The channels that weigh anything.
    channels: Vec<usize>,
}

/// A triangle that may stand for some points.
struct Triangle {
    number: u32,
    places: [DVec3; 3],
    values: [[f64; CHANNELS]; 3],
}

impl Samples {
    /// Of a mesh of which a surface was made, which may have lost edges since; `weights` says what changing a triangle costs
    /// that is left, by its number.
    pub fn new(surface: &Surface, mesh: &Mesh, weights: impl Fn(u32) -> Weights) -> Self {
        let values = (0..mesh.positions.len() as u32).map(|v| channels(mesh, v));
        let mut new = Self {
            samples: Vec::new(),
            of_triangles: vec![Vec::new(); surface.triangle_ids()],
            values: values.collect(),
            channels: Vec::new(),
        };
        let left: Vec<(u32, [u32; 3])> = surface.triangles().collect();
        let mut densities = vec![Weights::default(); surface.triangle_ids()];
        for (number, corners) in &left {
            let triangle = new.triangle(surface, *number, *corners);
            let density = weights(*number).times(1.0 / triangle.area());
            for channel in 0..CHANNELS {
                if density.channels[channel] > 0.0 && !new.channels.contains(&channel) {
                    new.channels.push(channel);
                }
            }
            densities[*number as usize] = density;
        }
        new.channels.sort_unstable();
        let tree = Tree::new(&Mesh {
            positions: mesh.positions.clone(),
            indices: left.iter().flat_map(|(_, corners)| *corners).collect(),
            ..Mesh::default()
        });

        // The area that each vertex stands for, and the triangle that is left of those around it.
        let mut vertices: Vec<(f64, Option<u32>)> = vec![(0.0, None); new.values.len()];
        for (number, corners) in (0..).zip(mesh.indices.as_chunks::<3>().0) {
            let whole = new.triangle(surface, number, *corners);
            let kept = (surface.triangle(number) == Some(*corners)).then_some(number);
            for vertex in corners {
                let (area, triangle) = &mut vertices[*vertex as usize];
                *area += (1.0 - MIDDLE) / 3.0 * whole.area();
                *triangle = triangle.or(kept);
            }
            let (place, values) = whole.at([1.0 / 3.0; 3]);
            let near = || new.near(surface, &left, &tree, place);
            let near = kept.map_or_else(near, |kept| vec![kept]);
            new.put(
                surface,
                &densities,
                (place, values),
                (MIDDLE * whole.area(), near),
            );
        }
        for (vertex, (area, kept)) in vertices.into_iter().enumerate() {
            if area > 0.0 {
                let place = surface.position(surface.point_of(vertex as u32));
                let values = new.values[vertex];
                let near = || new.near(surface, &left, &tree, place);
                let near = kept.map_or_else(near, |kept| vec![kept]);
                new.put(surface, &densities, (place, values), (area, near));
            }
        }
        new
    }

    /// The triangles that may stand for a place.
    fn near(
        &self,
        surface: &Surface,
        left: &[(u32, [u32; 3])],
        tree: &Tree,
        place: DVec3,
    ) -> Vec<u32> {
        let Some(nearest) = tree.nearest(place) else {
            return Vec::new();
        };
        let (_, corners) = left[nearest.triangle as usize];
        let points = corners.map(|vertex| surface.point_of(vertex));
        points
            .iter()
            .flat_map(|point| surface.around(*point))
            .copied()
            .collect()
    }

    /// Adds a sample that stands for so much area to the one of some triangles where it costs least.
    fn put(
        &mut self,
        surface: &Surface,
        densities: &[Weights],
        (place, values): (DVec3, [f64; CHANNELS]),
        (area, near): (f64, Vec<u32>),
    ) {
        let best = near
            .into_iter()
            .filter_map(|number| {
                let triangle = self.triangle(surface, number, surface.triangle(number)?);
                let sample = Sample {
                    place,
                    values,
                    weights: densities[number as usize].times(area),
                    cost: 0.0,
                };
                let cost = self.cost_on(&sample, &triangle);
                Some((number, Sample { cost, ..sample }))
            })
            .min_by(|(_, a), (_, b)| a.cost.total_cmp(&b.cost));
        if let Some((number, sample)) = best {
            self.of_triangles[number as usize].push(self.samples.len() as u32);
            self.samples.push(sample);
        }
    }

    fn triangle(&self, surface: &Surface, number: u32, corners: [u32; 3]) -> Triangle {
        Triangle {
            number,
            places: corners.map(|vertex| surface.position(surface.point_of(vertex))),
            values: corners.map(|vertex| self.values[vertex as usize]),
        }
    }

    /// What a sample would cost if a triangle stood for it.
    fn cost_on(&self, sample: &Sample, triangle: &Triangle) -> f64 {
        let place = nearest_in_triangle(sample.place, triangle.places);
        let shares = triangle.shares(place);
        let mut cost = sample.weights.position * place.distance_squared(sample.place);
        let (values, weights) = (&triangle.values, &sample.weights.channels);
        let at = |channel: usize| -> f64 { (0..3).map(|i| shares[i] * values[i][channel]).sum() };
        for &channel in &self.channels {
            cost += weights[channel] * (at(channel) - sample.values[channel]).powi(2);
        }
        cost
    }

    /// The samples of the triangles that a collapse changes, each with the best of those that take their place, and what it
    /// costs there.
    fn moved(
        &self,
        surface: &Surface,
        collapse: &Collapse,
    ) -> impl Iterator<Item = (u32, Option<(u32, f64)>)> {
        let moved = collapse.moved.iter();
        let moved = moved.map(|(number, corners)| self.triangle(surface, *number, *corners));
        let mut moved: Vec<Triangle> = moved.collect();
        if moved.is_empty() {
            // A corner of a border goes with its only triangle.
            let rest = surface.around(collapse.to).iter();
            let rest = rest.filter(|number| !collapse.removed.contains(number));
            moved.extend(
                rest.filter_map(|n| Some(self.triangle(surface, *n, surface.triangle(*n)?))),
            );
        }
        let changed = collapse.moved.iter().map(|(number, _)| number);
        let changed = changed.chain(&collapse.removed);
        let samples = changed.flat_map(|number| &self.of_triangles[*number as usize]);
        samples.map(move |number| {
            let sample = &self.samples[*number as usize];
            let costs = moved.iter().map(|t| (t.number, self.cost_on(sample, t)));
            (*number, costs.min_by(|a, b| a.1.total_cmp(&b.1)))
        })
    }

    /// What a collapse adds to the costs of all samples, in the unit of the weights; at least 0, infinite where nothing is left
    /// around.
    pub fn cost(&self, surface: &Surface, collapse: &Collapse) -> f64 {
        let added = self.moved(surface, collapse).map(|(sample, best)| {
            let (_, cost) = best.unwrap_or((0, f64::INFINITY));
            cost - self.samples[sample as usize].cost
        });
        added.sum::<f64>().max(0.0)
    }

    /// Hands the samples of what goes to what takes its place.
    pub fn apply(&mut self, surface: &Surface, collapse: &Collapse) {
        let moved: Vec<_> = self.moved(surface, collapse).collect();
        let changed = collapse.moved.iter().map(|(number, _)| number);
        for number in changed.chain(&collapse.removed) {
            self.of_triangles[*number as usize].clear();
        }
        for (sample, best) in moved {
            if let Some((triangle, cost)) = best {
                self.samples[sample as usize].cost = cost;
                self.of_triangles[triangle as usize].push(sample);
            }
        }
    }
}

impl Triangle {
    fn area(&self) -> f64 {
        let [a, b, c] = self.places;
        (b - a).cross(c - a).length() / 2.0
    }

    /// How much each corner has to say at a place on it.
    fn shares(&self, place: DVec3) -> [f64; 3] {
        let [a, b, c] = self.places;
        let normal = (b - a).cross(c - a);
        let square = normal.length_squared();
        if square == 0.0 {
            return [1.0 / 3.0; 3];
        }
        let of = |b: DVec3, c: DVec3| normal.dot((b - place).cross(c - place)) / square;
        let [first, second] = [of(b, c), of(c, a)];
        [first, second, 1.0 - first - second]
    }

    /// The place and the channels where corners have so much to say.
    fn at(&self, shares: [f64; 3]) -> (DVec3, [f64; CHANNELS]) {
        let place = (0..3).map(|i| self.places[i] * shares[i]).sum();
        let value = |channel| (0..3).map(|i| shares[i] * self.values[i][channel]).sum();
        (place, std::array::from_fn(value))
    }
}

impl Weights {
    /// So many times as much; nothing where that is not finite.
    fn times(&self, factor: f64) -> Self {
        let times = |weight: f64| match weight * factor {
            product if product.is_finite() => product,
            _ => 0.0,
        };
        Self {
            position: times(self.position),
            channels: self.channels.map(times),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid over -1..1 in x and y, whose texture coordinates are as `uv` says.
    fn grid(n: u32, height: impl Fn(f32, f32) -> f32, uv: impl Fn(f32, f32) -> [f32; 2]) -> Mesh {
        let mut mesh = Mesh::default();
        for (j, i) in (0..=n).flat_map(|j| (0..=n).map(move |i| (j, i))) {
            let [x, y] = [i, j].map(|k| 2.0 * k as f32 / n as f32 - 1.0);
            mesh.positions.push([x, y, height(x, y)]);
            mesh.normals.push([0.0, 0.0, 1.0]);
            mesh.uvs.push(uv(x, y));
        }
        for (j, i) in (0..n).flat_map(|j| (0..n).map(move |i| (j, i))) {
            let a = j * (n + 1) + i;
            let b = a + n + 1;
            mesh.indices.extend([a, a + 1, b + 1, a, b + 1, b]);
        }
        mesh
    }

    fn costs(mesh: &Mesh, weights: Weights) -> Vec<f64> {
        let surface = Surface::new(mesh);
        let samples = Samples::new(&surface, mesh, |_| weights);
        // The four corners of the grid take some of it with them.
        let points = 0..surface.points() as u32;
        let points = points.filter(|point| surface.neighbours(*point).len() > 3);
        let collapses = points.flat_map(|from| {
            let surface = &surface;
            let all = surface.neighbours(from).into_iter();
            all.filter_map(move |to| surface.collapse(from, to).ok())
        });
        collapses.map(|c| samples.cost(&surface, &c)).collect()
    }

    #[test]
    fn what_is_flat_costs_nothing() {
        let all = Weights {
            position: 1.0,
            channels: [1.0; CHANNELS],
        };
        let flat = costs(&grid(6, |_, _| 0.5, |x, y| [x + 0.5 * y, 3.0 * y]), all);
        assert!(flat.len() > 50);
        assert!(flat.iter().all(|cost| *cost < 1e-12), "{flat:?}");
    }

    #[test]
    fn a_bend_costs_what_it_weighs() {
        let bent = grid(6, |x, _| x * x, |x, y| [x, y]);
        let of = |position| {
            let weights = Weights {
                position,
                ..Weights::default()
            };
            costs(&bent, weights).into_iter().fold(0.0, f64::max)
        };
        assert!(of(1.0) > 1e-3);
        assert!((of(3.0) / of(1.0) - 3.0).abs() < 1e-9);
        assert_eq!(of(0.0), 0.0);
    }

    #[test]
    fn a_bend_of_an_attribute_costs_as_much_as_it_is_off() {
        // The second coordinate is off by d at the middle point alone.
        let d = 0.25;
        let mesh = grid(
            4,
            |_, _| 0.0,
            |x, y| [x, if x == 0.0 && y == 0.0 { d } else { 0.0 }],
        );
        let mut weights = Weights::default();
        weights.channels[4] = 1.0;
        let surface = Surface::new(&mesh);
        let samples = Samples::new(&surface, &mesh, |_| weights);
        let middle = 12;
        let to = surface.neighbours(middle)[0];
        let collapse = surface.collapse(middle, to).unwrap();
        // Each of the six triangles around it expects something else at the neighbour: 2 d at the farthest.
        let cost = samples.cost(&surface, &collapse);
        let d = f64::from(d);
        assert!(cost > 0.1 * d * d && cost < 8.0 * d * d, "{cost}");
    }
}
