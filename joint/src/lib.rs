//! The choice of lodc, the level-of-detail compiler for shaders: which pairs of a mesh and a shader are worth having, and from
//! which distances on.
//!
//! ```text
//! meshes x shaders --walk--> Walk             the boundary of what is within the bound, at one distance
//!                  --exhaustive--> Walk       everything that is, beside it
//! pairs x times --near_fastest--> candidates  which of them are about as fast as the fastest
//! candidates x distances --smoothest--> path  whose transitions are seen least
//! path --merge--> levels                      without those that gain little
//! pairs x bins --Choice--> plan               thresholds and pairs at once
//! ```
//!
//! Values in, values out: errors and times are numbers, of whatever was measured and however. It knows nothing of shaders, meshes and
//! files. Meshes and shaders are numbers too: 0 is the original, and each is simpler than the one before.
//!
//! This work is based on: Liang 2022, sections 5.3 and 6.

mod choice;
mod merge;
mod near;
mod path;
#[cfg(test)]
mod random;
mod walk;

pub use choice::{Choice, Prices, Score};
pub use merge::{MERGE_BELOW, merge};
pub use near::{NEAR, near_fastest};
pub use path::smoothest;
pub use walk::{Monotonicity, Pair, Visit, Walk, exhaustive, walk};
