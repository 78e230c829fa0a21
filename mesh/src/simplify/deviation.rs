//! How far a simplified surface can be from its original: a bound for each triangle, proved collapse by collapse.
//!
//! Points of the original and points of the surface are *paired*, so that every point of either is in a pair. A triangle's
//! bound is no less than the distance between the two points of any pair whose second point is on it, save for points on
//! its edges that are paired through a neighbour. Then the largest bound is no less than either one-sided Hausdorff
//! distance: no point of one surface is farther than that from the other.
//!
//! In the beginning each point is paired with itself, and all bounds are 0. A collapse replaces the fan about `from` by
//! another. Pair the points of the old fan with those of the new one, all of both, and join the pairs end to end: a point of
//! the original with x, x with y. By the triangle inequality their distance is at most the bound of the triangle that x
//! is on, plus |x - y|. So the new bound of a triangle is the maximum of that over all old triangles from which there are pairs
//! to it. There are two ways to pair the fans, and whichever gives the smaller maximum is taken, for the whole fan.
//!
//! **By moving.** Move `from` along the edge to `to`, and let each triangle follow, its points keeping their barycentric
//! coordinates. None moves farther than `from` does. A triangle that stays is all of the new one; one that goes lies down on an edge
//! of a triangle that stays. That needs nothing of the fan.
//!
//! **By projection.** Find a direction along which both fans are seen without folds. On a border, first slide `from` to
//! the nearest point m of the straight line that the border will be, which is to pair by moving again; elsewhere m is `from`
//! itself. Now both fans cover the same polygon, and points that are seen at the same place are paired. Where a triangle of
//! the one overlaps one of the other, the difference of their heights is linear, so that its maximum is at a corner of the
//! overlap: at a point of the ring, where it is 0, at m, or where an edge of the one crosses one of the other. A seam is treated as a
//! border of two fans, so that what is on one side of it is paired with what is on that side: the bound holds for each draw
//! and each chart by itself.
//!
//! That both are seen without folds is this: all triangles are seen from the same side, and the triangles about m go around it
//! once (half around, on a border). Those then make a polygon that is seen whole from m, whose outline does not cross itself. The new fan
//! has the same outline; seen from one side all over it covers each place as often as the outline goes around it: once.
//!
//! Coordinates are those of f32, so that sums and products of them in f64 are as good as exact. Triangles that are seen too flat or too
//! steep are left to the first way, so that no quotient is worse than a part in 1e-10 of the fan's size; more than that is added to each bound.
//!
//! This work is based on: Pan, Zhou and Shi, section 2, who simplify under a bound of their own that the paper does not give.

use glam::{DVec2, DVec3};

use crate::surface::{Collapse, Surface};

/// How much is added to a bound for rounding, relative to the size of the fan.
const ROUNDING: f64 = 1e-8;
/// How far apart, relative to the size of the fan, two things that touch may be through rounding.
const TOUCH: f64 = 1e-11;
/// The least cosine between the direction of projection and the normal of a triangle.
const STEEPEST: f64 = 0.1;
/// The least height of a triangle as it is seen over its longest edge.
const FLATTEST_SEEN: f64 = 1e-7;
/// The sine of the angle below which two lines are not crossed with each other.
const NEARLY_PARALLEL: f64 = 1e-6;

/// A bound for each triangle of a surface on how far it is from the original, as the header of this file proves it.
#[derive(Clone, Debug)]
pub struct Deviation {
    bounds: Vec<f64>,
}

/// What a collapse does to the bounds.
#[derive(Clone, Debug, PartialEq)]
pub struct Carried {
    /// The largest of the new bounds.
    pub largest: f64,
    /// Each triangle whose bound changes, and its new one.
    pub bounds: Vec<(u32, f64)>,
}

impl Deviation {
    /// That of a surface that is its own original.
    pub fn new(surface: &Surface) -> Deviation {
        Deviation {
            bounds: vec![0.0; surface.triangle_ids()],
        }
    }

    /// How far a live triangle can be from the part of the original that became it, in the mesh's units.
    pub fn bound(&self, triangle: u32) -> f64 {
        self.bounds[triangle as usize]
    }

    /// The largest bound of the live triangles: no point of either surface is farther than that from the other.
    pub fn largest(&self, surface: &Surface) -> f64 {
        surface
            .triangles()
            .map(|(t, _)| self.bound(t))
            .fold(0.0, f64::max)
    }

