//! What it costs to move a point of a surface onto a neighbour where appearance counts, guessed: quadrics of planes and of
//! attributes.
//!
//! Around a point, the square of how far a place is from the planes of the triangles is a quadratic function of the place, and
//! so is the square of how far an attribute is from what the triangles would interpolate there. Sums of such functions are
//! ten numbers for the planes, and four more for each attribute. When a point goes, its sums are added to those of the point
//! that it went to, so that they remember the surface as it was.
//!
//! Each triangle weighs as its user says: what moving it costs, and what changing an attribute on it costs.
//!
//! This work is based on: Garland and Heckbert, "Surface simplification using quadric error metrics", 1997, section 4; Hoppe,
//! "New quadric metric for simplifying meshes with appearance attributes", 1999, section 3.

use crate::quadric::Quadric;
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

/// The sums of the attributes of a vertex: `(gradient p + offset - s)^2` for each channel `s`.
#[derive(Clone, Copy, Debug, Default)]
struct Attributes {
    /// The part without `s`, of all channels.
    quadric: Quadric,
    /// What `-2 s` is multiplied by: a gradient and an offset for each channel.
    linear: [(DVec3, f64); CHANNELS],
    /// What `s^2` is multiplied by.
    square: [f64; CHANNELS],
}

impl Attributes {
    fn add(&mut self, other: &Self) {
        self.quadric.add(&other.quadric);
        for (to, from) in self.linear.iter_mut().zip(&other.linear) {
            to.0 += from.0;
            to.1 += from.1;
        }
        for (to, from) in self.square.iter_mut().zip(other.square) {
            *to += from;
        }
    }

    fn at(&self, p: DVec3, values: &[f64; CHANNELS]) -> f64 {
        let each = self.linear.iter().zip(self.square).zip(values);
        let rest = each.map(|(((gradient, offset), square), s)| {
            s * (s * square - 2.0 * (gradient.dot(p) + offset))
        });
        self.quadric.at(p) + rest.sum::<f64>()
    }
}

/// The quadrics of a surface's points and vertices.
#[derive(Clone, Debug)]
pub struct Quadrics {
    /// Places are taken from here, so that little is lost by subtraction.
    origin: DVec3,
    points: Vec<Quadric>,
    vertices: Vec<Attributes>,
    /// The channels of each vertex.
    values: Vec<[f64; CHANNELS]>,
}

impl Quadrics {
    /// Of a surface as it is now, whose vertices are those of a mesh; `weights` says what changing a triangle costs, by its
    /// number.
    pub fn new(surface: &Surface, mesh: &Mesh, weights: impl Fn(u32) -> Weights) -> Self {
        let count = mesh.positions.len();
        let origin = match surface.points() {
            0 => DVec3::ZERO,
            points => {
                let all = (0..points as u32).map(|point| surface.position(point));
                all.sum::<DVec3>() / points as f64
            }
        };
        let mut quadrics = Self {
            origin,
            points: vec![Quadric::default(); surface.points()],
            vertices: vec![Attributes::default(); count],
            values: (0..count as u32).map(|v| channels(mesh, v)).collect(),
        };
        for (triangle, corners) in surface.triangles() {
            quadrics.add(surface, corners, &weights(triangle));
        }
        quadrics
    }

    fn add(&mut self, surface: &Surface, corners: [u32; 3], weights: &Weights) {
        let points = corners.map(|vertex| surface.point_of(vertex));
        let [p, q, r] = points.map(|point| surface.position(point) - self.origin);
        let (e1, e2) = (q - p, r - p);
        let cross = e1.cross(e2);
        let Some(normal) = cross.try_normalize() else {
            return;
        };
        let plane = Quadric::plane(p, normal, weights.position / 3.0);
        for point in points {
            self.points[point as usize].add(&plane);
        }
        // The gradient in the plane of a function that is s at the corners.
        let area = cross.length_squared();
        let (d1, d2) = (e2.cross(cross) / area, cross.cross(e1) / area);
        let values = corners.map(|vertex| self.values[vertex as usize]);
        let mut sums = Attributes::default();
        for channel in 0..CHANNELS {
            let weight = weights.channels[channel] / 3.0;
            if weight == 0.0 {
                continue;
            }
            let [s, t, u] = values.map(|all| all[channel]);
            let gradient = d1 * (t - s) + d2 * (u - s);
            let offset = s - gradient.dot(p);
            sums.quadric.add(&Quadric::new(gradient, offset, weight));
            sums.linear[channel] = (gradient * weight, offset * weight);
            sums.square[channel] = weight;
        }
        for vertex in corners {
            self.vertices[vertex as usize].add(&sums);
        }
    }

    /// What a collapse costs, in the unit of the weights; at least 0.
    pub fn cost(&self, surface: &Surface, collapse: &Collapse) -> f64 {
        let to = surface.position(collapse.to) - self.origin;
        let of_plane = self.points[collapse.from as usize].at(to);
        let of_attributes = collapse
            .vertices
            .iter()
            .map(|(from, onto)| self.vertices[*from as usize].at(to, &self.values[*onto as usize]));
        // Rounding may take a sum of squares below 0.
        (of_plane + of_attributes.sum::<f64>()).max(0.0)
    }

    /// Hands the sums of what goes to what takes its place.
    pub fn apply(&mut self, collapse: &Collapse) {
        let from = self.points[collapse.from as usize];
        self.points[collapse.to as usize].add(&from);
        for (from, onto) in &collapse.vertices {
            let from = self.vertices[*from as usize];
            self.vertices[*onto as usize].add(&from);
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
        let quadrics = Quadrics::new(&surface, mesh, |_| weights);
        let points = 0..surface.points() as u32;
        let collapses = points.flat_map(|from| {
            let surface = &surface;
            let all = surface.neighbours(from).into_iter();
            all.filter_map(move |to| surface.collapse(from, to).ok())
        });
        collapses.map(|c| quadrics.cost(&surface, &c)).collect()
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
        let quadrics = Quadrics::new(&surface, &mesh, |_| weights);
        let middle = 12;
        let to = surface.neighbours(middle)[0];
        let collapse = surface.collapse(middle, to).unwrap();
        // Each of the six triangles around it expects something else at the neighbour: 2 d at the farthest.
        let cost = quadrics.cost(&surface, &collapse);
        let d = f64::from(d);
        assert!(cost > 0.1 * d * d && cost < 8.0 * d * d, "{cost}");
    }
}
