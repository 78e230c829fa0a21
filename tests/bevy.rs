//! Bevy's standard material, from the sources of its crates to levels: composed of some fifty modules, linked with
//! its mesh vertex stage, normalised, drawn, searched, emitted and made again from the lock.
//!
//! The sources come through cargo, which unpacks them beside those of this package's own dependencies; nothing of
//! them is built. Without a network the tests are skipped, aloud; where `CI` is set that is a failure.
#![cfg(all(feature = "imports", feature = "search"))]

#[cfg(feature = "gpu")]
mod pictures;

use lodc::compile::{self, Request};
use lodc::emit::{EmitLevel, Form, Output, emit, write_atomically};
use lodc::eval::draw::shade;
use lodc::eval::program::Program;
use lodc::eval::raster::rasterize;
use lodc::front::{Definition, Modules, Source, Stages, Value};
use lodc::scene::{Reading, Scene};
use lodc_passes::vertex_motion::VertexMotion;
use lodc_passes::{Facts, Pass, Shader, Stage};
use naga::{Module, ShaderStage, Statement};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The crates that Bevy's material imports modules of.
const CRATES: [&str; 5] = [
    "bevy_pbr",
    "bevy_render",
    "bevy_core_pipeline",
    "bevy_post_process",
    "bevy_light",
];
const VERSION: &str = "0.19.0";

/// The folders of the crates, in the order of [`CRATES`]; `None` when they cannot be had, which is said.
fn folders() -> Option<Vec<PathBuf>> {
    let found: Result<Vec<PathBuf>, String> = CRATES.iter().map(|name| folder(name)).collect();
    match found {
        Ok(folders) => Some(folders),
        Err(why) if std::env::var_os("CI").is_some() => panic!("{why}"),
        Err(why) => {
            eprintln!("SKIPPED: no sources of Bevy: {why}");
            None
        }
    }
}

fn folder(name: &str) -> Result<PathBuf, String> {
    if let Some(folder) = unpacked(name) {
        return Ok(folder);
    }
    let output = Command::new(env!("CARGO"))
        .args(["info", "--quiet", &format!("{name}@{VERSION}")])
        .output()
        .map_err(|error| error.to_string())?;
    unpacked(name).ok_or_else(|| {
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        format!("cargo info {name}@{VERSION}: {}", said.trim())
    })
}

/// Where cargo has unpacked a crate.
fn unpacked(name: &str) -> Option<PathBuf> {
    let home = std::env::var_os("CARGO_HOME").map(PathBuf::from);
    let home = home.or_else(|| Some(PathBuf::from(std::env::var_os("HOME")?).join(".cargo")))?;
    let registries = std::fs::read_dir(home.join("registry/src")).ok()?;
    let mut folders = registries.flatten().map(|registry| {
        let folder = format!("{name}-{VERSION}");
        registry.path().join(folder)
    });
    folders.find(|folder| folder.join("src").is_dir())
}

/// The committed scene with fewer pixels, views and distances, in the target folder.
fn small_scene(name: &str, resolution: u32) -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata");
    let text = std::fs::read_to_string(here.join("scenes/bevy_pbr.toml")).expect("it is committed");
    let textures = here.join("materials/textures");
    let small = [
        ("[96, 96]", format!("[{resolution}, {resolution}]")),
        ("count = 3", "count = 2".to_owned()),
        ("levels = 4", "levels = 3".to_owned()),
        ("../materials/textures", textures.display().to_string()),
    ];
    let text = small.iter().fold(text, |text, (from, to)| {
        assert!(text.contains(from), "the scene has no {from}");
        text.replace(from, to)
    });
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("bevy-{name}"));
    std::fs::create_dir_all(&folder).expect("the target folder can be written");
    let path = folder.join("pbr.toml");
    std::fs::write(&path, text).expect("the target folder can be written");
    path
}

fn stages(folders: &[PathBuf]) -> Stages {
    Stages {
        vertex_file: Some(folders[0].join("src/render/mesh.wgsl")),
        ..Stages::default()
    }
}

/// Bevy's material with the shader defs of a scene, and others.
fn composed(folders: &[PathBuf], scene: &Path, more: &[&str]) -> Source {
    let reading = Reading::read(scene).unwrap_or_else(|error| panic!("{error}"));
    let mut definitions = reading.modules.definitions;
    if !more.is_empty() {
        definitions.retain(|d| !d.name.starts_with("TONEMAP_METHOD"));
    }
    definitions.extend(more.iter().map(|name| Definition {
        name: (*name).to_owned(),
        value: Value::Bool(true),
    }));
    let modules = Modules {
        folders: folders.to_vec(),
        definitions,
    };
    let shader = folders[0].join("src/render/pbr.wgsl");
    Source::read_with(&shader, &stages(folders), &modules).unwrap_or_else(|error| panic!("{error}"))
}

