//! lodc, the level-of-detail compiler for shaders.
//!
//! It reads a material shader and writes a drop-in replacement that contains cheaper versions of it,
//! chosen by one `autoLOD` value, each with its measured error.

pub mod diagnostic;
pub mod emit;
pub mod front;

pub use diagnostic::{Diagnostic, Result};

#[cfg(feature = "search")]
pub mod eval;
#[cfg(feature = "search")]
pub mod scene;
