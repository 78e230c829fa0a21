//! `lodc compare`: errors that can be worked out by hand, emitted shaders against their reports, scenes for two shaders.
#![cfg(feature = "search")]

mod fixtures;
mod moved;

use lodc::Result;
use lodc::compile::{self, CompareRequest, Compared, Request, compare};
use lodc::emit::{Form, write_atomically};
use lodc::eval::image::{Space, read_png};
use std::fs;
use std::path::{Path, PathBuf};

/// A folder of the test's own with these files.
fn folder(name: &str, files: &[(&str, &str)]) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("compare")
        .join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("the target folder can be written");
    for (file, text) in files {
        fs::write(folder.join(file), text).expect("it can be written");
    }
    folder
}

/// `a.wgsl`, the original, and `b.wgsl` in a folder, with the scene beside the first.
fn request(folder: &Path) -> CompareRequest {
    CompareRequest {
        original: Request {
            shader: folder.join("a.wgsl"),
            ..Request::default()
        },
        other: folder.join("b.wgsl"),
        ..CompareRequest::default()
    }
}

fn compared(name: &str, a: &str, b: &str, scene: &str) -> Result<Compared> {
    let folder = folder(name, &[("a.wgsl", a), ("b.wgsl", b), ("a.toml", scene)]);
    compare(&request(&folder), &|| {})
}

fn close(found: f64, by_hand: f64) {
    assert!((found - by_hand).abs() < 2e-6, "{found}, not {by_hand}");
}

