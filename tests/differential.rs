//! Two ways to the same picture: normal form against source, the emitted shader against the original, and each
//! level as emitted against the error that the report gives it.
#![cfg(feature = "search")]

mod fixtures;

use lodc::compile::{self, Request, SnapshotRequest, normal_form};
use lodc::emit::write_atomically;
use lodc::eval::draw::shade;
use lodc::eval::program::Program;
use lodc::eval::programs::{Programs, Stand};
use lodc::eval::raster::rasterize;
use lodc::front::Source;
use lodc::scene::Scene;
use lodc::search::{SampleSet, Samples};
use lodc_passes::{Rate, Rates, Shader, Stage, operands};
use naga::back::{PipelineConstants, pipeline_constants::process_overrides};
use naga::{Expression, Handle, Module, ShaderStage, Statement};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// The materials with fewer pixels and levels.
fn small_materials() -> Vec<PathBuf> {
    let to = Path::new(env!("CARGO_TARGET_TMPDIR")).join("differential");
    fixtures::small_materials(&to, 64, &["levels = 3"])
}

fn read(path: &Path) -> (Source, Scene) {
    let source = Source::read(path).unwrap_or_else(|e| panic!("{e}"));
    let file = path.with_extension("toml");
    let scene =
        Scene::read(&source, file.is_file().then_some(&*file)).unwrap_or_else(|e| panic!("{e}"));
    (source, scene)
}

fn entry(module: &Module, stage: ShaderStage, name: &str) -> usize {
    let found = module
        .entry_points
        .iter()
        .position(|e| e.stage == stage && e.name == name);
    found.expect("the entry point is there")
}

/// The vertex and fragment program of a source as it stands.
fn programs(source: &Source, scene: &Scene) -> (Program, Program) {
    let compile = |module: &Module, entry: usize| {
        Program::compile(module, entry, &[])
            .unwrap_or_else(|r| panic!("{}: {}", source.name, r.what))
    };
    let fragment = compile(
        &source.module,
        entry(&source.module, ShaderStage::Fragment, &source.fragment),
    );
    let vertex = match (&source.vertex, &scene.vertex_stage) {
        (_, Some(supplied)) => compile(&supplied.module, 0),
        (Some(name), None) => compile(
            &source.module,
            entry(&source.module, ShaderStage::Vertex, name),
        ),
        (None, None) => panic!("{}: no vertex stage", source.name),
    };
    (vertex, fragment)
}

/// Bits of a colour; all NaNs are one.
fn bits(colour: [f32; 4]) -> [u32; 4] {
    colour.map(|c| {
        if c.is_nan() {
            f32::NAN.to_bits()
        } else {
            c.to_bits()
        }
    })
}

/// Draws two pairs of programs at every distance of the scene and compares fragment by fragment.
fn assert_same(name: &str, scene: &Scene, a: &(Program, Program), b: &(Program, Program)) {
    for distance in [
        scene.distances[0],
        scene.distances[scene.distances.len() / 2],
    ] {
        for frame in scene.frames(distance) {
            let (left, right) = (rasterize(&a.0, &a.1, &frame), rasterize(&b.0, &b.1, &frame));
            assert!(
                left.pixels().eq(right.pixels()),
                "{name}: other pixels at {distance}"
            );
            let (left, right) = (
                shade(&a.1, &left, &frame.bindings),
                shade(&b.1, &right, &frame.bindings),
            );
            assert_eq!(
                left.alive, right.alive,
                "{name}: other fragments discarded at {distance}"
            );
            assert!(
                !left.colours.is_empty(),
                "{name}: nothing to see at {distance}"
            );
            assert_eq!(left.targets.len(), right.targets.len());
            let further = left.targets.iter().zip(&right.targets);
            let all = [(&left.colours, &right.colours)].into_iter().chain(further);
            let all = all.flat_map(|(l, r)| l.iter().zip(r).enumerate());
            for (i, (l, r)) in all {
                if left.alive[i] {
                    assert_eq!(
                        bits(*l),
                        bits(*r),
                        "{name}: fragment {i} at {distance}: {l:?} {r:?}"
                    );
                }
            }
        }
    }
}

fn program(shader: &Shader, stage: Stage) -> Option<Program> {
    let index = shader.index(stage)?;
    Some(Program::compile(shader.module(), index, &[]).unwrap_or_else(|r| panic!("{}", r.what)))
}

