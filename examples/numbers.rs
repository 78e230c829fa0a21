//! What the best numbers are worth: the levels of a lock with their own numbers, and with the plain ones at the same
//! steps, which are means over the samples, and lines by least squares.
//!
//! `cargo run --release --example numbers -- testdata/materials/pbr.wgsl target/pbr.lod.toml` prints the excess of both,
//! over all samples of the material's scene, for each level.

use lodc::compile::normal_form;
use lodc::emit::Lock;
use lodc::eval::program::{Program, Refused};
use lodc::eval::programs::Stand;
use lodc::front::Source;
use lodc::scene::Scene;
use lodc::search::{SampleSet, Samples};
use lodc_passes::{Candidate, Shader, Stage, recipe};
use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [shader, lock] = arguments.as_slice() else {
        return Err("usage: numbers SHADER LOCK".into());
    };
    let source = Source::read(Path::new(shader)).map_err(|e| e.to_string())?;
    let scene = Scene::read(&source, None).map_err(|e| e.to_string())?;
    let base = normal_form(&source).map_err(|e| e.to_string())?;
    let (lock, _) = Lock::read(Path::new(lock)).map_err(|e| e.to_string())?;
    let entry = base.index(Stage::Vertex).unwrap_or(0);
    let vertex = match &scene.vertex_stage {
        Some(stage) => Program::compile(&stage.module, 0, &[]),
        None => Program::compile(base.module(), entry, &[]),
    };
    let vertex = vertex.map_err(said)?;
    let stand = Stand {
        base: &base,
        vertex: &vertex,
        scene: &scene,
    };
    let start = lock.exact.replay(&base).map_err(|e| e.to_string())?;
    println!("level  distance   bound  steps  numbers  excess  with plain ones");
    for (at, level) in (1..).zip(&lock.levels) {
        let distance = level.distance;
        let search = SampleSet::new(&stand, distance, Samples::Search).map_err(said)?;
        let full = SampleSet::new(&stand, distance, Samples::Full).map_err(said)?;
        let (mut best, mut plain) = (start.clone(), start.clone());
        let mut replaced = 0;
        for step in &level.recipe.0 {
            best = recipe::apply(&best, step).map_err(|e| e.to_string())?;
            let other = plain_step(&search, &plain, step);
            replaced += usize::from(other.is_some());
            let other = other.unwrap_or_else(|| step.clone());
            plain = recipe::apply(&plain, &other).map_err(|e| e.to_string())?;
        }
        let excess =
            |shader: &Shader| Ok::<_, String>(full.figures(shader).map_err(said)?.excess());
        println!(
            "{at:5} {distance:9.2} {:7.4} {:6} {replaced:8} {:7.4} {:16.4}",
            level.bound,
            level.recipe.0.len(),
            excess(&best)?,
            excess(&plain)?
        );
    }
    Ok(())
}

fn said(refused: Refused) -> String {
    refused.what
}

/// The same step with the numbers that the samples show, when its own are others.
fn plain_step(set: &SampleSet<'_>, shader: &Shader, step: &Candidate) -> Option<Candidate> {
    let choice = match (step.pass.as_str(), step.choice.as_str()) {
        ("op-removal", "best") => "mean",
        ("texture-removal", "best") => "seen-mean",
        (_, fit) if fit.starts_with("fit") => fit,
        _ => return None,
    };
    let offered = recipe::candidates(shader, &set.facts(shader));
    offered.into_iter().find(|other| {
        let same = other.pass == step.pass && other.site.path() == step.site.path();
        same && other.choice == choice && other.value != step.value
    })
}
