//! The passes of lodc, the level-of-detail compiler for shaders.
//!
//! A [`Shader`] is a valid naga module in normal form. A [`Pass`] lists [`Candidate`]s,
//! simplifications that could be made, and makes one. A [`Recipe`] is a list of candidates, and
//! replays to the same module always. Every pass moves a value to a cheaper rate, or removes it.
//! This crate reads no files, starts no threads and knows no GPU.

pub mod autolod;
pub mod basis;
mod constants;
pub mod cost;
pub mod edit;
pub mod facts;
mod fingerprint;
mod flow;
mod fold;
pub mod generated;
pub mod goal;
pub mod gradients;
mod interface;
pub mod least_squares;
mod live;
mod lockstep;
pub mod normalize;
pub mod op_removal;
pub mod operands;
pub mod parameters;
pub mod passes;
mod places;
pub mod rate;
pub mod recipe;
pub mod semantics;
pub mod shader;
mod slice;
pub mod specialize;
pub mod texture_collapse;
pub mod texture_removal;
pub mod to_parameter;
pub mod vertex_motion;

pub use cost::Work;
pub use edit::{Edit, New};
pub use facts::Facts;
pub use generated::Generated;
pub use goal::{Goal, Used};
pub use normalize::{NormalizeError, normalize, normalize_stages};
pub use passes::Passes;
pub use rate::{Rate, Rates};
pub use recipe::{Candidate, Class, Considered, Declined, Pass, Recipe, ReplayError, Surviving};
pub use shader::{Fingerprint, Shader, Stage, ValueId};

/// Every pass of lodc's own that asks nothing of the host, in the order in which candidates are listed. [`Passes`] adds those of a program.
///
/// What costs no error goes first; then whole textures, because they are worth the most; then single operations.
pub static PASSES: &[&dyn Pass] = &[
    &specialize::Specialize,
    &texture_removal::TextureRemoval,
    &op_removal::OpRemoval,
    &vertex_motion::VertexMotion,
];

/// Passes whose levels ask the host to fill a block of parameters: they are searched where it does.
pub static WITH_PARAMETERS: &[&dyn Pass] = &[&to_parameter::ToParameter];

/// Passes whose levels ask the host to bind textures that were made for them: they are searched where it does.
pub static WITH_TEXTURES: &[&dyn Pass] = &[&texture_collapse::TextureCollapse];

/// Every pass of lodc's own.
pub fn all_passes() -> impl Iterator<Item = &'static dyn Pass> {
    let asking = WITH_TEXTURES.iter().chain(WITH_PARAMETERS);
    PASSES.iter().chain(asking).copied()
}
