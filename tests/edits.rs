//! What becomes of a lock when its shader is edited: `testdata/locks/<edit>.wgsl` beside the original's lock.
//!
//! What is said of it is `<edit>.fate`; `LODC_BLESS=1` rewrites that. The manual has the table.

mod fixtures;

use fixtures::Goldens;
use lodc::compile::normal_form;
#[cfg(feature = "search")]
use lodc::compile::{self, Compiled, Request};
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

/// A lamp is brighter than when the lock was made: a search may begin with what is left of the lock, and its own lock is of the shader
/// as it is now.
#[cfg(feature = "search")]
#[test]
fn a_search_begins_with_what_still_applies() {
    let there = Path::new(env!("CARGO_TARGET_TMPDIR")).join("edits");
    std::fs::create_dir_all(&there).expect("the target folder can be written");
    let shader = there.join("original.wgsl");
    let edited = folder().join("changed_constant.wgsl");
    std::fs::copy(edited, &shader).expect("it can be copied");
    let scene = std::fs::read_to_string(folder().join("original.toml")).expect("it is there");
    let materials = folder().with_file_name("materials");
    let scene = scene.replace("../materials", &materials.display().to_string());
    let lock = std::fs::read_to_string(folder().join("original.lod.toml")).expect("it is there");
    let lock = lock.replace("../materials", &materials.display().to_string());
    for (name, text) in [("original.toml", &scene), ("original.lod.toml", &lock)] {
        std::fs::write(there.join(name), text).expect("it can be written");
    }
    let request = |update| Request {
        shader: shader.clone(),
        update,
        ..Request::default()
    };
    assert!(
        compile::locked(&request(false))
            .is_err_and(|error| error.to_string().contains("the lock is stale"))
    );
    let [updated, anew] = [true, false].map(|update| -> Compiled {
        let found = compile::compile(&request(update), &|_| {});
        found.unwrap_or_else(|error| panic!("{error}"))
    });
    let variants = [&updated, &anew].map(|found| found.report.variants);
    assert!(
        variants[0] > variants[1],
        "what is left was not looked at: {variants:?}"
    );
    for found in [updated, anew] {
        assert!(found.report.levels.len() > 2);
        lodc::emit::write_atomically(&found.files).expect("it can be written");
        let (again, _) = compile::locked(&request(false)).unwrap_or_else(|error| panic!("{error}"));
        assert!(again.iter().all(|file| found.files.contains(file)));
    }
}
