//! The geometry of lodc, the level-of-detail compiler for shaders: triangle meshes, and what can be said of them without
//! drawing them.
//!
//! ```text
//! bytes --read--> Mesh           of OBJ and PLY files
//! Mesh --surface--> Surface      its points, edges and seams; loses one edge after another, and is a Mesh again
//! Surface --simplify--> Surface  by its geometry alone, under a bound that is proved
//! Mesh --subdivide--> Mesh       with four triangles for each
//! Mesh x Mesh --distance--> how far they are apart
//! [Level] --write--> a GLB of all levels, and a table of their distances
//! ```
//!
//! It knows nothing of shaders, scenes and pictures: how a mesh looks under a shader is `lodc`'s to find out. It is a crate
//! of its own because it is most of what there is to optimise beside the machine, so that tests neither wait for its
//! compilation nor run it unoptimised.

mod appearance;
pub mod distance;
mod mesh;
mod normals;
mod quadric;
pub mod read;
#[cfg(test)]
mod shapes;
pub mod simplify;
mod subdivide;
mod surface;
mod tree;
pub mod write;

pub use appearance::{CHANNELS, Samples, Weights, channels};
pub use mesh::{Draw, Mesh};
pub use subdivide::subdivide;
pub use surface::{Collapse, FLATTEST, Kind, LARGEST_TURN, Refusal, Surface};
pub use tree::{Nearest, Tree, nearest_in_triangle};
