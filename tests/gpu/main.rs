//! The two renderers against each other: the same scene, the same shader, the same picture, on every adapter that
//! the tests know: Vulkan's and OpenGL's, in software where there is no GPU.
//!
//! Without an adapter the tests are skipped, aloud; where `CI` is set that is a failure. With `--nocapture` they print
//! how far the pictures are apart: the table in the README.
#![cfg(all(feature = "gpu", feature = "cli"))]

mod fixtures;
mod pictures;

use lodc::compile::{self, Request, normal_form};
use lodc::emit::{Form, write_atomically};
use lodc::eval::draw::{Blend, DrawState};
use lodc::eval::image::Picture;
use lodc::eval::raster::Frame;
use lodc::front::{Modules, Source, Stages as Chosen};
use lodc::gpu::worker::{Failure, Subject, Variant, Wanted, Worker};
use lodc::gpu::{Gpu, Renderer, Stages};
use lodc::scene::Scene;
use lodc::scene::mesh::{Draw, Mesh};
use lodc::search::error::{displayed, encoded, through};
use naga::back::{PipelineConstants, pipeline_constants::process_overrides};
use pictures::{
    Apart, FILTERED, ROUNDED, STEP, drawn, evaluated, even, open, pipeline, programs, shown,
};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// Where a test puts its materials.
fn scratch(test: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("gpu-{test}"))
}