    /// What a collapse of the surface would do to the bounds.
    pub fn after(&self, surface: &Surface, collapse: &Collapse) -> Carried {
        let carried = match Star::new(self, surface, collapse) {
            Some(star) => star.carry(),
            // Not what the surface answers: nothing can be said.
            None => collapse
                .moved
                .iter()
                .map(|(t, _)| (*t, f64::INFINITY))
                .collect(),
        };
        Carried {
            largest: carried.iter().map(|(_, bound)| *bound).fold(0.0, f64::max),
            bounds: carried,
        }
    }

    /// Makes it so.
    pub fn apply(&mut self, carried: &Carried) {
        for &(triangle, bound) in &carried.bounds {
            self.bounds[triangle as usize] = bound;
        }
    }
}

/// The fans of a collapse, numbered from `to` on.
struct Star {
    /// Where `from` is.
    centre: DVec3,
    /// The neighbours of `from` in order, `to` first. On a border it is seen from behind if need be.
    ring: Vec<DVec3>,
    /// Whether the last old triangle is between the last of the ring and `to`.
    closed: bool,
    /// The place in the ring of the other end of the seam or border that `from` is on.
    far: Option<usize>,
    /// The bounds of the old triangles: the one at `i` is between `i` and `i + 1` of the ring.
    before: Vec<f64>,
    /// The triangles that stay: the one at `i` here is between `i + 1` and `i + 2` of the ring.
    staying: Vec<u32>,
    /// Without any: the triangle on the other side of the edge that is left, and its bound.
    behind: Option<(u32, f64)>,
}

impl Star {
    fn new(deviation: &Deviation, surface: &Surface, collapse: &Collapse) -> Option<Star> {
        let Collapse { from, to, .. } = *collapse;
        let fan = surface.fan(from)?;
        let (mut slices, closed) = (fan.slices, fan.closed);
        let mut ring: Vec<u32>;
        let mut far = None;
        if closed {
            let first = slices.iter().position(|slice| slice.next == to)?;
            slices.rotate_left(first);
            ring = slices.iter().map(|slice| slice.next).collect();
            if slices[0].wedge != slices[slices.len() - 1].wedge {
                far = (1..slices.len()).find(|&i| slices[i - 1].wedge != slices[i].wedge);
            }
        } else {
            ring = slices.iter().map(|slice| slice.next).collect();
            ring.push(slices[slices.len() - 1].last);
            if ring[0] != to {
                ring.reverse();
                slices.reverse();
            }
            far = Some(ring.len() - 1);
        }
        if ring[0] != to {
            return None;
        }
        let staying: Vec<u32> = slices.iter().map(|slice| slice.triangle).collect();
        let last = if closed {
            slices.len() - 1
        } else {
            slices.len()
        };
        let staying = staying.get(1..last)?.to_vec();
        let behind = || {
            let mut others = surface
                .around(to)
                .iter()
                .filter(|&&t| t != slices[0].triangle && surface.corners(t).contains(&ring[1]));
            others.next().map(|&t| (t, deviation.bound(t)))
        };
        Some(Star {
            centre: surface.position(from),
            behind: if staying.is_empty() {
                Some(behind()?)
            } else {
                None
            },
            ring: ring.iter().map(|&p| surface.position(p)).collect(),
            closed,
            far,
            before: slices
                .iter()
                .map(|slice| deviation.bound(slice.triangle))
                .collect(),
            staying,
        })
    }

    fn carry(&self) -> Vec<(u32, f64)> {
        if let Some((triangle, bound)) = self.behind {
            // The only triangle lies down on the edge that is opposite to `from`.
            let slide = self
                .centre
                .distance(nearest_on_line(self.centre, self.ring[0], self.ring[1]).0);
            return vec![(
                triangle,
                bound.max(self.before[0] + slide * (1.0 + ROUNDING)),
            )];
        }
        let largest = |bounds: &[f64]| bounds.iter().copied().fold(0.0, f64::max);
        let mut best = self.by_moving();
        let mut tried = Vec::new();
        for direction in self.directions() {
            if tried.contains(&direction) {
                continue;
            }
            if let Some(bounds) = self.by_projection(direction) {
                if largest(&bounds) < largest(&best) {
                    best = bounds;
                }
                break;
            }
            tried.push(direction);
        }
        self.staying.iter().copied().zip(best).collect()
    }

