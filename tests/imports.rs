//! Sources of several files, from the files to what is emitted: composed of imported modules, and with a vertex
//! stage of their own.
#![cfg(all(feature = "imports", feature = "search"))]

use lodc::compile::{self, Request};
use lodc::emit::{Output, emit};
use lodc::front::{Definition, Modules, Source, Stages};
use std::path::{Path, PathBuf};

const MATERIAL: &str = "\
#import engine::{camera::camera, lights, io::Varyings}
#import engine::fog

@group(1) @binding(0) var<uniform> tint: vec4f;

fn shade(n: vec3f) -> vec3f { return lights::shade(n) * tint.rgb; }

@fragment
fn fs(in: Varyings) -> @location(0) vec4f {
    let lit = shade(normalize(in.normal));
#ifdef FOG
    return vec4f(fog::shade(lit, length(camera.eye - in.world)), 1.0);
#else
    return vec4f(lit, 1.0);
#endif
}
";

const MESH: &str = "\
#import engine::{camera::camera, io::Varyings}

@vertex
fn vs(@location(0) position: vec3f, @location(1) normal: vec3f) -> Varyings {
    return Varyings(camera.view_proj * vec4f(position, 1.0), position, normal);
}
";

const MODULES: [(&str, &str); 4] = [
    (
        "camera.wgsl",
        "#define_import_path engine::camera\r\n\r\nstruct Camera { view_proj: mat4x4f, eye: vec3f }\r\n\
         @group(0) @binding(0) var<uniform> camera: Camera;\r\n",
    ),
    (
        "io.wgsl",
        "#define_import_path engine::io
struct Varyings { @builtin(position) clip: vec4f, @location(0) world: vec3f, @location(1) normal: vec3f }
",
    ),
    (
        "deep/lights.wgsl",
        "#define_import_path engine::lights
const SKY = vec3f(0.3, 0.4, 0.6);
fn sum(n: vec3f) -> vec3f {
    var all = SKY * (0.5 + 0.5 * n.y);
    for (var i = 0; i < #{LIGHTS}; i += 1) {
        let towards = normalize(vec3f(f32(i) - 1.0, 1.0, 0.5));
        all += vec3f(0.4) * pow(max(dot(n, towards), 0.0), 3.0);
    }
    return all;
}
fn shade(n: vec3f) -> vec3f { return sum(n); }
",
    ),
    (
        "fog.wgsl",
        "#define_import_path engine::fog
#import engine::nowhere
fn shade(colour: vec3f, distance: f32) -> vec3f {
#ifdef NEVER
    return engine::nowhere::shade(colour);
#else
    return mix(vec3f(0.5), colour, exp(-0.05 * distance));
#endif
}
",
    ),
];

const SCENE: &str = "\
resolution = [32, 32]
levels = 3
e_max = 0.1
[shader]
vertex = \"mesh.wgsl\"
[modules]
folders = [\"engine\"]
definitions = { FOG = true, LIGHTS = 3 }
[uniforms]
tint = [0.8, 0.6, 0.4, 1.0]
";

/// The files of this test in a folder of its own.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("imports-{name}"));
    let _ = std::fs::remove_dir_all(&folder);
    let write = |file: &str, text: &str| {
        let path = folder.join(file);
        let parent = path.parent().expect("it is in the folder");
        std::fs::create_dir_all(parent).expect("the target folder can be written");
        std::fs::write(path, text).expect("the target folder can be written");
    };
    write("rock.wgsl", MATERIAL);
    write("mesh.wgsl", MESH);
    write("rock.toml", SCENE);
    for (file, text) in MODULES {
        write(&format!("engine/{file}"), text);
    }
    folder
}