fn programs(module: &Module, vertex: &str, fragment: &str) -> (Program, Program) {
    let program = |stage, name: &str| {
        let mut entries = module.entry_points.iter();
        let at = entries.position(|e| e.stage == stage && e.name == name);
        Program::compile(module, at.expect("it is there"), &[])
            .unwrap_or_else(|refused| panic!("{}", refused.what))
    };
    (
        program(ShaderStage::Vertex, vertex),
        program(ShaderStage::Fragment, fragment),
    )
}

/// Draws both over every frame of a distance; the colours must be the same to the bit. Gives those of a frame.
fn same_pictures(
    scene: &Scene,
    distance: f64,
    a: &(Program, Program),
    b: &(Program, Program),
) -> Vec<[f32; 4]> {
    let mut colours = Vec::new();
    for frame in scene.frames(distance) {
        let (left, right) = (rasterize(&a.0, &a.1, &frame), rasterize(&b.0, &b.1, &frame));
        assert!(
            left.pixels().eq(right.pixels()),
            "other pixels at {distance}"
        );
        let left = shade(&a.1, &left, &frame.bindings);
        let right = shade(&b.1, &right, &frame.bindings);
        assert_eq!(
            left.alive, right.alive,
            "other fragments discarded at {distance}"
        );
        assert!(!left.colours.is_empty(), "nothing to see at {distance}");
        for (l, r) in left.colours.iter().zip(&right.colours) {
            assert_eq!(
                l.map(f32::to_bits),
                r.map(f32::to_bits),
                "{l:?} {r:?} at {distance}"
            );
        }
        colours = left.colours;
    }
    colours
}

fn calls(shader: &Shader) -> usize {
    let mut calls = shader.module().functions.len();
    for stage in [Stage::Vertex, Stage::Fragment] {
        let function = shader.function(stage).expect("it has both stages");
        lodc_passes::operands::walk(&function.body, &mut |statement| {
            calls += usize::from(matches!(statement, Statement::Call { .. }));
        });
    }
    calls
}

#[test]
fn the_normal_form_has_no_call_and_draws_what_the_source_draws() {
    let Some(folders) = folders() else { return };
    let file = small_scene("normal", 64);
    // With the tone mapping of the scene, and with the look-up texture that Bevy has by default.
    for more in [&[][..], &["TONEMAP_METHOD_TONY_MC_MAPFACE"][..]] {
        let source = composed(&folders, &file, more);
        let mut names = source
            .module
            .functions
            .iter()
            .filter_map(|(_, f)| f.name.as_deref());
        assert!(names.all(|name| !name.contains("naga_oil")));
        let base = compile::normal_form(&source).unwrap_or_else(|error| panic!("{error}"));
        base.validate().unwrap_or_else(|error| panic!("{error:?}"));
        assert_eq!(calls(&base), 0);
        let scene = Scene::read(&source, Some(&file)).unwrap_or_else(|error| panic!("{error}"));
        let vertex = source.vertex.as_deref().expect("the mesh stage was linked");
        let written = programs(&source.module, vertex, &source.fragment);
        let normal = programs(base.module(), vertex, &source.fragment);
        let colours = same_pictures(&scene, scene.distances[0], &written, &normal);
        // It is lit: neither black nor white, and not all alike.
        let mean = colours.iter().map(|c| c[1]).sum::<f32>() / colours.len() as f32;
        let most = colours.iter().map(|c| c[1]).fold(0.0, f32::max);
        if more.is_empty() {
            assert!(
                (0.02..0.9).contains(&mean) && most > 1.5 * mean,
                "{mean} {most}"
            );
        }
    }
}

#[test]
fn there_are_levels_and_the_lock_makes_them_again() {
    let Some(folders) = folders() else { return };
    let scene = small_scene("levels", 32);
    let request = Request {
        shader: folders[0].join("src/render/pbr.wgsl"),
        scene: Some(scene.clone()),
        output: Some(scene.with_file_name("pbr.lod.wgsl")),
        stages: stages(&folders),
        modules: Modules {
            folders: folders.clone(),
            ..Modules::default()
        },
        ..Request::default()
    };
    let compiled = compile::compile(&request, &|_| {}).unwrap_or_else(|error| panic!("{error}"));
    assert!(
        compiled.report.levels.len() >= 3,
        "{}",
        compiled.report.json()
    );
    let text = String::from_utf8(compiled.files[0].1.clone()).expect("it is text");
    let emitted = Source::parse("pbr.lod.wgsl", &*text).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(
        (emitted.vertex.as_deref(), emitted.fragment.as_str()),
        (Some("vertex"), "fragment")
    );
    assert!(!text.contains("naga_oil"));

    // Level 0, as it is written, draws what Bevy's modules do.
    let source = composed(&folders, &scene, &[]);
    let base = compile::normal_form(&source).unwrap_or_else(|error| panic!("{error}"));
    let plain =
        emit(&source, &base, &[], Output::default()).unwrap_or_else(|error| panic!("{error}"));
    let plain = String::from_utf8(plain[0].1.clone()).expect("it is text");
    let plain = Source::parse("plain", plain).unwrap_or_else(|error| panic!("{error}"));
    let drawn = Scene::read(&source, Some(&scene)).unwrap_or_else(|error| panic!("{error}"));
    let program = |source: &Source| programs(&source.module, "vertex", "fragment");
    same_pictures(
        &drawn,
        drawn.distances[1],
        &program(&source),
        &program(&plain),
    );

    write_atomically(&compiled.files).expect("the target folder can be written");
    let again = Request {
        stages: Stages::default(),
        modules: Modules::default(),
        ..request
    };
    let (files, warnings) = compile::locked(&again).unwrap_or_else(|error| panic!("{error}"));
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!(files[0].1, text.as_bytes());
}

