//! Simplification that looks at the geometry alone: to a bound that is proved, to a mean distance, to a number of triangles.
//!
//! ```text
//! Mesh --Surface--> half-edge collapses, cheapest first by their quadrics --deviation--> no farther than a bound
//! ```
//!
//! Edges are put in order by quadrics, which is quick and keeps what is curved; each collapse is then asked how far it
//! carries the surface from its original, and is left out when that is too far. It is the same on every machine.
//!
//! This work is based on: Pan, Zhou and Shi, Real-time rendering algorithm based on hybrid static and dynamic simplification
//! methods, section 2: the static half, here with edges instead of triangles that collapse, and a bound of our own.

mod deviation;

#[cfg(test)]
mod tests;

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use crate::Mesh;
use crate::distance::{self, Reference};
use crate::quadric::Quadric;
use crate::surface::{Collapse, Kind, Surface};

pub use deviation::{Carried, Deviation};

/// What a border or a seam weighs against the surface, when edges are put in order.
const EDGE_WEIGHT: f64 = 1.0;

/// What an edge costs for its length alone, relative to that of moving its star aside by as much. It puts
/// what is flat in an order that keeps triangles compact.
const LENGTH_WEIGHT: f64 = 1e-8;

/// What bounds that are tried one after the other differ by, as a factor.
const RUNG: f64 = std::f64::consts::SQRT_2;

/// How many bounds are tried below the one that is asked for.
const RUNGS_BELOW: i32 = 3;

/// The first bound that is tried where none is asked for, relative to the diagonal.
const LOWEST_RUNG: f64 = 1e-4;

/// A surface that is simplified step by step: each level goes on from the one before it.
#[derive(Clone, Debug)]
pub struct Simplifier<'a> {
    original: &'a Mesh,
    surface: Surface,
    deviation: Deviation,
    quadrics: Vec<Quadric>,
    /// The best collapse of each point, cheapest first, and some that are no longer.
    queue: BinaryHeap<Proposal>,
    /// How often each point was asked: of its proposals in the queue, the last one is good.
    asked: Vec<u32>,
    /// The collapses that were made.
    made: Vec<Step>,
}

/// A collapse that was made, and what there was after it.
#[derive(Clone, Copy, Debug)]
struct Step {
    from: u32,
    to: u32,
    /// The largest bound up to here.
    bound: f64,
}

/// A collapse that a point proposes.
#[derive(Clone, Copy, Debug)]
struct Proposal {
    cost: f64,
    from: u32,
    to: u32,
    asked: u32,
}

/// What a simplification stops at.
#[derive(Clone, Copy, Debug)]
struct Goal {
    /// No collapse that takes the bound beyond it.
    bound: f64,
    /// No collapse when there are no more triangles than that.
    triangles: usize,
}