fn read(folder: &Path, definitions: &[&str]) -> Source {
    let stages = Stages {
        vertex_file: Some(folder.join("mesh.wgsl")),
        ..Stages::default()
    };
    let definitions = definitions.iter().map(|text| Definition::of_text(text));
    let modules = Modules {
        folders: vec![folder.join("engine")],
        definitions: definitions
            .collect::<Result<_, _>>()
            .expect("they are shader defs"),
    };
    Source::read_with(&folder.join("rock.wgsl"), &stages, &modules)
        .unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn names_are_those_that_were_written() {
    let folder = folder("names");
    let source = read(&folder, &["FOG", "LIGHTS=2"]);
    let functions = source.module.functions.iter();
    let functions: Vec<_> = functions.filter_map(|(_, f)| f.name.as_deref()).collect();
    // The text that was composed keeps its name; the modules' get theirs in front.
    assert_eq!(functions, ["sum", "lights_shade", "fog_shade", "shade"]);
    let variables = source.module.global_variables.iter();
    let variables: Vec<_> = variables.filter_map(|(_, v)| v.name.as_deref()).collect();
    assert_eq!(variables, ["camera", "tint"]);
    let without = read(&folder, &["LIGHTS=2"]);
    let mut functions = without.module.functions.iter();
    assert!(functions.all(|(_, f)| f.name.as_deref() != Some("fog_shade")));
}

#[test]
fn every_place_is_where_a_person_wrote_it() {
    let folder = folder("places");
    let source = read(&folder, &["FOG", "LIGHTS=2"]);
    let shown = |span| {
        let place = source.place(span).expect("it has a place");
        let file = Path::new(place.file.name)
            .file_name()
            .expect("it is a file");
        let text = place.file.text[place.range.clone()].to_owned();
        (file.to_string_lossy().into_owned(), place.line(), text)
    };
    let of = |file: &str, line, text: &str| (file.to_owned(), line, text.to_owned());
    let (camera, _) = source
        .module
        .global_variables
        .iter()
        .next()
        .expect("it is there");
    assert_eq!(
        shown(source.variable(camera)),
        of("camera.wgsl", 4, "camera")
    );
    // A word behind others that became longer, and one that a shader def was put into.
    let (_, entry) = source.fragment_entry();
    let expressions = &entry.function.expressions;
    let calls = expressions
        .iter()
        .filter(|(_, e)| matches!(e, naga::Expression::CallResult(_)));
    let calls: Vec<_> = calls
        .map(|(at, _)| shown(expressions.get_span(at)))
        .collect();
    assert_eq!(
        calls,
        [
            of("rock.wgsl", 10, "shade(normalize(in.normal))"),
            of(
                "rock.wgsl",
                12,
                "fog::shade(lit, length(camera.eye - in.world))"
            ),
        ]
    );
    let (_, sum) = source.module.functions.iter().next().expect("it is there");
    let less = sum.expressions.iter().find(|(_, e)| {
        matches!(
            e,
            naga::Expression::Binary {
                op: naga::BinaryOperator::Less,
                ..
            }
        )
    });
    let (less, _) = less.expect("the loop has a condition");
    let place = shown(sum.expressions.get_span(less));
    assert_eq!(place, of("lights.wgsl", 5, "i < #{LIGHTS}"));
}

#[test]
fn what_is_written_is_one_module_and_the_lock_makes_it_again() {
    let folder = folder("lock");
    let request = Request {
        shader: folder.join("rock.wgsl"),
        ..Request::default()
    };
    let compiled = compile::compile(&request, &|_| {}).unwrap_or_else(|error| panic!("{error}"));
    let of = |ending: &str| {
        let mut files = compiled.files.iter();
        let found = files.find(|(path, _)| path.to_string_lossy().ends_with(ending));
        String::from_utf8(found.expect(ending).1.clone()).expect("it is text")
    };
    let text = of("lod.wgsl");
    let emitted = Source::parse("rock.lod.wgsl", text.clone()).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(emitted.vertex.as_deref(), Some("vs"));
    assert!(text.contains("fn lod_one_fs("), "{text}");
    for foreign in ["naga_oil", "#import", "#if"] {
        assert!(!text.contains(foreign), "{foreign}: {text}");
    }
    // What is written for level 0 does what the composed module does.
    let source = read(&folder, &["FOG", "LIGHTS=3"]);
    let base = compile::normal_form(&source).unwrap_or_else(|e| panic!("{e}"));
    let written = emit(&source, &base, &[], Output::default()).unwrap_or_else(|e| panic!("{e}"));
    let written = String::from_utf8(written[0].1.clone()).expect("it is text");
    let written = Source::parse("written", written).unwrap_or_else(|e| panic!("{e}"));
    let normal = |source| compile::normal_form(source).expect("it has a normal form");
    assert_eq!(
        normal(&written).fingerprint(),
        normal(&source).fingerprint()
    );

    let report = of("lod.json");
    for file in [
        "rock.wgsl",
        "mesh.wgsl",
        "camera.wgsl",
        "io.wgsl",
        "lights.wgsl",
        "fog.wgsl",
    ] {
        assert!(report.contains(file), "{file} is no input of {report}");
    }
    lodc::emit::write_atomically(&compiled.files).expect("the target folder can be written");
    let (again, warnings) = compile::locked(&request).unwrap_or_else(|error| panic!("{error}"));
    assert!(warnings.is_empty());
    assert_eq!(again[0].1, text.as_bytes());
}