    /// The bounds of the triangles that stay when `from` is moved to `to`.
    fn by_moving(&self) -> Vec<f64> {
        let way = self.centre.distance(self.ring[0]) * (1.0 + ROUNDING);
        let mut bounds: Vec<f64> = (1..=self.staying.len())
            .map(|i| self.before[i] + way)
            .collect();
        bounds[0] = bounds[0].max(self.before[0] + way);
        if self.closed {
            let last = bounds.len() - 1;
            bounds[last] = bounds[last].max(self.before[self.before.len() - 1] + way);
        }
        bounds
    }

    /// Directions along which both fans may be seen without folds: the mean normal by area, and by triangle.
    fn directions(&self) -> [DVec3; 2] {
        let normal = |a: DVec3, b: DVec3, c: DVec3| (b - a).cross(c - a);
        let old = (0..self.before.len())
            .map(|i| normal(self.centre, self.ring[i], self.ring[self.after(i)]));
        let new =
            (1..=self.staying.len()).map(|i| normal(self.ring[0], self.ring[i], self.ring[i + 1]));
        let (mut by_area, mut by_triangle) = (DVec3::ZERO, DVec3::ZERO);
        for normal in old.chain(new) {
            by_area += normal;
            by_triangle += normal.normalize_or_zero();
        }
        [by_area.normalize_or_zero(), by_triangle.normalize_or_zero()]
    }

    /// The place in the ring after one.
    fn after(&self, i: usize) -> usize {
        if i + 1 == self.ring.len() { 0 } else { i + 1 }
    }

    /// The bounds of the triangles that stay when both fans are seen along a direction, if that can be done.
    fn by_projection(&self, direction: DVec3) -> Option<Vec<f64>> {
        if direction == DVec3::ZERO {
            return None;
        }
        let (middle, slide) = match self.far {
            None => (self.centre, 0.0),
            Some(far) => {
                let (middle, along) = nearest_on_line(self.centre, self.ring[0], self.ring[far]);
                if along <= 0.0 || along >= 1.0 {
                    return None;
                }
                (middle, self.centre.distance(middle))
            }
        };
        let seen = Seen::new(self, middle, direction)?;
        let bounds = (0..self.staying.len()).map(|j| {
            let new = [0, j + 1, j + 2].map(|i| seen.places[i]);
            let reached = (0..self.before.len()).filter(|&i| {
                let old = [DVec2::ZERO, seen.places[i], seen.places[self.after(i)]];
                overlap(old, new, TOUCH * seen.size)
            });
            let reached = reached.map(|i| self.before[i]).fold(0.0, f64::max);
            reached + slide + seen.apart[j] + ROUNDING * seen.size
        });
        Some(bounds.collect())
    }
}

/// Both fans as they are seen along a direction, from above m, which is the origin.
struct Seen {
    /// The ring.
    places: Vec<DVec2>,
    /// How far the farthest of it is away.
    size: f64,
    /// By how much heights differ within each triangle of the new fan.
    apart: Vec<f64>,
}

impl Seen {
    fn new(star: &Star, middle: DVec3, direction: DVec3) -> Option<Seen> {
        let right = direction.any_orthonormal_vector();
        let up = direction.cross(right);
        let places: Vec<DVec2> = star
            .ring
            .iter()
            .map(|p| DVec2::new((p - middle).dot(right), (p - middle).dot(up)))
            .collect();
        let heights: Vec<f64> = star
            .ring
            .iter()
            .map(|p| (p - middle).dot(direction))
            .collect();
        let size = star
            .ring
            .iter()
            .map(|p| p.distance_squared(middle))
            .fold(0.0, f64::max)
            .sqrt();

        let is_seen = |corners: [DVec2; 3], true_corners: [DVec3; 3]| {
            let [a, b, c] = corners;
            let area = (b - a).perp_dot(c - a);
            let longest = a
                .distance_squared(b)
                .max(b.distance_squared(c))
                .max(c.distance_squared(a));
            let true_area = (true_corners[1] - true_corners[0])
                .cross(true_corners[2] - true_corners[0])
                .length();
            area > FLATTEST_SEEN * longest && area > STEEPEST * true_area
        };
        // A border that is seen from behind has its triangles the other way around.
        let old = (0..star.before.len()).all(|i| {
            let next = star.after(i);
            is_seen(
                [DVec2::ZERO, places[i], places[next]],
                [middle, star.ring[i], star.ring[next]],
            )
        });
        let new = (1..=star.staying.len()).all(|i| {
            is_seen(
                [places[0], places[i], places[i + 1]],
                [star.ring[0], star.ring[i], star.ring[i + 1]],
            )
        });
        if !old || !new {
            return None;
        }
        let once = if star.closed {
            let crossed = |i: usize| places[i].y < 0.0 && places[star.after(i)].y >= 0.0;
            (0..places.len()).filter(|&i| crossed(i)).count() == 1
        } else {
            (1..places.len() - 1).all(|i| places[0].perp_dot(places[i]) > 0.0)
        };
        if !once {
            return None;
        }

        let mut seen = Seen {
            places,
            size,
            apart: vec![0.0; star.staying.len()],
        };
        if star.far.is_none() {
            seen.compare_middle(&heights)?;
        }
        seen.compare_crossings(&heights);
        Some(seen)
    }

