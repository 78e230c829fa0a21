//! A pass of a program's own: it takes part in a search, its changes are in the lock, and whoever replays that needs it.
#![cfg(feature = "search")]

#[path = "../examples/custom_pass/whole_power.rs"]
mod whole_power;

use lodc::compile::{self, Compiled, Request};
use lodc::emit::write_atomically;
use lodc_passes::{Facts, Pass, Passes, Recipe, normalize};
use std::fs;
use std::path::{Path, PathBuf};
use whole_power::WholePower;

/// Two powers with whole exponents, one of them the same for all components, and two others.
const SHADER: &str = "
    struct Light { shine: f32 }
    @group(0) @binding(0) var<uniform> light: Light;
    @fragment fn fs(@location(0) normal: vec3f) -> @location(0) vec4f {
        let up = saturate(normal.y);
        let edge = pow(1.0 - up, 5.0);
        let gloss = pow(abs(normal), vec3f(3.0));
        let odd = pow(up, 1.5) + pow(up, light.shine);
        return vec4f(gloss * 0.5 + vec3f(edge, odd, edge * 0.5), 1.0);
    }";

const SCENE: &str = "
    resolution = [48, 48]
    levels = 3
    views = { count = 2 }
    uniforms = { \"light.shine\" = { samples = [2.0, 7.0] } }
    ";

fn own() -> Passes {
    Passes::default()
        .with(&WholePower)
        .expect("no pass has that name")
}

/// A search in a folder of its own, with these passes.
fn searched(name: &str, passes: Passes) -> (Request, Compiled) {
    let folder: PathBuf = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("custom-{name}"));
    fs::create_dir_all(&folder).expect("the target folder can be written");
    let shader = folder.join("shine.wgsl");
    fs::write(&shader, SHADER).expect("it can be written");
    fs::write(folder.join("shine.toml"), SCENE).expect("it can be written");
    let request = Request {
        shader,
        passes,
        ..Request::default()
    };
    let compiled = compile::compile(&request, &|_| {}).unwrap_or_else(|error| panic!("{error}"));
    write_atomically(&compiled.files).expect("it can be written");
    (request, compiled)
}

#[test]
fn a_pass_of_ones_own_is_searched_and_replayed() {
    let (request, compiled) = searched("found", own());
    let mut steps = compiled
        .report
        .levels
        .iter()
        .flat_map(|level| &level.recipe);
    let step = steps.find(|step| step.pass == "whole-power");
    let step = step.expect("multiplications save work and change nothing that is seen");
    assert_eq!(step.choice, "multiply");
    assert!(step.class.is_some(), "the report asks the pass");

    let (files, _) = compile::locked(&request).unwrap_or_else(|error| panic!("{error}"));
    assert!(!files.is_empty());
    for file in &files {
        assert!(
            compiled.files.contains(file),
            "{} is another one",
            file.0.display()
        );
    }

    let without = Request {
        passes: Passes::default(),
        ..request
    };
    let error = compile::locked(&without).expect_err("the pass is not there");
    let said = error.to_string();
    for part in [
        "there is no pass `whole-power`",
        "shine.lod.toml:",
        "`Request::passes`",
    ] {
        assert!(said.contains(part), "{said}");
    }
}

#[test]
fn only_takes_its_name() {
    let (mut request, _) = searched("only", Passes::default());
    request.only = vec!["whole-power".into()];
    let said = compile::compile(&request, &|_| {})
        .expect_err("it is not there")
        .to_string();
    assert!(said.contains("there is no pass `whole-power`"), "{said}");
    request.passes = own();
    let compiled = compile::compile(&request, &|_| {}).unwrap_or_else(|error| panic!("{error}"));
    let mut steps = compiled
        .report
        .levels
        .iter()
        .flat_map(|level| &level.recipe);
    assert!(steps.all(|step| step.pass == "whole-power"));
}

#[test]
fn it_keeps_the_law() {
    let module = naga::front::wgsl::parse_str(SHADER).expect("it is WGSL");
    let base = normalize(&module, None, "fs", 1000).expect("it has a normal form");
    let base = base.with_passes(own());
    let considered = WholePower.consider(&base, &Facts::default());
    let declined: Vec<String> = considered
        .iter()
        .filter_map(|c| Some(c.declined.as_ref()?.to_string()))
        .collect();
    assert_eq!(
        declined,
        [
            "the exponent is no whole number from 2 to 64",
            "the exponent is computed"
        ]
    );
    let candidates = WholePower.candidates(&base, &Facts::default());
    assert_eq!(candidates.len(), 2);
    let made = Recipe(candidates).replay(&base).expect("both apply");
    made.validate().expect("it is valid");
    assert!(
        made.passes().of_name("whole-power").is_ok(),
        "variants have the passes of their base"
    );
    assert!(WholePower.candidates(&made, &Facts::default()).is_empty());
}

#[test]
fn two_passes_of_one_name_are_refused() {
    let again = own().with(&WholePower).expect_err("it is there");
    assert_eq!(again.to_string(), "there is a pass `whole-power` already");
    assert!(
        Passes::default()
            .with(&lodc_passes::op_removal::OpRemoval)
            .is_err()
    );
}
