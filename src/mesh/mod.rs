//! The mesh stage: meshes with fewer triangles, whose error is measured in the picture, under the shader that they are drawn
//! with.
//!
//! ```text
//! Subject x distance --pictures--> Pictures     of the original from all sides, and of the mesh as it is
//!   --reaction--> weights of triangles          how much the picture reacts to each
//! Surface x weights --image_driven--> Sequence  every mesh on the way down, with its error
//! Sequence --selection--> meshes that are worth keeping
//! distances x bounds --levels--> a mesh for each, confirmed by pictures that had no part in it
//! ```
//!
//! The geometry is [`lodc_mesh`]'s. It does not know the search.
//!
//! This work is based on: Liang 2022, sections 4.2 and 5.1; Lindstrom and Turk, "Image-driven simplification", 2000.

#[cfg(feature = "meshopt")]
pub mod baseline;
mod image_driven;
mod levels;
mod pictures;
mod reaction;
mod selection;
mod view;

pub use image_driven::{EdgeRule, Settings, Simplifier, Until, Watch};
pub use levels::{LevelMesh, Levels, Maker, Other, Wanted};
pub use pictures::{Pictures, Triangles};
pub use selection::{Sequence, Step};

use crate::eval::program::Program;
use crate::scene::Scene;

/// What is drawn: the stages of a shader, on the mesh of a scene.
#[derive(Clone, Copy)]
pub struct Subject<'a> {
    /// The vertex stage.
    pub vertex: &'a Program,
    /// The fragment stage.
    pub fragment: &'a Program,
    /// The scene, with the original mesh.
    pub scene: &'a Scene,
}
