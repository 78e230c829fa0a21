//! What the main job writes, drawn in every form, and the errors of levels by both renderers.

use super::pictures::{
    Apart, FILTERED, ROUNDED, STEP, drawn, evaluated, open, pipeline, programs, shown,
};
use super::{INTERFACES, bits, fixtures, read, scratch};
use lodc::compile::{self, Request};
use lodc::emit::{Form, write_atomically};
use lodc::error::{displayed, encoded, through};
use lodc::eval::image::Picture;
use lodc::eval::raster::Frame;
use lodc::front::Source;
use lodc::gpu::{Gpu, Renderer, Stages};
use lodc::scene::Scene;
use naga::back::{PipelineConstants, pipeline_constants::process_overrides};
use std::path::{Path, PathBuf};

/// A text of WGSL with `autoLOD` set, so that the evaluator can run it.
fn specialised(text: &Source, auto_lod: Option<f64>) -> Source {
    let constants: PipelineConstants = auto_lod
        .iter()
        .map(|value| ("autoLOD".to_owned(), *value))
        .collect();
    let (module, info) =
        process_overrides(&text.module, &text.info, None, &constants).expect("overrides resolve");
    Source {
        module: module.into_owned(),
        info: info.into_owned(),
        ..text.clone()
    }
}

/// The RMSE of pictures against references, as DESIGN's error has it but for what the sampling chooses.
#[derive(Default)]
struct Error {
    squares: f64,
    coverage: f64,
}

impl Error {
    fn add(&mut self, scene: &Scene, reference: &[Picture; 2], picture: &Picture) {
        let [black, white] = reference;
        for (i, covered) in black.covered.iter().enumerate() {
            self.coverage += f64::from(*covered);
            let shown = match picture.covered[i] > 0.0 {
                true => shown(scene, picture.pixels[i]),
                false => [[0.0; 3], [1.0; 3]],
            };
            for (truth, shown) in [black, white].into_iter().zip(shown) {
                let [r, g, b, _] = truth.pixels[i];
                let truth = encoded([r, g, b].map(|c| c.clamp(0.0, 1.0)));
                let squares = truth
                    .iter()
                    .zip(shown)
                    .map(|(t, s)| f64::from(t - s).powi(2));
                self.squares += squares.sum::<f64>() / 6.0;
            }
        }
    }

    fn rmse(&self) -> f64 {
        (self.squares / self.coverage).sqrt()
    }
}

/// What a display shows of a picture in fine pixels, in linear light, filtered into pixels: over black and over white.
fn reference(scene: &Scene, fine: Picture) -> [Picture; 2] {
    let (mut black, mut white) = (fine.clone(), fine.clone());
    for (i, covered) in fine.covered.iter().enumerate() {
        white.pixels[i] = [1.0; 4];
        if *covered > 0.0 {
            let light = displayed(scene.output, fine.pixels[i]);
            let more = match scene.blends() {
                true => through(scene.output, fine.pixels[i]),
                false => [0.0; 3],
            };
            let [r, g, b] = light;
            black.pixels[i] = [r, g, b, 1.0];
            white.pixels[i] = [r + more[0], g + more[1], b + more[2], 1.0];
        }
    }
    [black, white].map(|picture| picture.box_filtered(4))
}

#[test]
fn levels_are_drawn_with_the_errors_that_the_evaluator_finds() {
    let adapters: Vec<Gpu> = INTERFACES.into_iter().filter_map(open).collect();
    let mut wrong = Vec::new();
    for path in fixtures::small_materials(&scratch("levels"), 32, &["levels = 3", "offsets = 1"]) {
        if adapters.is_empty() {
            break;
        }
        let (source, scene) = read(&path);
        let emitted = Emitted::new(&path, false);
        for gpu in &adapters {
            let interface = gpu.label().backend;
            let name = format!(
                "{interface} {}",
                path.file_stem().unwrap_or_default().display()
            );
            wrong.extend(emitted.judge(gpu, &name, (&source, &scene)));
        }
    }
    assert!(wrong.is_empty(), "too far apart:\n{}", wrong.join("\n"));
}