#[test]
fn a_level_with_values_at_the_vertices_is_drawn_as_its_variant() {
    let Some(folders) = folders() else { return };
    let file = small_scene("moved", 32);
    let source = composed(&folders, &file, &[]);
    let base = compile::normal_form(&source).unwrap_or_else(|error| panic!("{error}"));
    let scene = Scene::read(&source, Some(&file)).unwrap_or_else(|error| panic!("{error}"));
    // Some values that can be moved one after another.
    let mut shader = base.clone();
    let mut moved = 0;
    while moved < 4 {
        let candidates = VertexMotion.candidates(&shader, &Facts::default());
        let Some(candidate) = candidates.get(candidates.len() * (moved + 1) / 5) else {
            break;
        };
        shader = VertexMotion.apply(&shader, candidate);
        moved += 1;
    }
    assert_eq!(moved, 4);
    let vertex = source.vertex.as_deref().expect("the mesh stage was linked");
    let variant = programs(shader.module(), vertex, &source.fragment);
    let level = EmitLevel {
        autolod: 1.0,
        shader,
        distance: scene.distances[1],
        error: 0.0,
        cost: 1.0,
        time: None,
        says: "values per vertex".into(),
    };
    for form in [Form::Override, Form::Uniform, Form::Files] {
        let output = Output {
            form,
            ..Output::default()
        };
        let files = emit(&source, &base, std::slice::from_ref(&level), output);
        let files = files.unwrap_or_else(|error| panic!("{error}"));
        let (_, text) = files.last().expect("there is one");
        let text = String::from_utf8(text.clone()).expect("it is text");
        let emitted = Source::parse("pbr.lod.wgsl", text).unwrap_or_else(|e| panic!("{e}"));
        let constants = [("autoLOD".to_owned(), 1.0)].into_iter().collect();
        let module = match form {
            Form::Uniform => continue,
            Form::Files => std::borrow::Cow::Borrowed(&emitted.module),
            Form::Override => {
                naga::back::pipeline_constants::process_overrides(
                    &emitted.module,
                    &emitted.info,
                    None,
                    &constants,
                )
                .unwrap_or_else(|error| panic!("{error}"))
                .0
            }
        };
        let emitted = programs(&module, vertex, &source.fragment);
        same_pictures(&scene, scene.distances[1], &emitted, &variant);
    }
}

#[cfg(feature = "gpu")]
#[test]
fn vulkan_draws_it_and_its_normal_form_as_the_evaluator_does() {
    use lodc::gpu::{Renderer, Stages};
    use pictures::{Apart, FILTERED, ROUNDED, drawn, evaluated, even, open, pipeline};

    let Some(folders) = folders() else { return };
    let Some(gpu) = open("vulkan") else { return };
    let file = small_scene("gpu", 64);
    let source = composed(&folders, &file, &[]);
    let base = compile::normal_form(&source).unwrap_or_else(|error| panic!("{error}"));
    let scene = Scene::read(&source, Some(&file)).unwrap_or_else(|error| panic!("{error}"));
    let written = Stages::of_source(&source, &scene).expect("the mesh stage was linked");
    let normal = Stages::of_shader(&base, &scene).expect("the mesh stage was linked");
    let mut renderer = Renderer::new(&gpu);
    let pipelines = [written, normal].map(|stages| pipeline(&renderer, stages, &scene));
    let by_evaluator = pictures::programs(normal);
    let [mut filtered, mut rounded, mut forms] = <[Apart; 3]>::default();
    for distance in [scene.distances[0], scene.distances[1]] {
        let frame = scene.frames(distance).swap_remove(0);
        let truth = evaluated(&by_evaluator, &scene, &frame);
        let [written, normal] = pipelines
            .each_ref()
            .map(|pipeline| drawn(&mut renderer, pipeline, &scene, &frame));
        filtered.add(&scene, &written, &truth);
        forms.add(&scene, &normal, &written);
        let even = even(&frame);
        let truth = evaluated(&by_evaluator, &scene, &even);
        let written = drawn(&mut renderer, &pipelines[0], &scene, &even);
        rounded.add(&scene, &written, &truth);
    }
    let judged = [
        filtered.judge("vulkan Bevy", FILTERED),
        rounded.judge("vulkan Bevy, even textures", ROUNDED),
        forms.judge("vulkan Bevy, its normal form", ROUNDED),
    ];
    let wrong: Vec<String> = judged.into_iter().flatten().collect();
    assert!(wrong.is_empty(), "too far apart:\n{}", wrong.join("\n"));
}
