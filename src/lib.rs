//! lodc, the level-of-detail compiler for shaders.
//!
//! It reads a material shader and writes a drop-in replacement that contains cheaper versions of it,
//! chosen by one `autoLOD` value, each with its measured error.

pub mod build;
pub mod compile;
pub mod diagnostic;
pub mod emit;
pub mod front;

pub use build::{Built, Compiler, Stale};
pub use diagnostic::{Diagnostic, Result};

#[cfg(test)]
#[path = "../tests/fixtures/mod.rs"]
mod fixtures;

#[cfg(feature = "cli")]
pub mod cli;
#[cfg(feature = "search")]
pub mod error;
#[cfg(feature = "search")]
pub mod eval;
#[cfg(feature = "gpu")]
pub mod gpu;
#[cfg(feature = "mesh")]
pub mod joint;
#[cfg(feature = "mesh")]
pub mod mesh;
#[cfg(feature = "search")]
pub mod report;
#[cfg(feature = "search")]
pub mod scene;
#[cfg(feature = "search")]
pub mod search;
#[cfg(feature = "search")]
pub mod stability;
#[cfg(feature = "testing")]
pub mod testing;
#[cfg(feature = "search")]
pub mod time;
