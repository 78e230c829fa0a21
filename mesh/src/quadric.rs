//! The sum of squared distances from planes, as a quadratic function of the place: the cost by which edges are put in order.
//!
//! This work is based on: Garland and Heckbert, Surface simplification using quadric error metrics, whose error matrix Pan,
//! section 2, keeps for each vertex too.

use glam::DVec3;

/// A weighted sum of squared distances from planes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Quadric {
    /// The symmetric matrix: xx, yy, zz, xy, yz, zx.
    square: [f64; 6],
    linear: DVec3,
    constant: f64,
}

impl Quadric {
    /// The square of a linear function, given by its gradient and its value at the origin, times a weight.
    pub(crate) fn new(gradient: DVec3, offset: f64, weight: f64) -> Quadric {
        let n = gradient;
        Quadric {
            square: [
                n.x * n.x,
                n.y * n.y,
                n.z * n.z,
                n.x * n.y,
                n.y * n.z,
                n.z * n.x,
            ]
            .map(|c| c * weight),
            linear: n * (offset * weight),
            constant: offset * offset * weight,
        }
    }

    /// The squared distance from the plane through a place across a unit normal, times a weight.
    pub(crate) fn plane(place: DVec3, normal: DVec3, weight: f64) -> Quadric {
        Quadric::new(normal, -normal.dot(place), weight)
    }

    /// Adds another.
    pub(crate) fn add(&mut self, other: &Quadric) {
        for (sum, more) in self.square.iter_mut().zip(other.square) {
            *sum += more;
        }
        self.linear += other.linear;
        self.constant += other.constant;
    }

    /// Its value at a place; rounding may take it below 0.
    pub(crate) fn at(&self, p: DVec3) -> f64 {
        let [xx, yy, zz, xy, yz, zx] = self.square;
        let square = xx * p.x * p.x
            + yy * p.y * p.y
            + zz * p.z * p.z
            + 2.0 * (xy * p.x * p.y + yz * p.y * p.z + zx * p.z * p.x);
        square + 2.0 * self.linear.dot(p) + self.constant
    }
}