fn read(path: &Path) -> (Source, Scene) {
    let source = Source::read(path).unwrap_or_else(|e| panic!("{e}"));
    let scene = Scene::read(&source, None).unwrap_or_else(|e| panic!("{e}"));
    (source, scene)
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
        let name = format!(
            "{interface} {}",
            path.file_stem().unwrap_or_default().display()
        );
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
        wrong.extend(filtered.judge(&name, FILTERED));
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

/// Spheres that cut each other, drawn in every way: two of them are the same, one hides a part of the others, and of one
/// only the front is seen.
fn spheres(sphere: &Mesh) -> (Mesh, Vec<DrawState>) {
    let draws = [
        ([0.0, 0.0], 0.5, Blend::Opaque),
        ([0.4, 0.0], 0.8, Blend::Alpha),
        ([-0.4, 0.2], 0.9, Blend::Additive),
        ([0.0, 0.5], 0.7, Blend::Premultiplied),
        ([0.4, 0.0], 0.8, Blend::Alpha),
    ];
    let mut mesh = Mesh::default();
    let mut states = Vec::new();
    for ([x, y], size, blend) in draws {
        let first = (mesh.positions.len(), mesh.indices.len() / 3);
        let moved = |[a, b, c]: &[f32; 3]| [size * a + x, size * b + y, size * c];
        mesh.positions.extend(sphere.positions.iter().map(moved));
        mesh.normals.extend(&sphere.normals);
        mesh.uvs.extend(&sphere.uvs);
        let own = sphere.indices.iter().map(|i| i + first.0 as u32);
        mesh.indices.extend(own);
        mesh.draws.push(Draw {
            vertices: first.0..mesh.positions.len(),
            triangles: first.1..mesh.indices.len() / 3,
        });
        states.push(DrawState {
            blend,
            front_only: blend == Blend::Premultiplied,
        });
    }
    (mesh, states)
}

#[test]
fn blended_draws_are_composed_in_the_order_of_the_evaluator() {
    // Colours and alpha beyond 0..1, and none in some places.
    let shade = "
        fn shade(normal: vec3f, uv: vec2f, front: bool) -> vec4f {
            if fract(uv.x * 12.0) < 0.2 { discard; }
            let alpha = 1.3 * fract(uv.y * 5.0) - 0.1;
            return vec4f(select(normal.zxy, normal, front) * 0.9 + 0.3, alpha);
        }";
    let plain = "
        @fragment fn fs(@location(0) normal: vec3f, @location(1) uv: vec2f, @builtin(front_facing) front: bool)
            -> @location(0) vec4f { return shade(normal, uv, front); }";
    // Depths that many fragments have, 0 among them, and some that are none.
    let deep = "
        struct Out { @location(0) colour: vec4f, @builtin(frag_depth) depth: f32 }
        @fragment fn fs(@location(0) normal: vec3f, @location(1) uv: vec2f, @builtin(front_facing) front: bool) -> Out {
            return Out(shade(normal, uv, front), floor(uv.y * 7.0) / 5.0 - 0.2);
        }";
    let mut wrong = Vec::new();
    for (name, entry) in [("plain", plain), ("deep", deep)] {
        for output in ["display", "encoded", "linear"] {
            let shader = format!("{shade}\n{entry}");
            let text = format!("object = \"sphere\"\noutput = \"{output}\"");
            let subject = written(&format!("blended-{name}-{output}"), &shader, &text);
            let (source, mut scene) = read(&subject.shader);
            scene.resolution = [64, 64];
            let (mesh, states) = spheres(&scene.frames(4.0).swap_remove(0).mesh);
            scene.states = states.into();
            let frame = Frame {
                mesh: Arc::new(mesh),
                grid: 2,
                ..scene.frames(4.0).swap_remove(0)
            };
            let stages = Stages::of_source(&source, &scene).expect("it has both stages");
            let truth = evaluated(&programs(stages), &scene, &frame);
            for gpu in ["vulkan", "opengl"].into_iter().filter_map(open) {
                let mut renderer = Renderer::new(&gpu);
                let pipeline = pipeline(&renderer, stages, &scene);
                let found = drawn(&mut renderer, &pipeline, &scene, &frame);
                let mut apart = Apart::default();
                apart.add(&scene, &found, &truth);
                let what = format!("{} blended, {name}, {output}", gpu.label().backend);
                wrong.extend(apart.judge(&what, ROUNDED));
            }
        }
    }
    assert!(wrong.is_empty(), "too far apart:\n{}", wrong.join("\n"));
}

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
    let adapters: Vec<Gpu> = ["vulkan", "opengl"].into_iter().filter_map(open).collect();
    let mut wrong = Vec::new();
    for path in fixtures::small_materials(&scratch("levels"), 32, &["levels = 3", "offsets = 1"]) {
        if adapters.is_empty() {
            break;
        }
        let (source, scene) = read(&path);
        let emitted = Emitted::new(&path);
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

/// What the main job makes of a material.
struct Emitted {
    /// All levels in one text.
    whole: Source,
    /// Level 0 in a file of its own.
    first: Source,
    /// `autoLOD` and distance of the others.
    levels: Vec<(f64, f64)>,
}

impl Emitted {
    fn new(path: &Path) -> Self {
        let request = Request {
            shader: path.to_owned(),
            ..Request::default()
        };
        let compiled = compile::compile(&request, &|_| {}).unwrap_or_else(|e| panic!("{e}"));
        write_atomically(&compiled.files).expect("the target folder can be written");
        let parsed = |(name, text): &(PathBuf, Vec<u8>)| {
            let text = String::from_utf8(text.clone()).expect("WGSL is text");
            Source::parse(&name.display().to_string(), text).unwrap_or_else(|e| panic!("{e}"))
        };
        let files = Request {
            form: Some(Form::Files),
            ..request
        };
        let (files, _) = compile::locked(&files).unwrap_or_else(|e| panic!("{e}"));
        let levels = compiled.report.levels.iter().skip(1);
        Self {
            whole: parsed(&compiled.files[0]),
            first: parsed(&files[0]),
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
        let file = pipeline(&renderer, stages(&self.first), scene);
        let file = drawn(&mut renderer, &file, scene, &near);
        assert_eq!(
            bits(&file),
            bits(&truth),
            "{name}: level 0 in a file of its own"
        );
        let unset = pipeline(&renderer, stages(&self.whole), scene);
        let unset = drawn(&mut renderer, &unset, scene, &near);
        let mut apart = Apart::default();
        apart.add(scene, &unset, &truth);
        assert!(apart.most(0.0) <= STEP, "{name}: {}", apart.most(0.0));

        for (auto_lod, distance) in &self.levels {
            let what = format!("{name}, level at {auto_lod:.2}");
            let level = specialised(&self.whole, Some(*auto_lod));
            let level = Stages::of_source(&level, scene);
            let of_evaluator = programs(level.expect("it has both stages"));
            let of_gpu = Stages {
                auto_lod: Some(*auto_lod),
                ..stages(&self.whole)
            };
            let of_gpu = pipeline(&renderer, of_gpu, scene);
            // Nearer than a host would draw it, there is more to see.
            let mut apart = Apart::default();
            let by_gpu = drawn(&mut renderer, &of_gpu, scene, &near);
            apart.add(scene, &by_gpu, &evaluated(&of_evaluator, scene, &near));
            wrong.extend(apart.judge(&what, FILTERED));
            let (mut by_gpu, mut by_evaluator) = (Error::default(), Error::default());
            for frame in scene.frames(*distance) {
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
                let level = evaluated(&of_evaluator, scene, &frame);
                by_evaluator.add(scene, &reference(scene, truth), &level);
                let truth = drawn(&mut renderer, &original, scene, &fine);
                let level = drawn(&mut renderer, &of_gpu, scene, &frame);
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

fn worker(adapter: &str) -> Worker {
    let program = PathBuf::from(env!("CARGO_BIN_EXE_lodc"));
    let patience = Duration::from_secs(120);
    Worker::new(program, Some(adapter.to_owned()), patience)
}

const WANTED: Wanted = Wanted {
    distance: 4.0,
    frame: 0,
    offset: [0.0; 2],
    grid: 1,
};

const PLAIN: &str =
    "@fragment fn fs(@location(0) uv: vec2f) -> @location(0) vec4f { return vec4f(uv, 0.5, 1.0); }";

#[test]
fn a_child_draws_what_its_parent_would() {
    let Some(gpu) = open("vulkan") else { return };
    let subject = written("child", PLAIN, "");
    let (source, scene) = read(&subject.shader);
    let mut renderer = Renderer::new(&gpu);
    let stages = Stages::of_source(&source, &scene).expect("it has both stages");
    let pipeline = pipeline(&renderer, stages, &scene);
    let frame = scene.frames(4.0).swap_remove(0);
    let own = drawn(&mut renderer, &pipeline, &scene, &frame);
    let mut worker = worker("vulkan");
    let childs = worker
        .picture(&subject, &Variant::default(), WANTED)
        .unwrap_or_else(|failure| panic!("{failure:?}"));
    assert_eq!(bits(&childs), bits(&own));
    // A variant of it, by the same child, and one that is no shader.
    let variant = |text: String| Variant {
        text: Some(text),
        auto_lod: None,
    };
    let blue = variant(PLAIN.replace("0.5", "1.0"));
    let other = worker
        .picture(&subject, &blue, WANTED)
        .expect("it draws on");
    assert!(other.pixels.iter().any(|p| p[2] == 1.0));
    let broken = worker.picture(&subject, &variant("fn".to_owned()), WANTED);
    assert!(matches!(broken, Err(Failure::Refused(_))), "{broken:?}");
    assert!(worker.picture(&subject, &blue, WANTED).is_ok());
}

#[test]
fn a_picture_that_takes_too_long_is_given_up_and_the_next_one_is_drawn() {
    let text = "@fragment fn fs(@location(0) uv: vec2f) -> @location(0) vec4f {
            var x = uv.x;
            loop { x = fract(pow(x + 1.5, 1.7) + sin(x)); if x > 2.0 { break; } }
            return vec4f(x);
        }";
    for interface in ["vulkan", "opengl"] {
        if open(interface).is_none() {
            continue;
        }
        let subject = written(&format!("endless-{interface}"), PLAIN, "");
        let mut worker = worker(interface);
        let plain = Variant::default();
        let drawn = worker.picture(&subject, &plain, WANTED);
        assert!(drawn.is_ok(), "{drawn:?}");
        let endless = Variant {
            text: Some(text.to_owned()),
            auto_lod: None,
        };
        // Mesa ends a loop after 65,535 rounds: that takes minutes for as many pixels as these.
        let many = Wanted {
            grid: 128,
            ..WANTED
        };
        worker.set_patience(Duration::from_secs(2));
        let failed = worker.picture(&subject, &endless, many);
        assert!(matches!(failed, Err(Failure::Hung(_))), "{interface}");
        worker.set_patience(Duration::from_secs(120));
        let drawn = worker.picture(&subject, &plain, WANTED);
        assert!(drawn.is_ok(), "{drawn:?}");
    }
}

#[test]
fn what_cannot_be_drawn_is_said_with_a_way_out() {
    let subject = written("refused", PLAIN, "");
    let refused = |adapter: &str, subject: &Subject, wanted: Wanted| {
        let failed = worker(adapter).picture(subject, &Variant::default(), wanted);
        let Err(Failure::Refused(error)) = failed else {
            panic!("{failed:?}");
        };
        assert!(!error.notes.is_empty(), "{error}");
        error.to_string()
    };
    let error = refused("Voodoo 2", &subject, WANTED);
    assert!(error.contains("Voodoo 2") || error.contains("there is no GPU"));
    if open("vulkan").is_none() {
        return;
    }
    // More buffers than any stage may have.
    let names: Vec<String> = (0..300).map(|i| format!("part{i}x")).collect();
    let declared: Vec<String> = (0..)
        .zip(&names)
        .map(|(i, n)| format!("@group(0) @binding({i}) var<uniform> {n}: vec4f;"))
        .collect();
    let many = format!(
        "{}\n@fragment fn fs(@location(0) uv: vec2f) -> @location(0) vec4f {{ return {}; }}",
        declared.join("\n"),
        names.join(" + ")
    );
    let values: Vec<String> = names
        .iter()
        .map(|n| format!("{n} = [1, 1, 1, 1]"))
        .collect();
    let many = written("many", &many, &format!("[uniforms]\n{}", values.join("\n")));
    for interface in ["vulkan", "opengl"] {
        let error = refused(interface, &many, WANTED);
        assert!(error.contains("compiling the shader"), "{error}");
    }
    // A picture that is larger than any texture.
    let huge = Wanted {
        grid: 4096,
        ..WANTED
    };
    let error = refused("vulkan", &subject, huge);
    assert!(error.contains("drawing"), "{error}");
}

#[test]
fn a_child_that_crashes_or_is_none_is_an_error() {
    let subject = written("crash", PLAIN, "");
    let picture = |program: &str| {
        let mut worker = Worker::new(program.into(), None, Duration::from_secs(60));
        let failed = worker.picture(&subject, &Variant::default(), WANTED);
        failed.expect_err("there is no picture")
    };
    // Something that ends at once, and something that is not there.
    let crashed = picture(env!("CARGO"));
    assert!(matches!(&crashed, Failure::Crashed { .. }), "{crashed:?}");
    assert!(!crashed.diagnostic(Some("x")).notes.is_empty());
    let none = picture("/nowhere/lodc");
    assert!(matches!(&none, Failure::NotStarted(_)), "{none:?}");
}
