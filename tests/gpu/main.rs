//! The two renderers against each other: the same scene, the same shader, the same picture, on every adapter that
//! the tests know: Vulkan's and OpenGL's, in software where there is no GPU.
//!
//! Without an adapter the tests are skipped, aloud; where `CI` is set that is a failure. With `--nocapture` they print
//! how far the pictures are apart: the table in the README.
#![cfg(all(feature = "gpu", feature = "cli"))]

mod blended;
mod collapsed;
#[path = "../fixtures/mod.rs"]
mod fixtures;
mod levels;
mod models;
#[path = "../moved/mod.rs"]
mod moved;
mod parameters;
#[path = "../pictures/mod.rs"]
mod pictures;
mod shaders;
mod stable;
mod time;
mod vertices;
mod worker;

use lodc::compile::normal_form;
use lodc::eval::image::Picture;
use lodc::eval::raster::Frame;
use lodc::front::{Modules, Source, Stages as Chosen};
use lodc::gpu::worker::Subject;
use lodc::gpu::{Renderer, Stages};
use lodc::scene::Scene;
use pictures::{Apart, FILTERED, ROUNDED, drawn, evaluated, even, open, pipeline, programs};
use std::path::{Path, PathBuf};

/// The interfaces that every test draws by.
const INTERFACES: [&str; 2] = ["vulkan", "opengl"];

/// Where a test puts its materials.
fn scratch(test: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("gpu-{test}"))
}

fn read(path: &Path) -> (Source, Scene) {
    let source = Source::read(path).unwrap_or_else(|e| panic!("{e}"));
    let scene = Scene::read(&source, None).unwrap_or_else(|e| panic!("{e}"));
    (source, scene)
}

fn bits(picture: &Picture) -> Vec<u32> {
    let all = picture.pixels.as_flattened().iter().chain(&picture.covered);
    all.map(|number| number.to_bits()).collect()
}

/// A shader and a scene in a folder of their own.
fn written(name: &str, shader: &str, scene: &str) -> Subject {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("gpu-{name}"));
    std::fs::create_dir_all(&folder).expect("the target folder can be written");
    let path = folder.join("a.wgsl");
    std::fs::write(&path, shader).expect("it can be written");
    let text = format!("resolution = [16, 16]\n{scene}");
    std::fs::write(folder.join("a.toml"), text).expect("it can be written");
    Subject::new(path, None, &Chosen::default(), &Modules::default())
}

/// The frames that are looked at: near and far, off the pixels' centres, and with fine pixels.
fn frames(scene: &Scene) -> Vec<Frame> {
    let near = scene.frames(scene.distances[0]).swap_remove(0);
    let all = &scene.distances;
    let far = scene
        .frames(all[all.len() / 2])
        .pop()
        .expect("there is one");
    let fine = Frame {
        grid: 4,
        ..near.clone()
    };
    let off = Frame {
        offset: [0.3, -0.2],
        ..far
    };
    vec![near, fine, off]
}

fn materials_are_drawn_alike(interface: &str) {
    let Some(gpu) = open(interface) else { return };
    let mut wrong = Vec::new();
    for path in fixtures::small_materials(&scratch(interface), 64, &[]) {
        let (source, scene) = read(&path);
        let material = path.file_stem().unwrap_or_default().display().to_string();
        let name = format!("{interface} {material}");
        let mut renderer = Renderer::new(&gpu);
        let written = Stages::of_source(&source, &scene).expect("it has both stages");
        let base = normal_form(&source).unwrap_or_else(|e| panic!("{e}"));
        let normal = Stages::of_shader(&base, &scene).expect("it has both stages");
        let by_evaluator = programs(written);
        let pipelines = [written, normal].map(|stages| pipeline(&renderer, stages, &scene));
        let [mut filtered, mut rounded, mut forms] = <[Apart; 3]>::default();
        for frame in frames(&scene) {
            let truth = evaluated(&by_evaluator, &scene, &frame);
            let [written, normal] = pipelines
                .each_ref()
                .map(|pipeline| drawn(&mut renderer, pipeline, &scene, &frame));
            filtered.add(&scene, &written, &truth);
            forms.add(&scene, &normal, &written);
            if frame.grid == 1 {
                let even = even(&frame);
                let truth = evaluated(&by_evaluator, &scene, &even);
                let drawn = drawn(&mut renderer, &pipelines[0], &scene, &even);
                rounded.add(&scene, &drawn, &truth);
            }
        }
        wrong.extend(filtered.judge(&name, FILTERED.of(&material)));
        wrong.extend(rounded.judge(&format!("{name}, even textures"), ROUNDED));
        wrong.extend(forms.judge(&format!("{name}, its normal form"), ROUNDED));
    }
    assert!(wrong.is_empty(), "too far apart:\n{}", wrong.join("\n"));
}

#[test]
fn vulkan_draws_what_the_evaluator_draws() {
    materials_are_drawn_alike("vulkan");
}

#[test]
fn opengl_draws_what_the_evaluator_draws() {
    materials_are_drawn_alike("opengl");
}