/// A shader of the whole screen, larger or smaller, of one colour.
fn screen(colour: &str, size: &str) -> String {
    format!(
        "{colour}
        @vertex fn vs(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {{
            let x = array<f32, 6>(-1.0, 1.0, -1.0, -1.0, 1.0, 1.0)[i];
            let y = array<f32, 6>(-1.0, -1.0, 1.0, 1.0, -1.0, 1.0)[i];
            return vec4f(x * {size}, y, 0.5, 1.0);
        }}
        @fragment fn fs() -> @location(0) vec4f {{ return colour(); }}"
    )
}

fn grey(level: &str) -> String {
    format!("fn colour() -> vec4f {{ return vec4f(vec3f({level}), 1.0); }}")
}

const ENCODED: &str = "output = \"encoded\"\nresolution = [16, 16]\nlevels = 2\n";

#[test]
fn a_block_of_parameters_is_filled_by_the_entry_point_of_its_own_text() {
    let a = "
        struct Light { direction: vec3f, strength: f32 }
        @group(0) @binding(0) var<uniform> light: Light;
        @group(0) @binding(1) var<uniform> camera: mat4x4f;
        struct Surface { @builtin(position) clip: vec4f, @location(0) normal: vec3f }
        @vertex fn vs(@location(0) position: vec3f, @location(1) normal: vec3f) -> Surface {
            return Surface(camera * vec4f(position, 1.0), normal);
        }
        @fragment fn fs(in: Surface) -> @location(0) vec4f {
            let towards = normalize(light.direction);
            let bright = pow(light.strength, 1.5) * vec3f(0.9, 0.8, 0.7);
            return vec4f(bright * max(dot(normalize(in.normal), towards), 0.0), 1.0);
        }";
    let scene = "resolution = [32, 32]\nlevels = 2\n[uniforms]\ncamera = \"model-view-projection\"
        \"light.strength\" = { samples = [0.25, 0.9] }\n\"light.direction\" = [0.5, 0.2, 0.6]";
    let folder = folder("parameters", &[("a.wgsl", a), ("a.toml", scene)]);
    let (shader, files) = moved::with_parameters(&folder.join("a.wgsl"));
    assert!(shader.parameters().len() > 1);
    let text = String::from_utf8_lossy(&files[0].1).into_owned();
    let excess = |text: &str| {
        fs::write(folder.join("b.wgsl"), text).expect("it can be written");
        let mut request = request(&folder);
        request.autolod = Some(2.0);
        let found = compare(&request, &|| {}).unwrap_or_else(|e| panic!("{e}"));
        found.comparison.distances[0].error.excess
    };
    assert_eq!(excess(&text), 0.0);
    // Another one that stores something else shows.
    let other = text.replace(
        "parameters_stored.bright = ",
        "parameters_stored.bright = 0.5 * ",
    );
    assert_ne!(other, text);
    assert!(excess(&other) > 0.01);
}

#[test]
fn errors_worked_out_by_hand() {
    let scene = format!("{ENCODED}e_max = 0.25\n[distance]\nnearest = 2\nfarthest = 4\n");
    let a = screen(&grey("0.5"), "1.0");
    let found = compared("grey", &a, &screen(&grey("0.75"), "1.0"), &scene).unwrap();
    let at = &found.comparison.distances;
    assert_eq!((at.len(), at[0].distance, at[1].distance), (2, 2.0, 4.0));
    for at in at {
        let error = &at.error;
        close(error.rmse, 0.25);
        close(error.floor, 0.0);
        close(error.excess, 0.25);
        close(error.max, 0.25);
        close(error.worst_tile, 0.25);
        close(error.worst_view, 0.25);
        // -20 log10(0.25)
        assert!((error.psnr.unwrap() - 12.041_2).abs() < 1e-4);
        assert!(error.flip > 0.0);
        assert_eq!((error.shimmer, at.autolod), (0.0, None));
    }
    // Nothing is allowed at the nearest distance; what is allowed at the farthest is used up to rounding.
    assert!(!at[0].within);
    assert_eq!((at[0].error.bound, at[1].error.bound), (0.0, 0.25));
    assert!(found.comparison.failed().is_some());

    // White, of which the other shader draws the left half alone: over black that is wrong wholly, over white not at all.
    let a = screen(&grey("1.0"), "1.0");
    let half = a.replace("x * 1.0", "x * 0.5 - 0.5");
    let found = compared("half", &a, &half, &scene).unwrap();
    close(found.comparison.distances[0].error.rmse, 0.5);
    // The other way round it draws what the reference does not cover: the sum is divided by the reference's own half.
    let found = compared("double", &half, &a, &scene).unwrap();
    close(found.comparison.distances[0].error.rmse, 0.5_f64.sqrt());
}

/// A material of the repository as `a.wgsl` in a folder of its own, with these lines at the head of its scene instead of
/// its resolution and its number of distances.
fn small(name: &str, material: &str, head: &str) -> PathBuf {
    let materials = Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata/materials");
    let folder = folder(name, &[]);
    for inside in ["textures", "lighting"] {
        fs::create_dir_all(folder.join(inside)).expect("it can be written");
        for entry in fs::read_dir(materials.join(inside)).expect("the folder is there") {
            let entry = entry.expect("it can be listed");
            let copy = folder.join(inside).join(entry.file_name());
            fs::copy(entry.path(), copy).expect("it can be copied");
        }
    }
    let scene = materials.join(material).with_extension("toml");
    let scene = fs::read_to_string(scene).expect("a scene is text");
    let kept = scene
        .lines()
        .filter(|line| !line.starts_with("resolution") && !line.starts_with("levels"));
    let lines: Vec<&str> = head.lines().chain(kept).collect();
    fs::write(folder.join("a.toml"), lines.join("\n")).expect("it can be written");
    let shader = materials.join(material).with_extension("wgsl");
    fs::copy(shader, folder.join("a.wgsl")).expect("it can be copied");
    folder
}

#[test]
fn a_shader_is_within_its_own_bound_everywhere() {
    let folder = small("same", "gbuffer", "resolution = [24, 24]\nlevels = 3");
    fs::copy(folder.join("a.wgsl"), folder.join("b.wgsl")).unwrap();
    let found = compare(
        &CompareRequest {
            images: Some(folder.join("pictures")),
            ..request(&folder)
        },
        &|| {},
    )
    .unwrap();
    assert_eq!(found.comparison.distances.len(), 3);
    for at in &found.comparison.distances {
        let error = &at.error;
        assert!(at.within && error.rmse > 0.0, "{at:?}");
        assert_eq!(
            (error.rmse, error.excess, at.ratio),
            (error.floor, 0.0, Some(1.0))
        );
    }
    // A deferred scene's pictures are lit, and those of one shader do not differ.
    write_atomically(&found.files).unwrap();
    for (file, _) in &found.files {
        let image = read_png(file, Space::Integer).unwrap();
        let seen = image.texels.iter().any(|t| t[..3] != [0.0; 3]);
        assert_eq!(
            seen,
            !file.to_string_lossy().contains("difference"),
            "{}",
            file.display()
        );
    }
    assert!(
        found.files.len().is_multiple_of(9) && !found.files.is_empty(),
        "{}",
        found.files.len()
    );
}

/// An original whose level at autoLOD 1 is darker by 0.25.
const TWO_LEVELS: &str = "fn colour() -> vec4f {
        if !(autoLOD >= 1.0) { return vec4f(0.5, 0.5, 0.5, 1.0); }
        return vec4f(0.25, 0.25, 0.25, 1.0);
    }";