#[test]
fn normal_form_draws_what_the_source_draws() {
    for path in fixtures::complete() {
        let (source, scene) = read(&path);
        let written = programs(&source, &scene);
        let base = normal_form(&source).unwrap_or_else(|e| panic!("{e}"));
        let vertex = program(&base, Stage::Vertex);
        let fragment = program(&base, Stage::Fragment).expect("a shader has a fragment stage");
        let normal = match vertex {
            Some(vertex) => (vertex, fragment),
            None => (programs(&source, &scene).0, fragment),
        };
        assert_same(&source.name, &scene, &written, &normal);
    }
}

/// The values that a fragment stage computes once: outside of its loops.
fn computed_once(shader: &Shader) -> BTreeSet<Handle<Expression>> {
    let function = shader.function(Stage::Fragment).expect("it has the stage");
    let (mut all, mut in_loops) = (BTreeSet::new(), BTreeSet::new());
    operands::walk(&function.body, &mut |statement| match statement {
        Statement::Emit(range) => all.extend(range.clone()),
        Statement::Loop { .. } => {
            for block in operands::blocks(statement) {
                operands::walk(block, &mut |inside| {
                    if let Statement::Emit(range) = inside {
                        in_loops.extend(range.clone());
                    }
                });
            }
        }
        _ => {}
    });
    all.retain(|value| !in_loops.contains(value));
    all
}

#[test]
fn what_is_computed_once_a_draw_is_the_same_in_all_its_fragments() {
    let mut values = 0;
    for path in fixtures::complete() {
        let (source, scene) = read(&path);
        let base = normal_form(&source).unwrap_or_else(|e| panic!("{e}"));
        let rates = Rates::of(&base, Stage::Fragment).expect("a shader has a fragment stage");
        let uniform: Vec<_> = computed_once(&base)
            .into_iter()
            .filter(|value| rates.exactly(*value) <= Rate::Draw)
            .collect();
        let entry = base.index(Stage::Fragment).expect("it has the stage");
        let probed = Program::compile(base.module(), entry, &uniform)
            .unwrap_or_else(|r| panic!("{}", r.what));
        let vertex = program(&base, Stage::Vertex);
        let vertex = vertex.unwrap_or_else(|| programs(&source, &scene).0);
        for frame in scene.frames(scene.distances[0]).into_iter().take(2) {
            if frame.mesh.draws().len() > 1 {
                continue;
            }
            let coverage = rasterize(&vertex, &probed, &frame);
            let profile = shade(&probed, &coverage, &frame.bindings).profile;
            for (value, components) in uniform.iter().zip(&profile.probes) {
                for seen in components.iter().filter(|seen| seen.count > 0) {
                    let id = base.id(Stage::Fragment, *value);
                    let same = seen.min == seen.max || seen.min.is_nan();
                    assert!(same, "{}: {id}: {seen:?}", source.name);
                    values += 1;
                }
            }
        }
    }
    assert!(values > 100, "{values} values are not enough to tell");
}

/// The emitted shader as a host runs it, with `autoLOD` set, or not.
fn specialised(emitted: &Source, autolod: Option<f64>) -> Source {
    let constants: PipelineConstants = autolod
        .iter()
        .map(|value| ("autoLOD".to_owned(), *value))
        .collect();
    let (module, info) = process_overrides(&emitted.module, &emitted.info, None, &constants)
        .expect("overrides resolve");
    Source {
        module: module.into_owned(),
        info: info.into_owned(),
        ..emitted.clone()
    }
}

/// What a scene states of members that are floats, as an application that knows them would.
fn stated(source: &Source, scene: &Scene) -> Vec<(String, Vec<f64>)> {
    // Whole numbers are told by their names.
    let uniforms = scene.uniforms.iter().filter(|uniform| {
        let name = uniform.path.rsplit('.').next().unwrap_or_default();
        !source.text.contains(&format!("{name}: u32"))
            && !source.text.contains(&format!("{name}: i32"))
    });
    uniforms
        .filter_map(|uniform| {
            let words = uniform.stated.as_ref()?;
            let numbers = words.iter().map(|word| f64::from(f32::from_bits(*word)));
            Some((uniform.path.clone(), numbers.collect()))
        })
        .collect()
}