    /// Compares the heights at m, where there is no edge of the new fan that it is on by construction.
    fn compare_middle(&mut self, heights: &[f64]) -> Option<()> {
        let mut found = None;
        for j in 0..self.apart.len() {
            let [a, b, c] = [0, j + 1, j + 2].map(|i| self.places[i]);
            let within =
                |a: DVec2, b: DVec2| (b - a).perp_dot(-a) >= -TOUCH * self.size * a.distance(b);
            if within(a, b) && within(b, c) && within(c, a) {
                let weighted = heights[0] * b.perp_dot(c)
                    + heights[j + 1] * c.perp_dot(a)
                    + heights[j + 2] * a.perp_dot(b);
                let height = weighted / (b - a).perp_dot(c - a);
                self.apart[j] = self.apart[j].max(height.abs());
                found = Some(());
            }
        }
        found
    }

    /// Compares the heights where an inner edge of the new fan crosses one of the old fan.
    fn compare_crossings(&mut self, heights: &[f64]) {
        let start = self.places[0];
        for inner in 2..=self.apart.len() {
            let end = self.places[inner];
            let mut apart: f64 = 0.0;
            for (spoke, &place) in self.places.iter().enumerate() {
                if spoke == 0 || spoke == inner {
                    // They meet in the ring; or are on one line, and the farthest apart at m.
                    continue;
                }
                let edge = Edge {
                    start,
                    end,
                    heights: [heights[0], heights[inner]],
                };
                apart = apart.max(edge.apart_from(place, heights[spoke], TOUCH * self.size));
            }
            for j in [inner - 2, inner - 1] {
                self.apart[j] = self.apart[j].max(apart);
            }
        }
    }
}

/// An edge as it is seen, with the heights of its ends.
struct Edge {
    start: DVec2,
    end: DVec2,
    heights: [f64; 2],
}

impl Edge {
    /// How far it is above or below the line from the origin to a place of this height, where they cross; 0 where they do not.
    fn apart_from(&self, place: DVec2, height: f64, touch: f64) -> f64 {
        let way = self.end - self.start;
        let (length, far) = (way.length(), place.length());
        let turn = place.perp_dot(way);
        let [low, high] = self.heights;
        if turn.abs() > NEARLY_PARALLEL * length * far {
            let (s, t) = (
                self.start.perp_dot(way) / turn,
                self.start.perp_dot(place) / turn,
            );
            let on = |t: f64, length: f64| t * length >= -touch && (t - 1.0) * length <= touch;
            return if on(s, far) && on(t, length) {
                (s * height - (low + t * (high - low))).abs()
            } else {
                0.0
            };
        }
        // Nearly parallel. Where they cross is not known well; but there they are equally far along the line, and as a function
        // of that, the difference of heights is linear: it is no greater than at the ends of the part that both have.
        let aside = [self.start, self.end].map(|p| place.perp_dot(p) / far);
        if aside.iter().all(|d| *d > touch) || aside.iter().all(|d| *d < -touch) {
            return 0.0;
        }
        let [first, last] = [self.start, self.end].map(|p| p.dot(place) / far);
        let (from, to) = (first.min(last).max(0.0), first.max(last).min(far));
        if from > to + touch {
            return 0.0;
        }
        let apart =
            |x: f64| (height * x / far - (low + (high - low) * (x - first) / (last - first))).abs();
        apart(from).max(apart(to))
    }
}

/// The point of the line from `a` to `b` that is nearest to `p`, and how far along it is: from 0 to 1.
fn nearest_on_line(p: DVec3, a: DVec3, b: DVec3) -> (DVec3, f64) {
    let way = b - a;
    let along = ((p - a).dot(way) / way.length_squared()).clamp(0.0, 1.0);
    (a + way * along, along)
}

