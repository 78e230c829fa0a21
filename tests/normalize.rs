//! Golden files of the normal form: for each fixture under `testdata/passes/normalize/`, the
//! full-context diff from the source to the normal form as it would be emitted.
//!
//! `LODC_BLESS=1 cargo test --test normalize` writes the golden files anew.

use lodc::emit::{self, EmitLevel, Form, Output};
use lodc::front::Source;
use similar::{ChangeTag, TextDiff};
use std::fs;
use std::path::{Path, PathBuf};

#[test]
fn normal_form_is_what_the_goldens_say() {
    let bless = std::env::var_os("LODC_BLESS").is_some();
    let mut wrong = Vec::new();
    for path in fixtures() {
        let golden = golden(&path);
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        // Nothing may change but by hand.
        let changed = golden
            .lines()
            .any(|line| !line.starts_with(' ') && !line.is_empty());
        if name.starts_with("keeps_") && changed {
            wrong.push(format!("{name} changes\n{golden}"));
        }
        let file = path.with_extension("diff");
        let before = fs::read_to_string(&file).unwrap_or_default();
        if bless {
            fs::write(&file, &golden).expect("the golden can be written");
        } else if before != golden {
            let diff = TextDiff::from_lines(&before, &golden);
            wrong.push(format!("{name}\n{}", diff.unified_diff()));
        }
    }
    assert!(
        wrong.is_empty(),
        "{}\nto accept the new goldens: LODC_BLESS=1 cargo test --test normalize",
        wrong.join("\n")
    );
}

fn fixtures() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata/passes/normalize");
    let entries = fs::read_dir(&folder).expect("there are fixtures");
    let mut found: Vec<PathBuf> = entries
        .map(|entry| entry.expect("the folder can be read").path())
        .filter(|path| path.extension().is_some_and(|e| e == "wgsl"))
        .collect();
    found.sort();
    found
}

fn golden(path: &Path) -> String {
    let fail = |e: &dyn std::fmt::Display| -> ! { panic!("{}: {e}", path.display()) };
    let text = fs::read_to_string(path).expect("the fixture can be read");
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let source = Source::parse(&name, text.as_str()).unwrap_or_else(|e| fail(&e));
    let shader = lodc_passes::normalize(
        &source.module,
        source.vertex.as_deref(),
        &source.fragment,
        100_000,
    )
    .unwrap_or_else(|e| fail(&e));
    let level = EmitLevel {
        autolod: 1.0,
        shader,
        distance: 1.0,
        error: 0.0,
        cost: 1.0,
        says: "the normal form".into(),
    };
    let output = Output {
        form: Form::Files,
        ..Output::default()
    };
    let files = emit::emit(&source, &[level], output).unwrap_or_else(|e| fail(&e));
    let (_, bytes) = files.last().expect("one file a level");
    let after = String::from_utf8(bytes.clone()).expect("WGSL is text");
    // Without the comment that every emitted file begins with.
    let after: String = after
        .lines()
        .skip_while(|line| line.starts_with("//") || line.is_empty())
        .flat_map(|line| [line, "\n"])
        .collect();
    let mut golden = String::new();
    for change in TextDiff::from_lines(&text, &after).iter_all_changes() {
        let sign = match change.tag() {
            ChangeTag::Equal => ' ',
            ChangeTag::Delete => '-',
            ChangeTag::Insert => '+',
        };
        golden.push_str(format!("{sign} {}", change.value()).trim_end());
        golden.push('\n');
    }
    golden
}
