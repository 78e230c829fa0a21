//! The GPU renderer: draws the same scenes as the evaluator, with wgpu.
//!
//! ```text
//! adapter name --adapter--> Gpu
//! Module x Module --entry, render--> Pipeline       compiled once for a shader
//! Pipeline x Frame --resources, render--> Drawn     colour and coverage, in textures on the device
//! Drawn --read--> Picture                           as the evaluator gives it
//! Drawn x Drawn --error--> [TileSum]                what differs, added up on the device
//! Module x Asked --fed--> what is not finite       on single inputs, past any mesh
//! Timed x [Timed] --time--> [Timing]                how long they take beside the original
//! ```
//!
//! It is the only folder that names wgpu, and it does not know the search. What goes wrong on a device is a
//! [`Diagnostic`](crate::Diagnostic); a driver that hangs or crashes takes the process with it, which is why
//! `worker` runs all of this in a child.

mod adapter;
mod blend;
mod compute;
mod depth;
mod entry;
pub mod error;
mod fed;
mod lavapipe;
mod opengl;
mod parameters;
mod pass;
mod read;
mod render;
mod resources;
pub mod time;
mod vertices;
pub mod worker;

pub use adapter::{AdapterLabel, Gpu, list};
pub use fed::Feeder;
pub use parameters::parameters;
pub use render::{Drawn, Pipeline, Renderer, Stages};