#[test]
fn levels_with_parameters_are_drawn_in_both_forms_as_the_evaluator_draws_them() {
    let Some(gpu) = open("vulkan") else { return };
    let (mut wrong, mut with_blocks) = (Vec::new(), 0);
    let lines = ["levels = 3", "offsets = 1"];
    for path in fixtures::small_materials(&scratch("levels-with-parameters"), 32, &lines) {
        let name = path.file_stem().unwrap_or_default().display().to_string();
        if !["pbr", "car_paint"].contains(&&*name) {
            continue;
        }
        let (source, scene) = read(&path);
        let emitted = Emitted::new(&path, true);
        for text in [&emitted.whole, &emitted.uniform] {
            with_blocks += usize::from(text.text.contains("fn lod_parameters("));
        }
        wrong.extend(emitted.judge(&gpu, &name, (&source, &scene)));
    }
    assert!(wrong.is_empty(), "too far apart:\n{}", wrong.join("\n"));
    assert!(with_blocks >= 2, "{with_blocks} texts have a block");
}

/// What the main job makes of a material.
struct Emitted {
    /// All levels in one text.
    whole: Source,
    /// The same, chosen by a uniform.
    uniform: Source,
    /// Each level in a file of its own.
    files: Vec<Source>,
    scene: PathBuf,
    /// `autoLOD` and distance of the others.
    levels: Vec<(f64, f64)>,
}

impl Emitted {
    /// Of a material, with values in a block of parameters or without.
    fn new(path: &Path, parameters: bool) -> Self {
        let request = Request {
            shader: path.to_owned(),
            parameters,
            ..Request::default()
        };
        let compiled = compile::compile(&request, &|_| {}).unwrap_or_else(|e| panic!("{e}"));
        write_atomically(&compiled.files).expect("the target folder can be written");
        let parsed = |(name, text): &(PathBuf, Vec<u8>)| {
            let text = String::from_utf8(text.clone()).expect("WGSL is text");
            Source::parse(&name.display().to_string(), text).unwrap_or_else(|e| panic!("{e}"))
        };
        let form = |form| {
            let request = Request {
                form: Some(form),
                ..request.clone()
            };
            let (files, _) = compile::locked(&request).unwrap_or_else(|e| panic!("{e}"));
            files
        };
        let (files, uniform) = (form(Form::Files), form(Form::Uniform));
        // Parameters stand beside it as Rust.
        let is_shader = |(name, _): &&(PathBuf, Vec<u8>)| {
            name.extension()
                .is_some_and(|extension| extension == "wgsl")
        };
        let levels = compiled.report.levels.iter().skip(1);
        Self {
            whole: parsed(&compiled.files[0]),
            scene: path.with_extension("toml"),
            uniform: parsed(&uniform[0]),
            files: files.iter().filter(is_shader).map(parsed).collect(),
            // A threshold is an f32 in the shader.
            levels: levels
                .map(|level| (f64::from(level.autolod as f32), level.distance))
                .collect(),
        }
    }

