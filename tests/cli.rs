//! Bad input at the command line: a located message, exit code 2, and no file touched; and what shells complete.
//!
//! Every `testdata/errors/<case>` is one run in a copy of that folder. Its arguments are the first line of
//! `<case>.args`; without one they are `<case>.wgsl`, or, when there is only a `<case>.toml`,
//! `support/plain.wgsl --scene <case>.toml`. What it says on stderr is `<case>.stderr`; `LODC_BLESS=1` rewrites that.
#![cfg(feature = "cli")]

mod fixtures;

use fixtures::Goldens;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Every file below a folder with its bytes, by its path from there.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut waiting = vec![folder.to_owned()];
    while let Some(here) = waiting.pop() {
        for entry in fs::read_dir(&here).expect("a readable folder") {
            let path = entry.expect("a readable folder").path();
            if path.is_dir() {
                waiting.push(path);
            } else {
                let inside = path.strip_prefix(folder).expect("below the folder");
                found.insert(inside.to_owned(), fs::read(&path).expect("a readable file"));
            }
        }
    }
    found
}

fn write(folder: &Path, files: &BTreeMap<PathBuf, Vec<u8>>) {
    for (path, bytes) in files {
        let path = folder.join(path);
        fs::create_dir_all(path.parent().expect("below the folder")).expect("a writable folder");
        fs::write(path, bytes).expect("a writable folder");
    }
}

/// The cases: names of the files that start one.
fn cases(files: &BTreeMap<PathBuf, Vec<u8>>) -> BTreeSet<String> {
    files
        .keys()
        .filter_map(|path| path.to_str())
        .filter_map(|path| path.rsplit_once('.'))
        .filter(|(stem, extension)| {
            ["wgsl", "toml", "args"].contains(extension) && !stem.contains(['/', '.'])
        })
        .map(|(stem, _)| stem.to_owned())
        .collect()
}

fn arguments(case: &str, files: &BTreeMap<PathBuf, Vec<u8>>) -> Vec<String> {
    let file = |extension: &str| files.get(&PathBuf::from(format!("{case}.{extension}")));
    if let Some(line) = file("args") {
        let line = String::from_utf8_lossy(line);
        return line.split_whitespace().map(str::to_owned).collect();
    }
    if file("wgsl").is_some() {
        return vec![format!("{case}.wgsl")];
    }
    ["support/plain.wgsl", "--scene", &format!("{case}.toml")]
        .map(str::to_owned)
        .to_vec()
}

#[test]
fn bad_input_is_located_and_loses_nothing() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata/errors");
    let before = files(&folder);
    let scratch = Path::new(env!("CARGO_TARGET_TMPDIR")).join("errors");
    let cases = cases(&before);
    let mut goldens = Goldens::of("cli");
    for case in &cases {
        if case.starts_with("imports_") && !cfg!(feature = "imports") {
            continue;
        }
        // A fresh copy, so that a case that writes does not disturb the others.
        let _ = fs::remove_dir_all(&scratch);
        write(&scratch, &before);
        let arguments = arguments(case, &before);
        let output = Command::new(env!("CARGO_BIN_EXE_lodc"))
            .args(&arguments)
            .current_dir(&scratch)
            .env_remove("RUST_BACKTRACE")
            .env("COLUMNS", "100")
            .output()
            .expect("lodc starts");
        let command = format!("(cd testdata/errors && lodc {})", arguments.join(" "));
        if output.status.code() != Some(2) {
            goldens.wrong(format!("{case}: {}, not 2: {command}", output.status));
        }
        let after = files(&scratch);
        for path in after.keys().chain(before.keys()).collect::<BTreeSet<_>>() {
            if after.get(path) != before.get(path) {
                goldens.wrong(format!("{case}: touched {}: {command}", path.display()));
            }
        }
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        if stderr.trim().is_empty() || stderr.contains("panicked") {
            goldens.wrong(format!("{case}: says `{stderr}`: {command}"));
            continue;
        }
        let golden = folder.join(format!("{case}.stderr"));
        goldens.compare(&format!("{case}: {command}"), &golden, &stderr);
    }
    for orphan in before
        .keys()
        .filter(|path| path.extension().is_some_and(|e| e == "stderr"))
        .filter_map(|path| path.file_stem()?.to_str())
        .filter(|stem| !cases.contains(*stem))
    {
        goldens.wrong(format!("{orphan}.stderr belongs to no case"));
    }
    goldens.finish();
}

#[test]
fn completions_name_the_commands_that_are_for_people() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let said = Command::new(env!("CARGO_BIN_EXE_lodc"))
            .args(["completions", shell])
            .output()
            .expect("lodc starts");
        assert!(said.status.success(), "{shell}");
        let script = String::from_utf8(said.stdout).expect("a script is text");
        assert!(script.contains("snapshot"), "{shell}");
        assert!(!script.contains("gpu-worker"), "{shell}");
    }
}