#[test]
fn an_emitted_shader_draws_the_level_that_is_asked_for() {
    let a = screen(&grey("0.5"), "1.0");
    let ways = [
        "override autoLOD: f32 = 0.0;\n",
        "@id(7) override autoLOD: f32 = 0.0;\n",
        "@group(0) @binding(0) var<uniform> autoLOD: f32;\n",
    ];
    for way in ways {
        let b = screen(&format!("{way}{TWO_LEVELS}"), "1.0");
        let folder = folder(
            "level",
            &[("a.wgsl", &a), ("b.wgsl", &b), ("a.toml", ENCODED)],
        );
        let rmse = |at: &[f64], autolod| {
            let request = CompareRequest {
                at: at.to_vec(),
                autolod,
                ..request(&folder)
            };
            let found = compare(&request, &|| {}).unwrap().comparison.distances;
            assert_eq!(found.len(), at.len().max(1), "{way}");
            (
                found[0].error.rmse,
                found[0].autolod.unwrap(),
                found[0].distance,
            )
        };
        let (error, autolod, nearest) = rmse(&[2.0], None);
        assert_eq!((error, autolod), (0.0, 0.0), "{way}");
        close(rmse(&[2.0], Some(1.0)).0, 0.25);
        assert_eq!(rmse(&[2.0], Some(0.99)).0, 0.0);
        // Without a distance it is the one at which autoLOD has the value.
        let (error, _, there) = rmse(&[], Some(1.0));
        close(error, 0.25);
        assert!(there > nearest);
        let (error, autolod, _) = rmse(&[there], None);
        close(error, 0.25);
        close(autolod, 1.0);
    }
}

#[test]
fn emitted_forms_have_the_errors_of_their_report() {
    let folder = small(
        "report",
        "terrain_blend",
        "resolution = [48, 48]\nlevels = 3",
    );
    let original = Request {
        shader: folder.join("a.wgsl"),
        ..Request::default()
    };
    let made = compile::compile(&original, &|_| {}).unwrap();
    write_atomically(&made.files).unwrap();
    let of_uniform = Request {
        form: Some(Form::Uniform),
        output: Some(folder.join("uniform.lod.wgsl")),
        ..original.clone()
    };
    fs::copy(folder.join("a.lod.toml"), folder.join("uniform.lod.toml")).unwrap();
    write_atomically(&compile::locked(&of_uniform).unwrap().0).unwrap();
    assert!(made.report.levels.len() > 1);
    for other in ["a.lod.wgsl", "uniform.lod.wgsl"] {
        let found = compare(
            &CompareRequest {
                other: folder.join(other),
                ..request(&folder)
            },
            &|| {},
        )
        .unwrap();
        assert!(
            found.comparison.failed().is_none(),
            "{other}: {:?}",
            found.comparison
        );
        for level in &made.report.levels {
            let at = found
                .comparison
                .distances
                .iter()
                .find(|at| at.distance == level.distance);
            let at = at.expect("a level starts at a distance of the scene");
            for (found, reported) in [
                (at.error.rmse, level.error.rmse),
                (at.error.floor, level.error.floor),
                (at.error.worst_tile, level.error.worst_tile),
                (at.error.worst_view, level.error.worst_view),
                (at.error.shimmer, level.error.shimmer),
                (at.error.flip, level.error.flip),
                (at.error.max, level.error.max),
            ] {
                assert!(
                    (found - reported).abs() < 1e-6,
                    "{other} at {}: {found} {reported}",
                    at.distance
                );
            }
        }
    }
}

