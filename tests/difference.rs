//! `lodc diff`: what counts as a difference between two shaders, and what is said of it.
#![cfg(feature = "search")]

use lodc::compile::{Request, difference};
use lodc::report::{Fate, ShaderDifference};
use std::fs;
use std::path::{Path, PathBuf};

/// A shader with a few things to change.
const BEFORE: &str = "
struct Light { direction: vec3f, colour: vec3f }
@group(0) @binding(0) var<uniform> light: Light;
@group(0) @binding(1) var albedo: texture_2d<f32>;
@group(0) @binding(2) var linear: sampler;

fn lit(normal: vec3f) -> f32 {
    return max(dot(normal, light.direction), 0.0);
}

@fragment
fn fs_main(@location(0) normal: vec3f, @location(1) uv: vec2f) -> @location(0) vec4f {
    let towards = normalize(normal);
    let base = textureSample(albedo, linear, uv).rgb;
    let shade = lit(towards) * 0.5;
    let tint = light.colour * 2.0;
    return vec4f(base * shade + tint, 1.0);
}
";

/// The difference that changes of the text make, each from what to what.
fn after(name: &str, changes: &[(&str, &str)]) -> ShaderDifference {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("difference");
    fs::create_dir_all(&folder).expect("a folder can be made");
    let mut text = BEFORE.to_owned();
    for (from, to) in changes {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    let request = |name: String, text: &str| {
        let shader: PathBuf = folder.join(name);
        fs::write(&shader, text).expect("it can be written");
        Request {
            shader,
            ..Request::default()
        }
    };
    let before = request(format!("{name}_before.wgsl"), BEFORE);
    let after = request(format!("{name}_after.wgsl"), &text);
    difference(&before, &after).unwrap_or_else(|error| panic!("{error}"))
}

/// What became of which values.
fn fates(difference: &ShaderDifference) -> Vec<(Fate, &str)> {
    let each = difference.values.iter().map(|value| {
        let at = value.after.as_ref().or(value.before.as_ref());
        (value.fate, at.expect("it is in one of them").value.as_str())
    });
    each.collect()
}

#[test]
fn comments_names_functions_and_order_count_for_nothing() {
    let alike = [
        ("comment", vec![("let tint", "// Warm.\n    let tint")]),
        ("name", vec![("towards", "turned"), ("lit(", "lambert(")]),
        (
            "order",
            vec![
                ("    let tint = light.colour * 2.0;\n", ""),
                (
                    "    let base",
                    "    let tint = light.colour * 2.0;\n    let base",
                ),
            ],
        ),
        (
            "inlined",
            vec![("lit(towards)", "max(dot(towards, light.direction), 0.0)")],
        ),
    ];
    for (name, changes) in alike {
        let found = after(name, &changes);
        assert!(found.same, "{name}: {}", found.lines());
        assert_eq!(fates(&found), [], "{name}");
        assert_eq!(found.totals[0], found.totals[1], "{name}");
    }
}

#[test]
fn what_is_changed_is_told_by_value() {
    let found = after("constant", &[("* 0.5", "* 0.25")]);
    assert!(!found.same);
    assert_eq!(fates(&found), [(Fate::Changed, "fs_main.shade")]);
    // What is made of it: its product with the base, and the sum.
    assert_eq!(found.following, 2);

    let found = after("gone", &[(" + tint", "")]);
    let gone = [
        (Fate::Gone, "fs_main.tint"),
        (Fate::Gone, "fs_main.return.add"),
    ];
    assert_eq!(fates(&found), gone);
    let [before, after_] = found.totals;
    assert_eq!(
        (before.operations - after_.operations, after_.samples),
        (6.0, 1.0)
    );
    assert!(found.lines().contains("let tint = light.colour * 2.0;"));

    let found = after(
        "sampled",
        &[(
            "let tint = light.colour",
            "let tint = textureSample(albedo, linear, uv + 0.1).rgb",
        )],
    );
    assert_eq!(found.totals[1].samples, 2.0);
    let new = found.values.iter().find(|value| value.fate == Fate::New);
    assert!(new.is_some(), "{}", found.lines());
}

#[test]
fn rates_and_bindings_count() {
    let found = after("rate", &[("light.colour * 2.0", "normal * 2.0")]);
    let tint = found.values.iter().find(|value| {
        value
            .after
            .as_ref()
            .is_some_and(|at| at.value == "fs_main.tint")
    });
    let tint = tint.unwrap_or_else(|| panic!("{}", found.lines()));
    let rate = |at: &Option<lodc::report::ValueAt>| at.as_ref().map(|at| at.rate.clone());
    assert_eq!(rate(&tint.before).as_deref(), Some("Draw"));
    assert_eq!(rate(&tint.after).as_deref(), Some("Vertex"));

    let flat = after(
        "flat",
        &[(
            "@location(0) normal",
            "@location(0) @interpolate(flat) normal",
        )],
    );
    assert!(!flat.same);
    let found = after("bound", &[("@binding(1)", "@binding(5)")]);
    assert!(!found.same);
    let [binding] = &found.bindings[..] else {
        panic!("{}", found.lines());
    };
    assert_eq!(
        (binding.before, binding.after),
        (Some([0, 1]), Some([0, 5]))
    );
    assert!(found.json().contains("\"same\": false"));
}
