//! The manual's table of verdicts: how materials, and the levels that a search finds for them, stand on inputs that no
//! picture shows.
//!
//! `cargo run --release --all-features --example verdicts -- [--edge PIXELS] [--bevy PREFIX] SHADER...` searches the levels
//! of each shader in the scene beside it, with pictures of so many pixels along an edge where that is said, and asks the
//! whole battery of the original and of every level. `PREFIX` is what the folders of Bevy's crates begin with, as in the
//! manual. Below the table is where each original fails.

use lodc::compile::normal_form;
use lodc::eval::program::{Program, Refused};
use lodc::eval::programs::Stand;
use lodc::front::{Modules, Source, Stages};
use lodc::scene::{Reading, Scene};
use lodc::search::{Kept, Scope, find};
use lodc::stability::{Battery, Verdict};
use lodc_passes::{Recipe, Stage};
use std::collections::{BTreeMap, BTreeSet};
use std::error::Error;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// The crates of Bevy that its material imports modules of, and their version.
const CRATES: [&str; 5] = ["pbr", "render", "core_pipeline", "post_process", "light"];
const VERSION: &str = "0.19.0";

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let mut edge = None;
    let mut shaders = Vec::new();
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or("a value is missing");
        match &*argument {
            "--edge" => edge = Some(value()?.parse::<u32>()?),
            "--bevy" => {
                let prefix = value()?;
                match bevy(&prefix) {
                    Ok(read) => shaders.push(("Bevy's `pbr.wgsl`".to_owned(), read)),
                    Err(why) => eprintln!("SKIPPED: no sources of Bevy at `{prefix}`: {why}"),
                }
            }
            _ => {
                let source = Source::read(Path::new(&argument)).map_err(|e| e.to_string())?;
                let scene = Scene::read(&source, None).map_err(|e| e.to_string())?;
                let name = Path::new(&argument).file_name().unwrap_or_default();
                shaders.push((format!("`{}`", name.display()), (source, scene)));
            }
        }
    }
    println!("| material | inputs | original | levels | variants struck off | seconds |");
    println!("|---|---|---|---|---|---|");
    let mut below = String::new();
    for (name, (source, mut scene)) in shaders {
        if let Some(edge) = edge {
            scene.resolution = [edge, edge];
        }
        let (row, more) = verdicts(&source, &scene)?;
        println!("| {name} {row}");
        for line in more {
            below.push_str(&format!("{name}: {line}\n"));
        }
    }
    print!("\n{below}");
    Ok(())
}

/// A row of the table without its first column, and what is wrong.
fn verdicts(source: &Source, scene: &Scene) -> Result<(String, Vec<String>), Box<dyn Error>> {
    let base = normal_form(source).map_err(|e| e.to_string())?;
    let entry = base.index(Stage::Vertex).unwrap_or(0);
    let vertex = match &scene.vertex_stage {
        Some(stage) => Program::compile(&stage.module, 0, &[]),
        None => Program::compile(base.module(), entry, &[]),
    };
    let vertex = vertex.map_err(said)?;
    let stand = Stand {
        base: &base,
        vertex: &vertex,
        scene,
    };
    let wanted = (Scope::None, &Kept::default());
    let found = find(&stand, wanted, None, &|_| {}).map_err(said)?;
    let begun = Instant::now();
    let battery = Battery::new(&stand).map_err(said)?;
    let original = battery.original_alone();
    let lint = battery.lint();
    let mut more = Vec::new();
    let mut places = BTreeMap::<&str, BTreeSet<u32>>::new();
    for (blamed, _) in &lint {
        let (operation, _) = blamed.wants;
        let line = source.place(blamed.span).map(|place| place.line());
        places.entry(operation).or_default().extend(line);
        let word = blamed.reach.name();
        more.push(format!("{} ({word})", blamed.says(&base, source)));
    }
    let places = places.iter().map(|(operation, lines)| {
        let lines: Vec<String> = lines.iter().map(u32::to_string).collect();
        format!("{operation}, line {}", lines.join(", "))
    });
    let places: Vec<String> = places.collect();
    let mut verdicts = Vec::new();
    let mut inputs = original.inputs;
    for (_, level) in found.written() {
        let judged = battery.judge_and_hunt(&level.shader).map_err(said)?;
        inputs = inputs.max(judged.inputs);
        let steps = found.exact.recipe.0.iter().chain(&level.recipe.0);
        let recipe = Recipe(steps.cloned().collect());
        if let Some(failure) = judged.failures.first() {
            let says = battery.blame((&base, &recipe), failure).says(&base, source);
            more.push(format!("the level from autoLOD {}: {says}", level.autolod));
        }
        verdicts.push(judged.verdict);
    }
    let seconds = begun.elapsed().as_secs_f64();
    let unstable = verdicts.iter().filter(|v| **v == Verdict::Unstable).count();
    let levels = match unstable {
        0 => format!("all {} add nothing", verdicts.len()),
        some => format!("{some} of {} unstable", verdicts.len()),
    };
    let own = match original.of_original {
        0 => "stable".to_owned(),
        some => format!("unstable on {some}: {}", places.join("; ")),
    };
    let struck: usize = found.distances.iter().map(|at| at.struck.len()).sum();
    let row = format!("| {inputs} | {own} | {levels} | {struck} | {seconds:.1} |");
    Ok((row, more))
}

/// Bevy's standard material in its committed scene.
fn bevy(prefix: &str) -> Result<(Source, Scene), String> {
    let folders = CRATES.map(|name| PathBuf::from(format!("{prefix}{name}-{VERSION}")));
    let shader = folders[0].join("src/render/pbr.wgsl");
    if !shader.is_file() {
        return Err(format!("there is no `{}`", shader.display()));
    }
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata/scenes/bevy_pbr.toml");
    let reading = Reading::read(&scene).map_err(|e| e.to_string())?;
    let stages = Stages {
        vertex_file: Some(folders[0].join("src/render/mesh.wgsl")),
        ..Stages::default()
    };
    let modules = Modules {
        folders: folders.to_vec(),
        definitions: reading.modules.definitions,
    };
    let source = Source::read_with(&shader, &stages, &modules).map_err(|e| e.to_string())?;
    let scene = Scene::read(&source, Some(&scene)).map_err(|e| e.to_string())?;
    Ok((source, scene))
}

fn said(refused: Refused) -> String {
    refused.what.to_string()
}
