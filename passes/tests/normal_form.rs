//! Every shader of the test data has a normal form that is valid, and that is its own normal form.

use lodc_passes::{Shader, Stage, normalize};
use std::path::{Path, PathBuf};

const LIMIT: usize = 100_000;

fn shaders(folder: &Path, found: &mut Vec<PathBuf>) {
    let entries = std::fs::read_dir(folder).expect("the test data can be read");
    let mut paths: Vec<_> = entries.map(|e| e.expect("it is an entry").path()).collect();
    paths.sort();
    for path in paths {
        if path.is_dir() {
            if !path.ends_with("errors") {
                shaders(&path, found);
            }
        } else if path.extension().is_some_and(|e| e == "wgsl") {
            found.push(path);
        }
    }
}

fn first(module: &naga::Module, stage: naga::ShaderStage) -> Option<&str> {
    let mut entries = module.entry_points.iter();
    entries.find(|e| e.stage == stage).map(|e| e.name.as_str())
}

fn normal_form(module: &naga::Module) -> Option<Shader> {
    let fragment = first(module, naga::ShaderStage::Fragment)?;
    let vertex = first(module, naga::ShaderStage::Vertex);
    Some(normalize(module, vertex, fragment, LIMIT).expect("it is small"))
}

/// The module as WGSL. naga cannot write every module that it reads: overrides made of others, say.
fn written(module: &naga::Module) -> Option<String> {
    if module.overrides.iter().any(|(_, o)| {
        o.init.is_some_and(|init| {
            !matches!(
                module.global_expressions[init],
                naga::Expression::Literal(_)
            )
        })
    }) {
        return None;
    }
    let flags = naga::valid::ValidationFlags::all();
    let mut validator = naga::valid::Validator::new(flags, naga::valid::Capabilities::all());
    let info = validator.validate(module).expect("it is valid");
    let flags = naga::back::wgsl::WriterFlags::empty();
    Some(naga::back::wgsl::write_string(module, &info, flags).expect("it is WGSL"))
}

/// Whether a constant is one that nothing is taken out of: naga writes no other as the initial value of a variable in
/// SPIR-V.
fn is_plain(function: &naga::Function, value: naga::Handle<naga::Expression>) -> bool {
    use naga::Expression as E;
    match &function.expressions[value] {
        E::Literal(_) | E::ZeroValue(_) | E::Constant(_) => true,
        E::Splat { value, .. } => is_plain(function, *value),
        E::Compose { components, .. } => components.iter().all(|c| is_plain(function, *c)),
        _ => false,
    }
}

fn check(name: &str, source: &str) {
    let module = naga::front::wgsl::parse_str(source)
        .unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(source)));
    let Some(shader) = normal_form(&module) else {
        return;
    };
    for stage in [Stage::Vertex, Stage::Fragment] {
        let Some(function) = shader.function(stage) else {
            continue;
        };
        for (_, local) in function.local_variables.iter() {
            let plain = local.init.is_none_or(|init| is_plain(function, init));
            assert!(
                plain,
                "{name}: not every writer takes how {:?} begins",
                local.name
            );
        }
    }
    let valid = shader.validate();
    valid.unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(source)));
    let again = normal_form(shader.module()).expect("it has a fragment entry point");
    let shown = written(shader.module()).unwrap_or_default();
    if std::env::var_os("SHOW").is_some() {
        println!("==== {name}\n{shown}");
        for stage in [Stage::Vertex, Stage::Fragment] {
            if let Some(function) = shader.function(stage) {
                for (value, expression) in function.expressions.iter() {
                    println!("{value:?} {} = {expression:?}", shader.id(stage, value));
                }
            }
        }
    }
    assert_eq!(
        shader.fingerprint(),
        again.fingerprint(),
        "{name}: {shown}\n{}",
        written(again.module()).unwrap_or_default()
    );
    if let Some(text) = written(shader.module()) {
        let reparsed = naga::front::wgsl::parse_str(&text)
            .unwrap_or_else(|e| panic!("{name}: {}\n{text}", e.emit_to_string(&text)));
        let reparsed = normal_form(&reparsed).expect("it has a fragment entry point");
        let valid = reparsed.validate();
        valid.unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(&text)));
    }
    let mut paths: Vec<_> = [Stage::Vertex, Stage::Fragment]
        .into_iter()
        .filter_map(|stage| Some((stage, shader.function(stage)?)))
        .flat_map(|(stage, function)| {
            let values = function.expressions.iter();
            values.map(move |(value, _)| (stage, value))
        })
        .map(|(stage, value)| shader.id(stage, value).path().to_owned())
        .collect();
    let count = paths.len();
    paths.sort();
    paths.dedup();
    assert_eq!(count, paths.len(), "{name}: paths are unique");
}

#[test]
fn every_shader_of_the_test_data_has_one() {
    let mut found = Vec::new();
    let only = std::env::var("ONLY").ok();
    shaders(
        &Path::new(env!("CARGO_MANIFEST_DIR")).join("../testdata"),
        &mut found,
    );
    assert!(!found.is_empty());
    for path in found {
        let name = path.display().to_string();
        if only.as_ref().is_none_or(|only| name.contains(only)) {
            check(
                &name,
                &std::fs::read_to_string(&path).expect("it can be read"),
            );
        }
    }
}
