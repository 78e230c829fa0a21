//! A pass of one's own takes part in the search: its changes are in the lock, and whoever replays that needs the pass.
//!
//! ```sh
//! cargo run --release --example custom_pass -- testdata/materials/gltf_pbr.wgsl
//! ```
//!
//! It writes to `target/custom_pass/`. The pass is in `whole_power.rs`.

mod whole_power;

use lodc::compile::{self, Request};
use lodc::emit::write_atomically;
use lodc_passes::Passes;
use std::path::Path;
use whole_power::WholePower;

fn main() {
    let shader = std::env::args().nth(1);
    let shader = shader.unwrap_or_else(|| "testdata/materials/gltf_pbr.wgsl".into());
    if let Err(error) = run(Path::new(&shader)) {
        eprintln!("{error}");
        std::process::exit(1);
    }
}

fn run(shader: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let name = shader.file_stem().unwrap_or_default();
    let output = Path::new("target/custom_pass")
        .join(name)
        .with_extension("lod.wgsl");
    let own = Passes::default()
        .with(&WholePower)
        .map_err(|taken| taken.to_string())?;
    let request = Request {
        shader: shader.to_owned(),
        output: Some(output),
        passes: own,
        ..Request::default()
    };

    // The search lists the changes of all passes of the request, and takes what is cheapest for what it saves.
    let compiled = compile::compile(&request, &|_| {})?;
    for level in &compiled.report.levels {
        let steps = level
            .recipe
            .iter()
            .filter(|step| step.pass == "whole-power");
        for step in steps {
            println!(
                "level from autoLOD {:.2}: {} {}",
                level.autolod, step.choice, step.site
            );
        }
    }
    write_atomically(&compiled.files)?;

    // The lock names the pass, so it is replayed where the pass is.
    let (files, _) = compile::locked(&request)?;
    let same = files.iter().all(|file| compiled.files.contains(file));
    println!(
        "replayed with the pass: {}",
        if same {
            "the same bytes"
        } else {
            "other bytes"
        }
    );
    let without = Request {
        passes: Passes::default(),
        ..request
    };
    match compile::locked(&without) {
        Ok(_) => println!("no level has a change of whole-power: it replays without the pass, too"),
        Err(error) => println!("replayed without it:\n{error}"),
    }
    Ok(())
}
