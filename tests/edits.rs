//! What becomes of a lock when its shader is edited: `testdata/locks/<edit>.wgsl` beside the original's lock.
//!
//! What is said of it is `<edit>.fate`; `LODC_BLESS=1` rewrites that. The manual has the table.

mod fixtures;

use fixtures::Goldens;
use lodc::compile::normal_form;
use lodc::emit::{EmitLevel, Lock};
use lodc::front::Source;
use std::path::{Path, PathBuf};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata/locks")
}

/// The lock on a shader: its levels, or what is said.
fn fate(path: &Path) -> Result<Vec<EmitLevel>, String> {
    let (lock, text) = Lock::read(&folder().join("original.lod.toml")).expect("it is a lock");
    let source = Source::read(path).unwrap_or_else(|error| panic!("{error}"));
    let base = normal_form(&source).unwrap_or_else(|error| panic!("{error}"));
    let replayed = lock.replay(&base, "original.lod.toml", &text);
    replayed.map_err(|error| error.to_string())
}

#[test]
fn locks_meet_edits_as_they_are_said_to() {
    let original = fate(&folder().join("original.wgsl")).expect("the lock is of this shader");
    let mut goldens = Goldens::of("edits");
    for path in fixtures::shaders("testdata/locks") {
        let said = match fate(&path) {
            Ok(levels) => {
                for (level, wanted) in levels.iter().zip(&original) {
                    let same = level.shader.fingerprint() == wanted.shader.fingerprint();
                    assert!(same, "{}: another level", path.display());
                }
                assert_eq!(levels.len(), original.len());
                "replayed to the same levels\n".to_owned()
            }
            Err(said) => said,
        };
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        goldens.compare(&name, &path.with_extension("fate"), &said);
    }
    goldens.finish();
}
