//! A real model on a GPU, where it is present (`LODC_DATA`, or `../shared/data`): draws with textures of their own, most
//! of them opaque, and a glass in front of them.

use super::pictures::{Apart, FILTERED, ROUNDED, drawn, evaluated, even, open, pipeline, programs};
use super::{INTERFACES, scratch};
use lodc::front::Source;
use lodc::gpu::{Renderer, Stages};
use lodc::scene::Scene;
use std::path::{Path, PathBuf};
use std::process::Command;

#[test]
fn a_model_with_opaque_and_blended_materials_is_drawn_as_by_the_evaluator() {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let data = std::env::var_os("LODC_DATA").map_or(here.join("../shared/data"), PathBuf::from);
    let model = data.join("FlightHelmet/FlightHelmet.gltf");
    if !model.is_file() {
        eprintln!("SKIPPED: {} is not there", model.display());
        return;
    }
    let shader = here.join("testdata/materials/gltf_pbr.wgsl");
    let written = scratch("model").with_extension("toml");
    let run = Command::new(env!("CARGO_BIN_EXE_lodc"))
        .arg("init")
        .arg(&shader)
        .arg("--mesh")
        .arg(&model)
        .args(["--force", "-o"])
        .arg(&written)
        .output()
        .expect("lodc starts");
    assert!(run.status.success(), "{run:?}");
    let source = Source::read(&shader).unwrap_or_else(|e| panic!("{e}"));
    let mut scene = Scene::read(&source, Some(&written)).unwrap_or_else(|e| panic!("{e}"));
    scene.resolution = [96, 96];
    assert!(scene.blends() && scene.mesh.draws.len() > 1);
    let stages = Stages::of_source(&source, &scene).expect("it has both stages");
    let by_evaluator = programs(stages);
    let frame = scene.frames(scene.nearest).swap_remove(0);
    let frames = [frame.clone(), even(&frame)];
    let truths = frames
        .each_ref()
        .map(|frame| evaluated(&by_evaluator, &scene, frame));
    let mut wrong = Vec::new();
    for interface in INTERFACES {
        let Some(gpu) = open(interface) else { continue };
        let mut renderer = Renderer::new(&gpu);
        let pipeline = pipeline(&renderer, stages, &scene);
        let kinds = [("", FILTERED), (", even textures", ROUNDED)];
        for ((frame, truth), (kind, tolerance)) in frames.iter().zip(&truths).zip(kinds) {
            let picture = drawn(&mut renderer, &pipeline, &scene, frame);
            let mut apart = Apart::default();
            apart.add(&scene, &picture, truth);
            wrong.extend(apart.judge(&format!("{interface} FlightHelmet{kind}"), tolerance));
        }
    }
    assert!(wrong.is_empty(), "too far apart:\n{}", wrong.join("\n"));
}
