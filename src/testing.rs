//! For a project's own tests: holds what is committed against what its locks make.
//!
//! ```toml
//! [dev-dependencies]
//! lodc = { version = "0.1", default-features = false, features = ["testing"] }
//! ```
//!
//! ```no_run
//! #[test]
//! fn shaders_are_as_their_locks_make_them() {
//!     lodc::testing::assert_emitted("shaders/material.wgsl");
//! }
//! ```
//!
//! Nothing is searched and nothing is drawn. `LODC_BLESS=1 cargo test` writes what differs instead of failing, as
//! `lodc check --bless shaders/material.wgsl` does.

use crate::compile::{self, Check, Request};
use crate::{Result, emit};
use std::path::Path;

/// The variable that has differences written instead of failing: `LODC_BLESS=1`.
pub const BLESS: &str = "LODC_BLESS";

/// Panics unless the outputs of a shader are what its lock makes: text to the byte, and textures as the lock knows them, or, with
/// the feature `search`, texel by texel. The path is that of the shader, whose lock is beside it, or of a lock, `rock.lod.toml`;
/// from where tests run, which is the folder of the package for those that cargo runs.
///
/// With the environment variable [`LODC_BLESS`](BLESS) set, to anything but 0, what differs is written instead.
///
/// # Panics
/// With the diff and the command that accepts it; with the error when there is no lock, it is stale, or the shader cannot be
/// read; when the file cannot be written.
#[track_caller]
pub fn assert_emitted(path: impl AsRef<Path>) {
    let path = path.as_ref();
    let shown = path.display();
    let check = match checked(path) {
        Ok(check) => check,
        Err(error) => panic!("{shown} cannot be checked\n{error}"),
    };
    let is_asked = std::env::var_os(BLESS).is_some_and(|value| !value.is_empty() && value != "0");
    if is_asked && let Err(error) = emit::write_atomically(&check.blessed()) {
        panic!("{shown} cannot be blessed\n{error}");
    }
    let left = check.differences.iter();
    let left: Vec<&str> = left
        .filter(|difference| !is_asked || difference.bytes.is_none())
        .map(|difference| difference.what.as_str())
        .collect();
    if !left.is_empty() {
        panic!(
            "what is committed for {shown} is not what its lock makes\n{}\nto accept it: lodc check --bless {shown}, or {BLESS}=1",
            left.concat()
        );
    }
}

fn checked(path: &Path) -> Result<Check> {
    let request = match Request::is_lock(path) {
        true => Request::of_lock(path)?,
        false => Request {
            shader: path.to_owned(),
            ..Request::default()
        },
    };
    compile::check(&request)
}
