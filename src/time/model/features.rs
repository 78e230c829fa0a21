//! What one draw of an object executes and touches: what a time is predicted from.

use crate::eval::mix::{Class, Mix};
use serde::{Deserialize, Serialize};

/// What one invocation of each stage of a variant executes, on the mean over the scene's frames at a distance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Invocation {
    /// Of a fragment.
    pub fragment: Mix,
    /// Of a vertex.
    pub vertex: Mix,
    /// Components of a fragment's inputs that are interpolated.
    pub interpolated: f64,
    /// Components that are the same for a whole triangle.
    pub flat: f64,
}

/// How much of the scene a draw of the object is at a distance, whatever the variant: the mean over the scene's frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Extent {
    /// Fragments that pass the depth test when their turn comes.
    pub fragments: f64,
    /// Those with their helper lanes: four for each square of 2 x 2 pixels and triangle.
    pub lanes: f64,
    /// Sixteen for each square of 4 x 4 pixels and triangle that a fragment is in.
    pub stamp_lanes: f64,
    /// Triangles that are on the screen.
    pub drawn_triangles: f64,
    /// Triangles of the mesh.
    pub triangles: f64,
    /// Vertices of the mesh.
    pub vertices: f64,
    /// Bytes that a vertex's inputs take.
    pub vertex_bytes: f64,
    /// Bytes that a fragment writes to targets.
    pub target_bytes: f64,
}

/// What one draw of the object executes and touches in all, the mean over the scene's frames at a distance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Features {
    /// Of one invocation.
    pub invocation: Invocation,
    /// How many there are.
    pub extent: Extent,
}

/// How many numbers [`Features`] are.
pub(super) const COUNT: usize = Class::ALL.len() + 12;

impl Features {
    /// The names of [`Features::row`]'s numbers.
    pub fn names() -> [&'static str; COUNT] {
        let further = [
            "vertex operations",
            "vertex samples",
            "interpolated",
            "flat",
            "fragments",
            "lanes",
            "stamp lanes",
            "drawn triangles",
            "triangles",
            "vertices",
            "vertex bytes",
            "target bytes",
        ];
        let mut names = [""; COUNT];
        let all = Class::ALL.map(Class::name).into_iter().chain(further);
        for (name, known) in names.iter_mut().zip(all) {
            *name = known;
        }
        names
    }

    /// All of them as numbers: the classes of a fragment; the operations and samples of a vertex; components of inputs
    /// that are interpolated, and that are flat; and the [`Extent`], field by field.
    pub fn row(&self) -> [f64; COUNT] {
        let Invocation {
            fragment,
            vertex,
            interpolated,
            flat,
        } = &self.invocation;
        let extent = &self.extent;
        let further = [
            vertex.operations(),
            vertex[Class::Sample],
            *interpolated,
            *flat,
            extent.fragments,
            extent.lanes,
            extent.stamp_lanes,
            extent.drawn_triangles,
            extent.triangles,
            extent.vertices,
            extent.vertex_bytes,
            extent.target_bytes,
        ];
        let classes = Class::ALL.map(|class| fragment[class]);
        let mut row = [0.0; COUNT];
        for (number, known) in row.iter_mut().zip(classes.into_iter().chain(further)) {
            *number = known;
        }
        row
    }

    /// The same from the numbers. Of a vertex's operations it is not known which class they are of: they are all taken
    /// as full-rate ones on floats.
    pub fn of_row(row: &[f64; COUNT]) -> Self {
        let mut fragment = Mix::default();
        for (class, count) in Class::ALL.into_iter().zip(row) {
            fragment[class] = *count;
        }
        let at = |place: usize| row[Class::ALL.len() + place];
        let mut vertex = Mix::default();
        vertex[Class::Float] = at(0);
        vertex[Class::Sample] = at(1);
        Self {
            invocation: Invocation {
                fragment,
                vertex,
                interpolated: at(2),
                flat: at(3),
            },
            extent: Extent {
                fragments: at(4),
                lanes: at(5),
                stamp_lanes: at(6),
                drawn_triangles: at(7),
                triangles: at(8),
                vertices: at(9),
                vertex_bytes: at(10),
                target_bytes: at(11),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_is_read_as_it_was_written() {
        let row: [f64; COUNT] = std::array::from_fn(|i| 1.0 + i as f64);
        assert_eq!(Features::of_row(&row).row(), row);
        let names = Features::names();
        assert!(names.iter().all(|name| !name.is_empty()));
        assert_eq!(names[COUNT - 1], "target bytes");
    }
}