/// Whether two counter-clockwise triangles overlap, by more than touching.
fn overlap(a: [DVec2; 3], b: [DVec2; 3], touch: f64) -> bool {
    let apart = |a: [DVec2; 3], b: [DVec2; 3]| {
        (0..3).any(|i| {
            let (start, way) = (a[i], a[(i + 1) % 3] - a[i]);
            let most = touch * way.length();
            b.iter().all(|p| way.perp_dot(p - start) <= most)
        })
    };
    !apart(a, b) && !apart(b, a)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The fan about the origin with a ring at these angles, in degrees, and radii, level but for `to`.
    fn star(ring: &[(f64, f64)], before: &[f64]) -> Star {
        let place = |&(angle, radius): &(f64, f64)| {
            DVec3::new(
                radius * angle.to_radians().cos(),
                radius * angle.to_radians().sin(),
                0.0,
            )
        };
        Star {
            centre: DVec3::ZERO,
            ring: ring.iter().map(place).collect(),
            closed: true,
            far: None,
            before: before.to_vec(),
            staying: (10..).take(ring.len() - 2).collect(),
            behind: None,
        }
    }

    #[test]
    fn moving_carries_what_goes_onto_its_neighbours() {
        let bounds = |before: &[f64]| {
            star(
                &[(0.0, 2.0), (90.0, 1.0), (180.0, 1.0), (270.0, 1.0)],
                before,
            )
            .by_moving()
        };
        for (before, after) in [
            ([5.0, 1.0, 2.0, 7.0], [7.0, 9.0]),
            ([0.0, 3.0, 4.0, 1.0], [5.0, 6.0]),
        ] {
            let found = bounds(&before);
            assert!(
                found
                    .iter()
                    .zip(after)
                    .all(|(found, after)| (found - after).abs() < 1e-6),
                "{found:?}"
            );
        }
    }

    #[test]
    fn projection_adds_the_difference_of_heights_to_what_is_overlapped() {
        // A roof over a square: its top goes down to a corner. The ridge of the new fan is the diagonal from `to`, on which m is.
        let mut roof = star(
            &[(0.0, 1.0), (90.0, 1.0), (180.0, 1.0), (270.0, 1.0)],
            &[0.5, 0.25, 0.0, 0.125],
        );
        roof.centre.z = 0.1;
        let bounds = roof.by_projection(DVec3::Z).unwrap();
        assert!(
            (bounds[0] - 0.6).abs() < 1e-6 && (bounds[1] - 0.225).abs() < 1e-6,
            "{bounds:?}"
        );
        assert_eq!(roof.by_projection(DVec3::NEG_Z), None);
        assert_eq!(
            roof.carry().iter().map(|(t, _)| *t).collect::<Vec<_>>(),
            [10, 11]
        );
        // By moving it would be no less than 1.
        assert!(roof.carry().iter().all(|(_, bound)| *bound < 0.61));
    }

    #[test]
    fn a_fan_that_goes_around_twice_is_not_projected() {
        let twice: Vec<(f64, f64)> = (0..11)
            .map(|i| (f64::from(i) * 720.0 / 11.0, if i == 0 { 0.1 } else { 1.0 }))
            .collect();
        assert_eq!(star(&twice, &[0.0; 11]).by_projection(DVec3::Z), None);
        let once: Vec<(f64, f64)> = twice
            .iter()
            .map(|(angle, radius)| (angle / 2.0, *radius))
            .collect();
        assert!(star(&once, &[0.0; 11]).by_projection(DVec3::Z).is_some());
    }

    #[test]
    fn edges_that_are_nearly_one_are_compared_over_all_that_they_share() {
        let edge = Edge {
            start: DVec2::new(0.2, 1e-9),
            end: DVec2::new(0.8, -1e-9),
            heights: [3.0, 5.0],
        };
        // They cross at 0.5, where it is at 4 and the line at 0.
        let apart = edge.apart_from(DVec2::X, 0.0, TOUCH);
        assert!((4.0..5.1).contains(&apart), "{apart}");
        assert_eq!(edge.apart_from(DVec2::NEG_X, 0.0, TOUCH), 0.0);
        assert_eq!(edge.apart_from(DVec2::Y, 0.0, TOUCH), 0.0);
        // Across: in the middle of the edge, at the end of the line.
        let across = Edge {
            start: DVec2::new(1.0, -1.0),
            end: DVec2::new(1.0, 1.0),
            ..edge
        };
        assert_eq!(across.apart_from(DVec2::X, 1.0, TOUCH), 3.0);
        assert_eq!(across.apart_from(DVec2::X * 2.0, 1.0, TOUCH), 3.5);
        assert_eq!(across.apart_from(DVec2::X * 0.9, 1.0, TOUCH), 0.0);
    }
}