impl<'a> Simplifier<'a> {
    /// Nothing simplified yet.
    ///
    /// # Panics
    /// When an index is beyond the positions: what reads meshes from files refuses such a one.
    pub fn new(original: &'a Mesh) -> Simplifier<'a> {
        let surface = Surface::new(original);
        Simplifier {
            deviation: Deviation::new(&surface),
            quadrics: quadrics(&surface),
            queue: BinaryHeap::new(),
            asked: vec![0; surface.points()],
            made: Vec::new(),
            original,
            surface,
        }
    }

    /// The surface as it is now.
    pub fn surface(&self) -> &Surface {
        &self.surface
    }

    /// The surface as it is now, as a mesh.
    pub fn mesh(&self) -> Mesh {
        self.surface.mesh(self.original)
    }

    /// No point of the original or of the surface is farther than this from the other one, in the mesh's units. It is proved, see
    /// [`Deviation`].
    pub fn bound(&self) -> f64 {
        self.made.last().map_or(0.0, |step| step.bound)
    }

    /// Collapses all that can be within a bound, in the mesh's units. `progress` is told how many triangles are left, now and then.
    pub fn to_bound(&mut self, bound: f64, progress: &mut dyn FnMut(usize)) {
        // In steps: what costs little of the bound first, so that nothing is far off before its neighbours have moved at all.
        for rung in (0..=RUNGS_BELOW).rev() {
            let bound = bound / RUNG.powi(rung);
            if rung == 0 || bound > self.bound() {
                self.run(
                    Goal {
                        bound,
                        triangles: 0,
                    },
                    progress,
                );
            }
        }
    }

    /// Collapses until there are no more triangles than so many, or nothing can be collapsed.
    pub fn to_triangles(&mut self, triangles: usize, progress: &mut dyn FnMut(usize)) {
        for bound in self.ladder() {
            self.run(Goal { bound, triangles }, progress);
            if self.surface.triangle_count() <= triangles {
                break;
            }
        }
    }

    /// Collapses while the mean distance from the original, by Pan's equation 1, is no more than `mean`, in the mesh's units. The
    /// number of collapses is found by halving, to a hundredth of the triangles; `reference` is the original.
    pub fn to_mean(&mut self, mean: f64, reference: &Reference, progress: &mut dyn FnMut(usize)) {
        let is_within = |this: &Self| reference.to(&this.mesh()).mean() <= mean;
        for bound in self.ladder() {
            let before = self.clone();
            self.run(
                Goal {
                    bound,
                    triangles: 0,
                },
                progress,
            );
            if is_within(self) {
                continue;
            }
            let steps = self.made.split_off(before.made.len());
            let nearly = self.surface.triangle_count() / 200;
            *self = before;
            let (mut good, mut bad) = (0, steps.len());
            while bad - good > 1 + nearly {
                let half = good.midpoint(bad);
                let mut tried = self.clone();
                tried.again(&steps[good..half]);
                if is_within(&tried) {
                    *self = tried;
                    good = half;
                } else {
                    bad = half;
                }
            }
            return;
        }
    }

    /// Bounds one above the other, for what has none: from near nothing, or from the bound that is reached, to the size of the whole; at
    /// last none.
    fn ladder(&self) -> Vec<f64> {
        let size = distance::diagonal(self.original);
        let mut bounds: Vec<f64> = (0..)
            .map(|rung| size * LOWEST_RUNG * RUNG.powi(rung))
            .take_while(|bound| *bound < size)
            .collect();
        bounds.retain(|bound| *bound > self.bound());
        bounds.push(f64::INFINITY);
        bounds
    }

    /// Makes collapses that were made before, from where they were.
    fn again(&mut self, steps: &[Step]) {
        for &Step { from, to, .. } in steps {
            let Ok(collapse) = self.surface.collapse(from, to) else {
                // It was made from here: there is no such case.
                return;
            };
            let carried = self.deviation.after(&self.surface, &collapse);
            self.collapse(&collapse, &carried);
        }
    }

    fn run(&mut self, goal: Goal, progress: &mut dyn FnMut(usize)) {
        // What was refused under another goal may be proposed again.
        self.queue.clear();
        for point in 0..self.surface.points() as u32 {
            self.ask(point);
        }
        while self.surface.triangle_count() > goal.triangles {
            let Some(best) = self.queue.pop() else { break };
            if best.asked != self.asked[best.from as usize] {
                continue;
            }
            let Ok(collapse) = self.surface.collapse(best.from, best.to) else {
                // Its neighbours have changed since.
                self.ask(best.from);
                continue;
            };
            let carried = self.deviation.after(&self.surface, &collapse);
            if carried.largest > goal.bound {
                self.propose_within(best, goal.bound);
                continue;
            }
            self.make(&collapse, &carried);
            if self.made.len().is_multiple_of(4096) {
                progress(self.surface.triangle_count());
            }
        }
        progress(self.surface.triangle_count());
    }

    /// Makes a collapse, and asks all whose neighbours it has changed.
    fn make(&mut self, collapse: &Collapse, carried: &Carried) {
        self.collapse(collapse, carried);
        self.asked[collapse.from as usize] += 1;
        self.ask(collapse.to);
        for neighbour in self.surface.neighbours(collapse.to) {
            self.ask(neighbour);
        }
    }

    fn collapse(&mut self, collapse: &Collapse, carried: &Carried) {
        let bound = self.bound().max(carried.largest);
        self.surface.apply(collapse);
        self.deviation.apply(carried);
        let Collapse { from, to, .. } = *collapse;
        let gone = self.quadrics[from as usize];
        self.quadrics[to as usize].add(&gone);
        self.made.push(Step { from, to, bound });
    }

    /// Puts the cheapest collapse of a point that is allowed into the queue.
    fn ask(&mut self, point: u32) {
        self.asked[point as usize] += 1;
        let found = self
            .costs(point)
            .into_iter()
            .find(|(_, to)| self.surface.collapse(point, *to).is_ok());
        self.propose(point, found);
    }

    /// Puts the cheapest collapse of a point into the queue that is no cheaper than one that is beyond the bound, and within it.
    fn propose_within(&mut self, refused: Proposal, bound: f64) {
        let Proposal { cost, from, to, .. } = refused;
        self.asked[from as usize] += 1;
        let found = self
            .costs(from)
            .into_iter()
            .filter(|other| is_before(&(cost, to), other))
            .find(|(_, to)| {
                let collapse = self.surface.collapse(from, *to);
                collapse.is_ok_and(|collapse| {
                    self.deviation.after(&self.surface, &collapse).largest <= bound
                })
            });
        self.propose(from, found);
    }

    fn propose(&mut self, from: u32, found: Option<(f64, u32)>) {
        if let Some((cost, to)) = found {
            self.queue.push(Proposal {
                cost,
                from,
                to,
                asked: self.asked[from as usize],
            });
        }
    }

    /// What it costs to move a point to each of its neighbours, cheapest first.
    fn costs(&self, from: u32) -> Vec<(f64, u32)> {
        if self.surface.kind(from) == Kind::Fixed {
            return Vec::new();
        }
        let place = self.surface.position(from);
        let neighbours = self.surface.neighbours(from);
        let mut costs: Vec<(f64, u32)> = neighbours
            .into_iter()
            .map(|to| {
                let there = self.surface.position(to);
                let mut both = self.quadrics[from as usize];
                both.add(&self.quadrics[to as usize]);
                let length = place.distance_squared(there);
                (
                    both.at(there).max(0.0) + LENGTH_WEIGHT * length * length,
                    to,
                )
            })
            .collect();
        costs.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        costs
    }
}

/// Whether a cost is before another in the order of [`Simplifier::costs`].
fn is_before(a: &(f64, u32), b: &(f64, u32)) -> bool {
    a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)) == Ordering::Less
}

