//! Makes the materials from their locks, and says how long that took when `SAMPLE_TIMES` is set.

use std::time::Instant;

fn main() -> lodc::Result<()> {
    let start = Instant::now();
    lodc::Compiler::new("shaders/wall.wgsl").build()?;
    let wall = start.elapsed();
    lodc::Compiler::new("shaders/board.wgsl")
        .bytemuck(true)
        .build()?;
    println!("cargo::rerun-if-env-changed=SAMPLE_TIMES");
    if std::env::var_os("SAMPLE_TIMES").is_some() {
        let board = start.elapsed() - wall;
        println!("cargo::warning=wall.wgsl took {wall:?}, board.wgsl {board:?}");
    }
    Ok(())
}
