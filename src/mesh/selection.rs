//! What a simplification went through, edge by edge, and which of its meshes are worth keeping.
//!
//! This work is based on: Liang 2022, section 5.1.

use crate::scene::mesh::Mesh;
use lodc_mesh::{Collapse, Surface};

/// One edge that went.
#[derive(Clone, Debug)]
pub struct Step {
    /// What went where.
    pub collapse: Collapse,
    /// The mean squared error of the pictures after it, against the reference.
    pub square: f64,
    /// How many triangles are left.
    pub triangles: usize,
}

/// A simplification at one distance: every mesh on the way, each an edge poorer than the one before.
#[derive(Clone, Debug)]
pub struct Sequence {
    /// From the eye to the object's centre, world units.
    pub distance: f64,
    /// The mean squared error of the original's pictures: it aliases.
    pub floor: f64,
    /// The mesh that it began with.
    pub(super) start: Surface,
    /// How many triangles that has.
    pub triangles: usize,
    /// Its mean squared error.
    pub square: f64,
    /// The edges, in their order.
    pub steps: Vec<Step>,
}

impl Sequence {
    /// The mesh after so many steps, with the attributes of the original.
    pub fn mesh(&self, steps: usize, original: &Mesh) -> Mesh {
        self.surface(steps).mesh(original)
    }

    /// The surface after so many steps.
    pub fn surface(&self, steps: usize) -> Surface {
        let mut surface = self.start.clone();
        for step in self.steps.iter().take(steps) {
            surface.apply(&step.collapse);
        }
        surface
    }

    /// What a mesh after so many steps adds to the original's own error, as far as the pictures say that it was simplified by.
    pub fn excess(&self, steps: usize) -> f64 {
        let square = match steps.checked_sub(1).and_then(|at| self.steps.get(at)) {
            Some(step) => step.square,
            None => self.square,
        };
        (square - self.floor).max(0.0).sqrt()
    }

    /// After how many steps its meshes are worth keeping: at most `most` of them, in order, where the error changes most, the
    /// last one always among them. The change from one to the next is about the same.
    pub fn worth_keeping(&self, most: usize) -> Vec<usize> {
        let mut before = self.square;
        let mut changes = self.steps.iter().map(|step| {
            let change = (step.square - before).abs();
            before = step.square;
            change
        });
        let changes: Vec<f64> = changes.by_ref().collect();
        let total: f64 = changes.iter().sum();
        let share = total / most.max(1) as f64;
        let mut kept = Vec::new();
        let mut sum = 0.0;
        for (at, change) in (1..).zip(changes) {
            sum += change;
            let is_last = at == self.steps.len();
            if is_last || (share > 0.0 && sum >= share * (kept.len() + 1) as f64) {
                kept.push(at);
            }
        }
        // Of what is too many by rounding the last but one goes.
        if kept.len() > most && kept.len() >= 2 {
            kept.remove(kept.len() - 2);
        }
        kept.truncate(most);
        kept
    }
}