/// A snapshot draws what the branching shader draws there, and needs no more bound than the original.
fn assert_frozen(
    request: &Request,
    at: f32,
    emitted: &Source,
    scene: &Scene,
    values: Vec<(String, Vec<f64>)>,
) {
    let at = f64::from(at);
    let asked = SnapshotRequest {
        request: request.clone(),
        autolod: at,
        values,
        output: None,
    };
    let snapshot = compile::snapshot(&asked).unwrap_or_else(|e| panic!("{e}"));
    let (name, text) = &snapshot.files[0];
    let text = String::from_utf8(text.clone()).expect("WGSL is text");
    let frozen = Source::parse(&name.display().to_string(), text).unwrap_or_else(|e| panic!("{e}"));
    let branching = specialised(emitted, Some(at));
    let drawn = [&branching, &frozen].map(|source| programs(source, scene));
    assert_same(&frozen.name, scene, &drawn[0], &drawn[1]);
    let mut textures = Vec::new();
    snapshot.each_texture(|texture| textures.push(texture.name.clone()));
    let declarations = frozen.text.lines().filter(|line| line.contains("@group"));
    let declared: String = declarations.collect::<Vec<_>>().join("\n");
    let words: BTreeSet<&str> = declared
        .split(|c: char| !c.is_alphanumeric() && c != '_')
        .collect();
    for need in &snapshot.spared {
        assert!(
            !words.contains(&*need.name),
            "{}: {}",
            frozen.name,
            need.name
        );
    }
    for texture in &textures {
        assert!(words.contains(&**texture), "{}: {texture}", frozen.name);
    }
}

#[test]
fn emitted_levels_have_the_errors_that_are_reported() {
    for path in small_materials() {
        let (source, scene) = read(&path);
        let request = Request {
            shader: path.clone(),
            ..Request::default()
        };
        let compiled = compile::compile(&request, &|_| {}).unwrap_or_else(|e| panic!("{e}"));
        let (name, text) = &compiled.files[0];
        let text = String::from_utf8(text.clone()).expect("WGSL is text");
        let emitted =
            Source::parse(&name.display().to_string(), text).unwrap_or_else(|e| panic!("{e}"));

        let original = programs(&source, &scene);
        for unset in [None, Some(0.0), Some(-1.0)] {
            let level = specialised(&emitted, unset);
            assert_same(&source.name, &scene, &original, &programs(&level, &scene));
        }

        write_atomically(&compiled.files).unwrap_or_else(|e| panic!("{e}"));
        for at in compiled.report.levels.iter().map(|level| level.autolod) {
            let at = at as f32 + 0.25;
            assert_frozen(&request, at, &emitted, &scene, Vec::new());
            // What the scene states anyway may be folded: the picture stays the same.
            let values = stated(&source, &scene);
            assert_frozen(&request, at, &emitted, &scene, values);
        }

        let base = normal_form(&source).unwrap_or_else(|e| panic!("{e}"));
        let stand = Stand {
            base: &base,
            vertex: &original.0,
            scene: &scene,
        };
        for level in compiled.report.levels.iter().skip(1) {
            // A threshold is an f32 in the shader.
            let shader = specialised(&emitted, Some(f64::from(level.autolod as f32)));
            let set = SampleSet::new(&stand, level.distance, Samples::Full)
                .unwrap_or_else(|r| panic!("{}", r.what));
            let (vertex, fragment) = programs(&shader, &scene);
            let measured = set.measure_programs(&Programs::new(vertex, fragment));
            let rmse = measured.error.square().sqrt();
            assert!(
                (rmse - level.error.rmse).abs() <= 1e-6,
                "{}: level at {}: reported {}, found {rmse}",
                source.name,
                level.autolod,
                level.error.rmse
            );
            // What is reported holds on pictures that the search has not seen, but for chance.
            let (held_out, chance) = (
                level.error.held_out_rmse.expect("a level has a test split"),
                level
                    .error
                    .held_out_standard_error
                    .expect("it has several pictures"),
            );
            assert!(
                held_out <= level.error.rmse + 2.0 * chance,
                "{}: level at {}: reported {}, held out {held_out} +- {chance}",
                source.name,
                level.autolod,
                level.error.rmse
            );
        }
    }
}

#[test]
fn the_same_bytes_come_from_any_number_of_threads() {
    let path = small_materials()
        .into_iter()
        .find(|path| path.ends_with("terrain_blend.wgsl"))
        .expect("it is there");
    let request = Request {
        shader: path,
        ..Request::default()
    };
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("threads can be made");
        pool.install(|| {
            compile::compile(&request, &|_| {})
                .unwrap_or_else(|e| panic!("{e}"))
                .files
        })
    };
    let once = on(1);
    assert!(once.len() >= 3, "shader, lock and report");
    for threads in [1, 2] {
        assert!(on(threads) == once, "other bytes from {threads} threads");
    }
}