    /// What is wrong with it as the GPU draws it.
    fn judge(&self, gpu: &Gpu, name: &str, (source, scene): (&Source, &Scene)) -> Vec<String> {
        let mut wrong = Vec::new();
        let mut renderer = Renderer::new(gpu);
        let stages = |source| Stages::of_source(source, scene).expect("it has both stages");
        let original = pipeline(&renderer, stages(source), scene);
        let original_programs = programs(stages(source));
        let near = scene.frames(scene.distances[0]).swap_remove(0);
        let truth = drawn(&mut renderer, &original, scene, &near);
        let file = pipeline(&renderer, stages(&self.files[0]), scene);
        let file = drawn(&mut renderer, &file, scene, &near);
        assert_eq!(
            bits(&file),
            bits(&truth),
            "{name}: level 0 in a file of its own"
        );
        // The scene as it is for a text with a block of parameters, which its own entry point fills.
        let own = Scene::read(&self.whole, Some(&self.scene)).unwrap_or_else(|e| panic!("{e}"));
        let near = own.frames(scene.distances[0]).swap_remove(0);
        let unset = Stages::of_source(&self.whole, &own).expect("it has both stages");
        let unset = pipeline(&renderer, unset, &own);
        let unset = drawn(&mut renderer, &unset, &own, &near);
        let mut apart = Apart::default();
        apart.add(scene, &unset, &truth);
        assert!(apart.most(0.0) <= STEP, "{name}: {}", apart.most(0.0));
        // The scene as it is for a shader with one uniform more.
        let mut with_uniform =
            Scene::read(&self.uniform, Some(&self.scene)).unwrap_or_else(|e| panic!("{e}"));
        let chosen = Stages::of_source(&self.uniform, &with_uniform).expect("it has both stages");
        let chosen = pipeline(&renderer, chosen, &with_uniform);
        let mut by_uniform = |auto_lod: f64| {
            with_uniform.set_auto_lod(auto_lod);
            let frame = with_uniform.frames(scene.distances[0]).swap_remove(0);
            drawn(&mut Renderer::new(gpu), &chosen, &with_uniform, &frame)
        };
        let mut apart = Apart::default();
        apart.add(scene, &by_uniform(0.0), &truth);
        assert!(
            apart.most(0.0) <= STEP,
            "{name}, uniform: {}",
            apart.most(0.0)
        );

        for ((auto_lod, distance), file) in self.levels.iter().zip(&self.files[1..]) {
            let what = format!("{name}, level at {auto_lod:.2}");
            let level = specialised(&self.whole, Some(*auto_lod));
            let level = Stages::of_source(&level, &own);
            let of_evaluator = programs(level.expect("it has both stages"));
            let of_gpu = Stages {
                auto_lod: Some(*auto_lod),
                ..Stages::of_source(&self.whole, &own).expect("it has both stages")
            };
            let of_gpu = pipeline(&renderer, of_gpu, &own);
            // Nearer than a host would draw it, there is more to see.
            let mut apart = Apart::default();
            let by_gpu = drawn(&mut renderer, &of_gpu, &own, &near);
            apart.add(scene, &by_gpu, &evaluated(&of_evaluator, &own, &near));
            wrong.extend(apart.judge(&what, FILTERED));
            let mut apart = Apart::default();
            apart.add(scene, &by_uniform(*auto_lod), &by_gpu);
            wrong.extend(apart.judge(&format!("{what}, by a uniform"), ROUNDED));
            let mut apart = Apart::default();
            // The scene as it is for what this file reads.
            let (_, of_file) =
                Scene::read_both(source, file, Some(&self.scene)).unwrap_or_else(|e| panic!("{e}"));
            let near_file = of_file.frames(scene.distances[0]).swap_remove(0);
            let file = Stages::of_source(file, &of_file).expect("it has both stages");
            let file = pipeline(&renderer, file, &of_file);
            let file = drawn(&mut renderer, &file, &of_file, &near_file);
            apart.add(scene, &file, &by_gpu);
            wrong.extend(apart.judge(&format!("{what}, in a file of its own"), ROUNDED));
            let (mut by_gpu, mut by_evaluator) = (Error::default(), Error::default());
            for frame in own.frames(*distance) {
                let frame = Frame {
                    offset: [0.2, 0.1],
                    ..frame
                };
                let fine = Frame {
                    offset: [0.0; 2],
                    grid: 4,
                    ..frame.clone()
                };
                let truth = evaluated(&original_programs, scene, &fine);
                let level = evaluated(&of_evaluator, &own, &frame);
                by_evaluator.add(scene, &reference(scene, truth), &level);
                let truth = drawn(&mut renderer, &original, scene, &fine);
                let level = drawn(&mut renderer, &of_gpu, &own, &frame);
                by_gpu.add(scene, &reference(scene, truth), &level);
            }
            let (a, b) = (by_evaluator.rmse(), by_gpu.rmse());
            println!("{what}: RMSE {a:.5} by the evaluator, {b:.5} by the GPU");
            // Negated, so that a NaN is too far.
            let near = (a - b).abs() <= (0.05 * a).max(0.001);
            if !near {
                wrong.push(format!("{what}: RMSE {a} and {b}"));
            }
        }
        wrong
    }
}
