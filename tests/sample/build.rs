//! Makes the materials from their locks, and says how long that took when `SAMPLE_TIMES` is set.

use lodc::emit::{Form, Target};
use lodc::{Compiler, Stale};
use std::time::Instant;

fn main() -> lodc::Result<()> {
    let start = Instant::now();
    Compiler::new("shaders/wall.wgsl").bytemuck(true).build()?;
    let wall = start.elapsed();
    Compiler::new("shaders/board.wgsl").bytemuck(true).build()?;
    let board = start.elapsed() - wall;
    forms()?;
    println!("cargo::rerun-if-env-changed=SAMPLE_TIMES");
    if std::env::var_os("SAMPLE_TIMES").is_some() {
        println!("cargo::warning=wall.wgsl took {wall:?}, board.wgsl {board:?}");
    }
    Ok(())
}

/// The same materials in other forms, each in a folder of its own.
fn forms() -> lodc::Result<()> {
    Compiler::new("shaders/board.wgsl")
        .form(Form::Files)
        .output("files")
        .build()?;
    Compiler::new("shaders/wall.wgsl")
        .form(Form::Uniform)
        .target(Target::Spirv)
        .output("spirv")
        .build()?;
    // There is no such lock, which is worth a warning.
    let built = Compiler::new("shaders/wall.wgsl")
        .lock("shaders/missing.lod.toml")
        .stale(Stale::Original)
        .output("original")
        .build()?;
    assert!(built.is_original);
    Ok(())
}
