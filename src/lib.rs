//! lodc, the level-of-detail compiler for shaders.
//!
//! It reads a material shader and writes a drop-in replacement that contains cheaper versions of it,
//! chosen by one `autoLOD` value, each with its measured error.
//!
//! # In a program
//!
//! With the feature `search`. [`compile::compile`](compile) reads a shader and the scene beside it, looks for levels, and gives the files
//! to write: the shader, its lock, its report. The lock decides the shader: [`compile::locked`] makes the same text from it, without a
//! search. A host draws the level that the size on screen asks for.
//!
//! ```
//! # #[cfg(not(feature = "search"))]
//! # fn main() {}
//! # #[cfg(feature = "search")]
//! # fn main() -> lodc::Result<()> {
//! use lodc::compile::{self, Request};
//! use lodc::emit::write_atomically;
//! use lodc_passes::autolod::{self, HYSTERESIS, View};
//!
//! let folder = std::env::temp_dir().join(format!("lodc-{}", std::process::id()));
//! let shader = folder.join("ball.wgsl");
//! let text = "
//!     @fragment fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
//!         var rings = 0.0;
//!         for (var i = 1; i < 9; i++) { rings += sin(uv.x * 40.0 * f32(i)) / f32(i * i); }
//!         return vec4f(0.4 + 0.1 * rings, 0.5, uv.y, 1.0);
//!     }";
//! // What errors are measured over: here a ball in small pictures, from 2 to 40 units.
//! let scene = "resolution = [32, 32]\nlevels = 3\noffsets = 1\n\
//!              [distance]\nnearest = 2.0\nfarthest = 40.0\n";
//! write_atomically(&[
//!     (shader.clone(), text.into()),
//!     (folder.join("ball.toml"), scene.into()),
//! ])?;
//!
//! // 1. Search. Nothing is written but by you.
//! let request = Request {
//!     shader,
//!     ..Request::default()
//! };
//! let compiled = compile::compile(&request, &|_| {})?;
//! write_atomically(&compiled.files)?;
//! let report = &compiled.report;
//! for level in &report.levels {
//!     println!("from {:5.2} units: {}", level.distance, level.says);
//! }
//! assert!(report.levels.len() > 1);
//!
//! // 2. The lock makes the same files again, in milliseconds.
//! let (again, _warnings) = compile::locked(&request)?;
//! assert!(again.iter().all(|file| compiled.files.contains(file)));
//!
//! // 3. Draw: which level, and the value for the pipeline constant `autoLOD`.
//! let thresholds: Vec<f64> = report.levels[1..].iter().map(|level| level.autolod).collect();
//! let view = View {
//!     s_max: 1.0,
//!     distance: 25.0,
//!     radius: 1.0,
//!     z_near: 0.1,
//!     height: 1080.0,
//!     fov: 45.0,
//! };
//! let auto_lod = autolod::auto_lod(report.rho0, autolod::rho(&view));
//! let drawn_before = Some(0);
//! let level = autolod::level(&thresholds, auto_lod, drawn_before, HYSTERESIS);
//! println!("level {level}: autoLOD = {}", autolod::middle(&thresholds, level));
//! # let _ = std::fs::remove_dir_all(folder);
//! # Ok(())
//! # }
//! ```
//!
//! # In a build script
//!
//! Without default features lodc parses, replays a lock and emits. [`Compiler`] does that in `build.rs`, tells cargo which files matter,
//! and writes a Rust module with thresholds, bindings and the arithmetic above. [`testing`](compile::check) holds what is committed
//! against its lock.
//!
//! # Where things are
//!
//! The stages, in the order in which data flows. Each is a function from values to values; nothing is global.
//!
//! | | |
//! |---|---|
//! | [`front`] | a file to a module with its names and places |
//! | [`compile::normal_form`] | a module to a [`lodc_passes::Shader`] in normal form |
//! | `scene` | views, distances, lights, uniforms, textures, mesh: what errors are measured over |
//! | `eval`, `gpu` | pictures: on the CPU, the same everywhere; and on a device |
//! | `error` | how far two pictures are apart, as a display shows them |
//! | `search` | candidates of [passes](lodc_passes::Passes), a program's own among them, to levels |
//! | `mesh`, `joint` | simpler meshes, and which goes with which shader |
//! | `stability` | inputs on which a level fails and the original does not |
//! | `time` | how long draws take: measured, recorded, predicted |
//! | [`emit`] | levels to a shader and its lock |
//! | `report` | all of it, as data and for people |
//!
//! What fails is a [`Diagnostic`]: the file, the place in the user's source, and the way out.

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