/// The quadric of each point: of the planes of its triangles by their area, and of planes upright on borders and seams.
fn quadrics(surface: &Surface) -> Vec<Quadric> {
    let mut quadrics = vec![Quadric::default(); surface.points()];
    for (t, _) in surface.triangles() {
        let corners = surface.corners(t);
        let [a, b, c] = corners.map(|p| surface.position(p));
        let normal = (b - a).cross(c - a);
        let area = 0.5 * normal.length();
        let plane = Quadric::plane(a, normal.normalize_or_zero(), area / 3.0);
        for corner in corners {
            quadrics[corner as usize].add(&plane);
        }
    }
    for (t, vertices) in surface.triangles() {
        let corners = surface.corners(t);
        let [a, b, c] = corners.map(|p| surface.position(p));
        let normal = (b - a).cross(c - a).normalize_or_zero();
        for i in 0..3 {
            let next = (i + 1) % 3;
            if !surface.is_open(t, vertices[i], vertices[next]) {
                continue;
            }
            let (start, end) = (
                surface.position(corners[i]),
                surface.position(corners[next]),
            );
            let way = end - start;
            let aside = way.cross(normal).normalize_or_zero();
            let plane = Quadric::plane(start, aside, EDGE_WEIGHT * way.length_squared());
            quadrics[corners[i] as usize].add(&plane);
            quadrics[corners[next] as usize].add(&plane);
        }
    }
    quadrics
}

impl Ord for Proposal {
    /// The cheapest is the greatest, for the queue.
    fn cmp(&self, other: &Self) -> Ordering {
        other
            .cost
            .total_cmp(&self.cost)
            .then(other.from.cmp(&self.from))
            .then(other.asked.cmp(&self.asked))
    }
}

impl PartialOrd for Proposal {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Proposal {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Proposal {}
