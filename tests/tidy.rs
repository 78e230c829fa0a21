//! Tests about the repository itself: one name for everything that belongs to a pass, and house rules.

use lodc_passes::all_passes;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The files under the folders that people write in, sorted, as paths relative to the root.
fn files() -> Vec<PathBuf> {
    fn walk(folder: &Path, found: &mut Vec<PathBuf>) {
        let Ok(entries) = fs::read_dir(folder) else {
            return;
        };
        for entry in entries.flatten() {
            let path = entry.path();
            if !path.is_dir() {
                found.push(path);
            } else if entry.file_name() != "node_modules" && entry.file_name() != "target" {
                walk(&path, found);
            }
        }
    }
    let mut found = Vec::new();
    for folder in [
        ".ci", "benches", "examples", "joint", "machine", "mesh", "passes", "src", "testdata",
        "tests",
    ] {
        walk(&root().join(folder), &mut found);
    }
    for file in ["Cargo.toml", "README.md", ".gitignore"] {
        found.push(root().join(file));
    }
    let mut relative: Vec<PathBuf> = found
        .into_iter()
        .filter_map(|path| Some(path.strip_prefix(root()).ok()?.to_owned()))
        .collect();
    relative.sort();
    relative
}

/// The text of a file; `None` for one that is no text.
fn text(path: &Path) -> Option<String> {
    String::from_utf8(fs::read(root().join(path)).expect("a listed file can be read")).ok()
}

fn with_extension<'a>(files: &'a [PathBuf], wanted: &'a str) -> impl Iterator<Item = &'a PathBuf> {
    files
        .iter()
        .filter(move |path| path.extension().is_some_and(|e| e == wanted))
}

fn stem(path: &Path) -> &str {
    path.file_stem().and_then(|s| s.to_str()).unwrap_or("")
}

/// The fixtures of the passes, and of the normal form that they start from.
fn fixtures(files: &[PathBuf]) -> impl Iterator<Item = &PathBuf> {
    with_extension(files, "wgsl").filter(|path| path.starts_with("testdata/passes"))
}

#[test]
fn a_pass_its_file_its_struct_and_its_fixtures_share_one_name() {
    let files = files();
    let mut folders: BTreeSet<&str> = fixtures(&files)
        .filter_map(|path| path.parent()?.file_name()?.to_str())
        .collect();
    for pass in all_passes() {
        let name = pass.name();
        let module = name.replace('-', "_");
        let file = [
            format!("passes/src/{module}.rs"),
            format!("passes/src/{module}/mod.rs"),
        ];
        let source = file
            .iter()
            .find_map(|file| fs::read_to_string(root().join(file)).ok())
            .unwrap_or_else(|| panic!("pass `{name}` is in neither of {file:?}"));
        let structure: String = name
            .split('-')
            .map(|word| word[..1].to_uppercase() + &word[1..])
            .collect();
        assert!(
            source.contains(&format!("pub struct {structure};")),
            "{name} has no struct {structure}"
        );
        for part in [
            &format!("//! {name}: "),
            "//! Precondition. ",
            "//! Effect. ",
            "//! Error. ",
            "//! Declines.",
            "//! This work is based on:",
        ] {
            assert!(source.contains(part), "{name}'s header has no `{part}`");
        }
        assert!(folders.remove(name), "{name} has no fixtures");
        for prefixes in [&["keeps_"][..], &["drops_", "moves_"]] {
            assert!(
                fixtures(&files).any(|path| {
                    path.parent().is_some_and(|folder| folder.ends_with(name))
                        && prefixes.iter().any(|prefix| stem(path).starts_with(prefix))
                }),
                "{name} has no fixture {prefixes:?}"
            );
        }
    }
    folders.remove("normalize");
    assert!(folders.is_empty(), "fixtures of no pass: {folders:?}");
    let names: BTreeSet<_> = all_passes().map(|pass| pass.name()).collect();
    assert_eq!(names.len(), all_passes().count(), "two passes share a name");
}

#[test]
fn fixtures_say_what_happens_and_are_small() {
    let files = files();
    for path in fixtures(&files) {
        let name = stem(path);
        let lines = text(path).map_or(0, |text| text.lines().count());
        assert!(lines <= 25, "{} has {lines} lines", path.display());
        let is_of_pass = path
            .parent()
            .is_some_and(|folder| !folder.ends_with("normalize"));
        let says = ["keeps_", "drops_", "moves_"];
        assert!(
            !is_of_pass || says.iter().any(|prefix| name.starts_with(prefix)),
            "{} starts with neither keeps_ nor drops_ nor moves_",
            path.display()
        );
        assert!(
            root().join(path.with_extension("diff")).exists(),
            "{} has no golden",
            path.display()
        );
    }
    for path in with_extension(&files, "diff") {
        assert!(
            root().join(path.with_extension("wgsl")).exists(),
            "{} is the golden of nothing",
            path.display()
        );
    }
}

#[test]
fn the_manual_lists_the_passes() {
    let readme = text(Path::new("README.md")).expect("README.md is text");
    let rows: Vec<&str> = readme
        .lines()
        .skip_while(|line| !line.starts_with("| pass |"))
        .skip(2)
        .take_while(|line| line.starts_with('|'))
        .filter_map(|line| line.split('|').nth(1))
        .map(|cell| cell.trim().trim_matches('`'))
        .collect();
    let names: Vec<&str> = all_passes().map(|pass| pass.name()).collect();
    assert_eq!(rows, names, "README.md's table that starts with `| pass |`");
}

#[test]
fn only_the_gpu_folder_names_its_library() {
    let files = files();
    for path in with_extension(&files, "rs") {
        if path.starts_with("src/gpu") || !(path.starts_with("src") || path.starts_with("passes")) {
            continue;
        }
        let source = text(path).expect("sources are text");
        for (number, line) in source.lines().enumerate() {
            let code = line.split("//").next().unwrap_or("");
            assert!(
                !code.contains("wgpu"),
                "{}:{} names wgpu",
                path.display(),
                number + 1
            );
        }
    }
}

#[test]
fn nothing_names_a_place_on_somebodys_machine() {
    // Put together here, so that this file may hold them.
    let places = ["home", "tmp", "work", "root", "Users"].map(|folder| format!("/{folder}/"));
    for path in files() {
        let Some(content) = text(&path) else {
            continue;
        };
        for (number, line) in content.lines().enumerate() {
            for place in &places {
                let named = line.match_indices(place.as_str()).any(|(at, _)| {
                    // A folder of that name inside another is nobody's home.
                    !line[..at].ends_with(|before: char| {
                        before.is_alphanumeric() || "._-}".contains(before)
                    })
                });
                assert!(!named, "{}:{} names {place}", path.display(), number + 1);
            }
        }
    }
}

#[test]
fn sources_open_with_their_subject() {
    let files = files();
    for path in with_extension(&files, "rs") {
        let source = text(path).expect("sources are text");
        let first = source.lines().next().unwrap_or("");
        // What lodc writes is included into other files, which may not have comments of their own kind there.
        let is_written = path.to_string_lossy().ends_with(".lod.rs");
        let opens = if is_written { "// " } else { "//! " };
        assert!(
            first.starts_with(opens) && first.len() > 20,
            "{} does not open with what it is about",
            path.display()
        );
    }
}
