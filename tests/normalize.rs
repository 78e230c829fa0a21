//! Golden files of the normal form: for each fixture under `testdata/passes/normalize/`, the
//! full-context diff from the source to the normal form as it would be emitted.
//!
//! `LODC_BLESS=1 cargo test --test normalize` writes the golden files anew.

mod fixtures;

use fixtures::Goldens;
use lodc::compile::normal_form;
use lodc::emit::{self, EmitLevel, Form, Output};
use lodc::front::Source;
use std::fs;
use std::path::Path;

#[test]
fn normal_form_is_what_the_goldens_say() {
    let mut goldens = Goldens::of("normalize");
    for path in fixtures::shaders("testdata/passes/normalize") {
        let golden = golden(&path);
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        // Nothing may change but by hand.
        let changed = golden
            .lines()
            .any(|line| !line.starts_with(' ') && !line.is_empty());
        if name.starts_with("keeps_") && changed {
            goldens.wrong(format!("{name} changes\n{golden}"));
        }
        goldens.compare(&name, &path.with_extension("diff"), &golden);
    }
    goldens.finish();
}

fn golden(path: &Path) -> String {
    let fail = |e: &dyn std::fmt::Display| -> ! { panic!("{}: {e}", path.display()) };
    let text = fs::read_to_string(path).expect("the fixture can be read");
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let source = Source::parse(&name, text.as_str()).unwrap_or_else(|e| fail(&e));
    let shader = normal_form(&source).unwrap_or_else(|e| fail(&e));
    let level = EmitLevel {
        autolod: 1.0,
        shader: shader.clone(),
        distance: 1.0,
        error: 0.0,
        cost: 1.0,
        time: None,
        says: "the normal form".into(),
    };
    let output = Output {
        form: Form::Files,
        ..Output::default()
    };
    let files = emit::emit(&source, &shader, &[level], output).unwrap_or_else(|e| fail(&e));
    let (_, bytes) = files.last().expect("one file a level");
    let after = String::from_utf8(bytes.clone()).expect("WGSL is text");
    // Without the comment that every emitted file begins with.
    let after: String = after
        .lines()
        .skip_while(|line| line.starts_with("//") || line.is_empty())
        .flat_map(|line| [line, "\n"])
        .collect();
    fixtures::whole_diff(&text, &after)
}
