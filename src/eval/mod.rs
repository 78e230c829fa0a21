//! The evaluator: runs a shader on the CPU, with the same bits on every machine.
//!
//! ```text
//! Module --program--> Program        compiled once for a shader
//! mesh x Program --raster--> Coverage    quads of fragments with their inputs, once for a view
//! Coverage x Program --draw--> Picture   colours, executed work, facts
//! ```
//!
//! It does not know the search: values in, values out.

pub mod draw;
pub mod generated;
pub mod image;
pub mod parameters;
pub mod programs;
pub mod raster;
mod refused;

pub use lodc_machine::{lane, machine, mix, program, rough, shadow, texture};
pub use refused::refusal;
