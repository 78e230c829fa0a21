//! The search: which recipe is worth having at which distance.
//!
//! ```text
//! Scene x original --samples--> SampleSet      what errors are measured over, at one distance
//! SampleSet x Shader --error--> E^2, work      one variant (see [`crate::error`])
//! base x SampleSet --exact--> start            what costs no error, which no later step is credited with
//! start x SampleSet --greedy, best--> variants --frontier--> non-dominated ones
//! frontiers x distances --levels--> levels     confirmed on the full set
//!   what it refuses --guard--> what greedy has to heed
//! ```
//!
//! It knows nothing of the command line or of reports.

mod best;
mod confirm;
mod descend;
#[cfg(feature = "gpu")]
pub mod drawn;
mod exact;
mod facts;
mod frame;
pub mod frontier;
mod greedy;
mod guard;
mod interval;
mod kept;
pub mod levels;
mod parameters;
pub mod samples;
#[cfg(test)]
mod tests;
mod textures;
mod timed;
mod trajectory;

pub(crate) use exact::work_of;
pub use exact::{Exact, Scope};
pub(crate) use facts::{coordinates_per_pixel, texels_per_pixel};
pub use frontier::{Frontier, Seen};
#[cfg(feature = "mesh")]
pub(crate) use greedy::changes;
pub use greedy::try_each;
pub use kept::Kept;
pub(crate) use kept::is_within;
#[cfg(feature = "mesh")]
pub(crate) use levels::examine;
pub(crate) use levels::threshold;
pub use levels::{AtDistance, Found, Level, Progress, Struck, find, find_from};
pub use samples::{Measured, OverBlack, SampleSet, Samples};
pub use trajectory::{Step, trajectory};
