//! The machine of lodc: runs a shader on the CPU, block by block of lanes, with the same bits on every machine.
//!
//! ```text
//! Module --program--> Program                     compiled once for a shader
//! Program x inputs x Bindings --machine--> outputs, executed work, what was probed
//! ```
//!
//! It knows nothing of scenes, files and pictures. It is a crate of its own because it is most of what there is to
//! optimise, so that tests of everything else neither wait for its compilation nor run it unoptimised.

pub mod chance;
pub mod lane;
pub mod machine;
pub mod mix;
pub mod program;
pub mod rough;
pub mod shadow;
pub mod texture;