/// A table that the first level replaces by a plane, which from farther away is over the bound.
const GOES_BACK: &str = "
    @group(0) @binding(1) var grime: texture_2d<f32>;
    @group(0) @binding(2) var table: texture_2d<f32>;
    @group(0) @binding(3) var s: sampler;
    @group(0) @binding(4) var<uniform> camera: mat4x4f;
    struct Surface { @builtin(position) clip: vec4f, @location(0) uv: vec2f }
    @vertex fn vs(@location(0) position: vec3f, @location(2) uv: vec2f) -> Surface {
        return Surface(camera * vec4f(position, 1.0), uv);
    }
    @fragment fn fs(in: Surface) -> @location(0) vec4f {
        let read = textureSample(table, s, in.uv);
        let dirt = textureSample(grime, s, in.uv).bgra;
        let both = sqrt(max(mix(read * read, dirt, 0.25), vec4f(0.0)));
        let bright = max(sqrt(vec4f(0.2, 0.25, 1.0, 0.5)), read.bgra);
        return vec4f(both.rgb + 0.5 * bright.rgb, 1.0);
    }";

#[test]
fn a_level_that_is_the_original_again_is_written() {
    let textures = Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata/materials/textures");
    let scene = format!(
        "object = \"plane\"\nresolution = [48, 48]\nlevels = 3\nviews = {{ directions = [[0, 0.4, 1]] }}
         [distance]\nnearest = 2.5\nfarthest = 20
         [uniforms]\ncamera = \"model-view-projection\"
         [textures]\ngrime = {:?}\ntable = {{ file = {:?}, space = \"linear\" }}\n",
        textures.join("grime.png"),
        textures.join("diffuse_lut.png")
    );
    let folder = folder("goes-back", &[("a.wgsl", GOES_BACK), ("a.toml", &scene)]);
    let compared = CompareRequest {
        other: folder.join("a.lod.wgsl"),
        ..request(&folder)
    };
    let compiled = compile::compile(&compared.original, &|_| {}).unwrap_or_else(|e| panic!("{e}"));
    write_atomically(&compiled.files).expect("they can be written");
    let recipes = compiled
        .report
        .levels
        .iter()
        .map(|level| level.recipe.len());
    let recipes: Vec<usize> = recipes.collect();
    assert!(
        matches!(recipes[..], [0, changed, 0] if changed > 0),
        "{recipes:?}"
    );
    let (files, _) = compile::locked(&compared.original).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(files[0].1, fs::read(&compared.other).expect("it is there"));
    let compared = compare(&compared, &|| {}).unwrap_or_else(|e| panic!("{e}"));
    let pairs = compared
        .comparison
        .distances
        .iter()
        .zip(&compiled.report.levels);
    for (at, level) in pairs {
        assert_eq!(at.distance, level.distance);
        close(at.error.rmse, level.error.rmse);
        assert!(at.error.excess <= level.error.bound);
    }
}

#[test]
fn a_scene_may_name_what_only_one_of_them_has() {
    let buffer = |name: &str, of: &str| {
        format!(
            "struct Paint {{ {of} }} @group(0) @binding(0) var<uniform> {name}: Paint;
            fn colour() -> vec4f {{ return vec4f(vec3f({name}.level), 1.0); }}"
        )
    };
    let a = screen(
        &buffer("paint", "dirt: f32, level: f32")
            .replace("paint.level", "paint.level + 0.0 * paint.dirt"),
        "1.0",
    );
    let b = screen(&buffer("paint", "level: f32"), "1.0");
    let c = screen(&buffer("other", "level: f32"), "1.0");
    let scene = format!(
        "{ENCODED}[uniforms]\n\"paint.dirt\" = 0.3\n\"paint.level\" = {{ samples = [0.5, 0.25] }}\n"
    );
    let found = compared("member", &a, &b, &scene).unwrap();
    assert_eq!(found.comparison.distances[0].error.rmse, 0.0);
    // Samples of one are pictures of both: 0.5 and 0.25 against 0.5, 0.25 and 0.75 against 0.5, 0.25, 0.5 again.
    let scene = format!("{scene}\"other.level\" = {{ samples = [0.5, 0.25, 0.75] }}\n");
    let found = compared("samples", &a, &c, &scene).unwrap();
    close(
        found.comparison.distances[0].error.rmse,
        (0.25_f64.powi(2) / 3.0).sqrt(),
    );
    let error = compared("typo", &a, &c, &scene.replace("paint.dirt", "paint.dirty")).unwrap_err();
    assert!(error.message.contains("`paint.dirty`"), "{error}");
}

#[test]
fn a_vertex_file_is_for_shaders_without_a_vertex_stage() {
    let whole = screen(&grey("0.5"), "1.0");
    let (vertex, fragment) = whole.split_at(whole.find("@fragment").unwrap());
    let (colour, vertex) = vertex.split_at(vertex.find("@vertex").unwrap());
    let bare = format!("{colour}{fragment}");
    let scene = format!("{ENCODED}[shader]\nvertex = \"v.wgsl\"\n");
    let files = [
        ("a.wgsl", &*bare),
        ("v.wgsl", vertex),
        ("a.toml", &*scene),
        ("b.wgsl", &bare),
        ("whole.wgsl", &whole),
    ];
    let folder = folder("vertex", &files);
    for other in ["b.wgsl", "whole.wgsl"] {
        let found = compare(
            &CompareRequest {
                other: folder.join(other),
                ..request(&folder)
            },
            &|| {},
        )
        .unwrap();
        assert_eq!(found.comparison.distances[0].error.rmse, 0.0, "{other}");
    }
}

#[test]
fn pictures_show_both_and_four_times_the_difference() {
    let scene = format!("{ENCODED}[views]\ncount = 2\n");
    let (a, b) = (screen(&grey("0.4"), "1.0"), screen(&grey("0.6"), "0.5"));
    let folder = folder(
        "pictures",
        &[("a.wgsl", &a), ("b.wgsl", &b), ("a.toml", &scene)],
    );
    let request = CompareRequest {
        at: vec![3.0],
        images: Some(folder.join("out")),
        ..request(&folder)
    };
    let found = compare(&request, &|| {}).unwrap();
    write_atomically(&found.files).unwrap();
    let names: Vec<_> = found
        .files
        .iter()
        .map(|(file, _)| file.file_name().unwrap().to_string_lossy())
        .collect();
    assert_eq!(
        names[..3],
        [
            "3_view1_a.png",
            "3_view1_b.png",
            "3_view1_difference_x4.png"
        ]
    );
    assert_eq!(names.len(), 6);
    // In the middle both draw; at the left edge only the first one does.
    let at = |file: usize, x: usize| {
        let image = read_png(&found.files[file].0, Space::Integer).unwrap();
        assert_eq!((image.width, image.height), (16, 16));
        image.texels[8 * 16 + x][0]
    };
    assert_eq!((at(0, 8), at(1, 8), at(2, 8)), (102.0, 153.0, 204.0));
    assert_eq!((at(0, 0), at(1, 0), at(2, 0)), (102.0, 0.0, 255.0));
}

#[cfg(feature = "cli")]
#[test]
fn a_check_that_fails_exits_with_1() {
    use std::process::Command;
    let files = [
        ("a.wgsl", &*screen(&grey("0.5"), "1.0")),
        ("b.wgsl", &*screen(&grey("0.75"), "1.0")),
        ("a.toml", ENCODED),
    ];
    let folder = folder("check", &files);
    let run = |arguments: &[&str]| {
        let command = Command::new(env!("CARGO_BIN_EXE_lodc"))
            .arg("compare")
            .args(arguments)
            .current_dir(&folder)
            .output();
        let output = command.expect("lodc starts");
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (
            output.status.code(),
            text(&output.stdout),
            text(&output.stderr),
        )
    };
    let (code, out, err) = run(&["a.wgsl", "b.wgsl"]);
    assert!(
        code == Some(0) && err.is_empty() && out.contains("0.250"),
        "{code:?} {out} {err}"
    );
    let (code, out, err) = run(&["a.wgsl", "b.wgsl", "--check"]);
    assert!(
        code == Some(1) && out.contains("0.250") && err.contains("`b.wgsl` is over its bound"),
        "{code:?} {err}"
    );
    let (code, _, err) = run(&["a.wgsl", "a.wgsl", "--check"]);
    assert!(code == Some(0) && err.is_empty(), "{code:?} {err}");
    let (code, out, _) = run(&["a.wgsl", "b.wgsl", "--json", "--at", "3"]);
    let json: serde_json::Value = serde_json::from_str(&out).expect("it is JSON");
    assert!(code == Some(0));
    assert_eq!(json["distances"][0]["distance"], 3.0);
    assert_eq!(json["other"], "b.wgsl");
    assert!(
        json["distances"][0]["error"]["excess"]
            .as_f64()
            .is_some_and(|e| (e - 0.25).abs() < 1e-6)
    );
}

#[cfg(feature = "gpu")]
mod on_a_gpu {
    use super::*;
    use lodc::compile::DrawnBy;
    use lodc::gpu::Gpu;

    /// Whether there is an adapter. Where tests must not be skipped, there is.
    fn has_adapter() -> bool {
        match Gpu::open(None) {
            Ok(_) => true,
            Err(error) if std::env::var_os("CI").is_some() => panic!("{error}"),
            Err(error) => {
                eprintln!("SKIPPED: comparisons on a GPU: {error}");
                false
            }
        }
    }

    /// A material of the repository in a folder of its own, with a scene of fewer pixels and distances, and as `b.wgsl`
    /// the same with some words replaced.
    fn altered(material: &str, changes: &[(&str, &str)]) -> PathBuf {
        let folder = small(
            &format!("gpu_{material}"),
            material,
            "resolution = [40, 40]\nlevels = 3\n",
        );
        let text = fs::read_to_string(folder.join("a.wgsl")).unwrap();
        let other = changes.iter().fold(text, |text, (from, to)| {
            assert!(text.contains(from), "{material} has no `{from}`");
            text.replace(from, to)
        });
        fs::write(folder.join("b.wgsl"), other).unwrap();
        folder
    }

    #[test]
    fn errors_by_gpu_are_those_of_the_evaluator() {
        if !has_adapter() {
            return;
        }
        for (material, changes) in MATERIALS {
            let folder = altered(material, changes);
            let by = |renderer| {
                let request = CompareRequest {
                    renderer,
                    ..request(&folder)
                };
                compare(&request, &|| {}).unwrap().comparison
            };
            let (cpu, gpu) = (by(DrawnBy::Evaluator), by(DrawnBy::Gpu { adapter: None }));
            let label = gpu.adapter.expect("it says what drew");
            assert_eq!(cpu.distances.len(), gpu.distances.len());
            for (cpu, gpu) in cpu.distances.iter().zip(&gpu.distances) {
                let (at, gpu_within) = (cpu.distance, gpu.within);
                let (cpu_within, cpu, gpu) = (cpu.within, &cpu.error, &gpu.error);
                for (what, cpu, gpu) in [
                    ("error", cpu.rmse, gpu.rmse),
                    ("floor", cpu.floor, gpu.floor),
                    ("excess", cpu.excess, gpu.excess),
                    ("worst view", cpu.worst_view, gpu.worst_view),
                    ("worst tile", cpu.worst_tile, gpu.worst_tile),
                    ("shimmer", cpu.shimmer, gpu.shimmer),
                    ("FLIP", cpu.flip, gpu.flip),
                ] {
                    println!(
                        "{material} at {at:.2}, {label}: {what} {cpu:.5} by evaluator, {gpu:.5} by GPU"
                    );
                    let close = (cpu - gpu).abs() <= (0.05 * cpu).max(0.001);
                    assert!(
                        close,
                        "{material} at {at}: {what} {cpu} by evaluator, {gpu} by {label}"
                    );
                }
                assert_eq!(cpu_within, gpu_within);
            }
        }
    }

    /// A forward material, a deferred one, and one that is blended.
    const MATERIALS: [(&str, &[(&str, &str)]); 3] = [
        (
            "terrain_blend",
            &[
                ("in.uv * 1.7 + 0.31)", "vec2f(0.31))"),
                ("let wet = mask.b;", "let wet = 0.4;"),
            ],
        ),
        (
            "gbuffer",
            &[(
                "textureSample(panel_normal, panel_sampler, in.uv).xy * 2.0 - 1.0",
                "vec2f(0.0)",
            )],
        ),
        (
            "ivy",
            &[
                ("return alpha * left;", "return 0.6 * left;"),
                ("0.3 * (slope.x + slope.y)", "0.0"),
            ],
        ),
    ];

    #[test]
    fn a_comparison_on_a_gpu_has_a_process_of_its_own() {
        if !has_adapter() {
            return;
        }
        let files = [
            ("a.wgsl", &*screen(&grey("0.5"), "1.0")),
            ("b.wgsl", &*screen(&grey("0.75"), "1.0")),
            ("a.toml", ENCODED),
        ];
        let folder = folder("process", &files);
        let run = |arguments: &[&str]| {
            let command = std::process::Command::new(env!("CARGO_BIN_EXE_lodc"))
                .args(["compare", "a.wgsl", "b.wgsl"])
                .args(arguments)
                .current_dir(&folder)
                .output();
            let output = command.expect("lodc starts");
            let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
            (
                output.status.code(),
                text(&output.stdout),
                text(&output.stderr),
            )
        };
        let (code, out, err) = run(&["--renderer", "gpu", "--json", "-o", "out"]);
        assert!(code == Some(0), "{code:?} {err}");
        let json: serde_json::Value = serde_json::from_str(&out).expect("it is JSON");
        assert_eq!(json["renderer"], "gpu");
        assert!(json["adapter"].is_string());
        let excess = json["distances"][0]["error"]["excess"].as_f64().unwrap();
        assert!((excess - 0.25).abs() < 1e-5, "{excess}");
        // Nothing is covered by halves here, so that the pictures are those of the evaluator.
        for picture in fs::read_dir(folder.join("out")).unwrap() {
            let image = read_png(&picture.unwrap().path(), Space::Integer).unwrap();
            assert_eq!((image.width, image.height), (16, 16));
            assert!(
                image.texels.iter().all(|texel| texel[0] >= 127.0),
                "{:?}",
                image.texels[0]
            );
        }
        let (code, out, err) = run(&["--renderer", "gpu", "--check"]);
        assert!(
            code == Some(1) && out.contains("drawn by"),
            "{code:?} {out} {err}"
        );
        let (code, _, err) = run(&["--adapter", "Voodoo 2"]);
        assert!(
            code == Some(2) && err.contains("there is no adapter `Voodoo 2`"),
            "{code:?} {err}"
        );
    }
}
