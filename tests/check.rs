//! `lodc check` and `lodc::testing`: what is committed is what locks make, or the difference is told.
#![cfg(feature = "cli")]

mod numbered;
mod synthetic;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// An empty folder of a test's own.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("check")
        .join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a folder can be made");
    folder
}

/// What lodc says and how it ends, in a folder.
fn lodc(folder: &Path, arguments: &[&str]) -> (Option<i32>, String, String) {
    let Output {
        status,
        stdout,
        stderr,
    } = Command::new(env!("CARGO_BIN_EXE_lodc"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("lodc starts");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("it says text");
    (status.code(), text(stdout), text(stderr))
}

/// A folder with so many materials and what their locks make.
fn built(name: &str, count: usize) -> PathBuf {
    let folder = folder(name);
    for number in 0..count {
        numbered::write(&folder, number);
    }
    for number in 0..count {
        let made = lodc(&folder, &["--locked", &format!("m{number}.wgsl")]);
        assert_eq!(made.0, Some(0), "{made:?}");
    }
    folder
}

#[test]
fn what_is_as_committed_takes_a_line() {
    let folder = built("same", 3);
    let (code, out, error) = lodc(&folder, &["check", "m0.wgsl"]);
    assert_eq!((code, &*error), (Some(0), ""));
    assert_eq!(out, "  as committed    1 file of 1 shader\n");
    let (code, out, _) = lodc(&folder, &["check", "-j2", "."]);
    assert_eq!(
        (code, &*out),
        (Some(0), "  as committed    3 files of 3 shaders\n")
    );
    let (code, out, _) = lodc(&folder, &["check", "-q", "m0.lod.toml", "m1.wgsl"]);
    assert_eq!((code, &*out), (Some(0), ""));
}

#[test]
fn a_difference_is_a_diff_and_blessing_writes_it() {
    let folder = built("differs", 3);
    let path = folder.join("m1.lod.wgsl");
    let made = fs::read_to_string(&path).expect("it is there");
    let line = made.lines().last().expect("it has lines");
    assert!(made.contains("autoLOD >= 2"), "{made}");
    fs::write(&path, made.replace("autoLOD >= 2", "autoLOD >= 2.5")).expect("it can be written");
    fs::remove_file(folder.join("m2.lod.wgsl")).expect("it is there");
    let (code, out, error) = lodc(&folder, &["check", "m0.wgsl", "m1.wgsl", "m2.wgsl"]);
    assert_eq!((code, &*error), (Some(1), ""));
    assert!(
        out.starts_with("--- m1.lod.wgsl\n+++ m1.lod.wgsl\n@@ "),
        "{out}"
    );
    assert!(out.contains("\n-    if !(autoLOD >= 2.5"), "{out}");
    assert!(out.contains("\n+    if !(autoLOD >= 2"), "{out}");
    assert!(out.ends_with("m2.lod.wgsl: is missing\n"), "{out}");
    assert!(!out.contains(&format!("-{line}")), "{out}");
    let (code, out, _) = lodc(&folder, &["check", "--bless", "."]);
    assert_eq!(
        (code, &*out),
        (Some(0), "  wrote           2 of 3 files, of 3 shaders\n")
    );
    assert_eq!(fs::read_to_string(&path).expect("it is there"), made);
    assert_eq!(lodc(&folder, &["check", "."]).0, Some(0));
}

#[test]
fn files_of_levels_that_are_gone_are_named() {
    let folder = built("left", 1);
    let made = lodc(&folder, &["--locked", "--form", "files", "m0.wgsl"]);
    assert_eq!(made.0, Some(0), "{made:?}");
    let files = ["check", "--form", "files", "m0.wgsl"];
    assert_eq!(lodc(&folder, &files).0, Some(0));
    fs::create_dir_all(folder.join("m0.lod")).expect("it can be made");
    // Neither a level's nor of this material: nobody's affair.
    for name in ["m0.lod9.txt", "m0.lodged.wgsl", "m01.lod9.wgsl"] {
        fs::write(folder.join(name), "").expect("it can be written");
    }
    assert_eq!(lodc(&folder, &files).0, Some(0));
    let left = ["m0.lod/old.png", "m0.lod9.wgsl"];
    for name in left {
        fs::write(folder.join(name), "").expect("it can be written");
    }
    let says = |name| format!("{name}: is left over: no level of the lock has it, delete it\n");
    let expected = left.map(says).concat();
    let (code, out, error) = lodc(&folder, &files);
    assert_eq!((code, &*out, &*error), (Some(1), &*expected, ""));
    // Nothing is deleted but by a person.
    let (code, out, _) = lodc(&folder, &[&files[..], &["--bless"]].concat());
    assert_eq!((code, out), (Some(1), expected));
    // A shader in one file has no others, and may stand beside those of another form.
    let (code, out, _) = lodc(&folder, &["check", "m0.wgsl"]);
    assert_eq!((code, out), (Some(1), says(left[0])));
}

#[test]
fn a_stale_lock_fails_the_check_and_bad_input_is_worse() {
    let folder = built("stale", 2);
    let path = folder.join("m0.wgsl");
    let source = fs::read_to_string(&path).expect("it is there");
    // A comment changes the output's text, and nothing else.
    fs::write(&path, format!("{source}// More.\n")).expect("it can be written");
    let (code, out, _) = lodc(&folder, &["check", "m0.wgsl"]);
    assert_eq!(code, Some(1));
    assert!(out.contains("+// More.\n"), "{out}");
    fs::write(&path, source.replace("* 0.1", "* 0.2")).expect("it can be written");
    let (code, out, error) = lodc(&folder, &["check", "."]);
    assert_eq!((code, &*out), (Some(1), ""));
    assert!(error.contains("the lock is stale"), "{error}");
    let (code, _, error) = lodc(&folder, &["check", "m0.wgsl", "nowhere.wgsl", "m1.wgsl"]);
    assert_eq!(code, Some(2));
    assert!(
        error.contains("there is no lock `nowhere.lod.toml`"),
        "{error}"
    );
}

#[test]
fn a_lock_may_be_apart_from_its_source() {
    let folder = built("apart", 1);
    fs::create_dir_all(folder.join("out")).expect("it can be made");
    let lock = fs::read_to_string(folder.join("m0.lod.toml")).expect("it is there");
    let lock = lock.replace("file = \"m0.wgsl\"", "file = \"../m0.wgsl\"");
    fs::write(folder.join("out/other.lod.toml"), lock).expect("it can be written");
    let (code, out, error) = lodc(&folder, &["check", "--bless", "out"]);
    assert_eq!((code, &*error), (Some(0), ""), "{out}");
    assert!(folder.join("out/other.lod.wgsl").exists());
    let args = ["check", "m0.wgsl", "-o", "out/other.lod.wgsl"];
    assert_eq!(lodc(&folder, &args).0, Some(0));
    // With a lock that lies elsewhere.
    let args = [
        "--locked",
        "--lock",
        "out/other.lod.toml",
        "m0.wgsl",
        "-o",
        "deep/x.wgsl",
    ];
    assert_eq!(lodc(&folder, &args).0, Some(0));
    let [made, same] =
        ["out/other.lod.wgsl", "deep/x.wgsl"].map(|name| fs::read(folder.join(name)));
    assert_eq!(made.expect("it is there"), same.expect("it is there"));
}

#[test]
fn what_is_committed_here_is_what_its_locks_make() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (code, out, error) = lodc(folder, &["check", "-j2", "testdata/emitted"]);
    assert_eq!((code, &*error), (Some(0), ""), "{out}");
    assert_eq!(out, "  as committed    3 files of 2 shaders\n");
}

/// The variable that names the file of [`asserts`].
const FILE: &str = "LODC_TEST_FILE";

#[test]
#[ignore = "run by the test below, which names a file"]
fn asserts() {
    lodc::testing::assert_emitted(std::env::var_os(FILE).expect("a file is named"));
}

#[test]
fn an_assertion_tells_the_diff_and_how_to_bless() {
    let folder = built("asserted", 1);
    let path = folder.join("m0.lod.wgsl");
    let made = fs::read_to_string(&path).expect("it is there");
    let assert = |shader: &str, bless: &str| {
        let output = Command::new(std::env::current_exe().expect("the test has a file"))
            .args(["--exact", "asserts", "--ignored", "--nocapture"])
            .current_dir(&folder)
            .env(FILE, shader)
            .env("LODC_BLESS", bless)
            .output();
        let output = output.expect("the test starts");
        let error = String::from_utf8(output.stderr).expect("it says text");
        (output.status.success(), error)
    };
    assert!(assert("m0.wgsl", "").0);
    fs::write(&path, made.replace("// Material 0.", "// Mine.")).expect("it can be written");
    let (passed, error) = assert("m0.wgsl", "0");
    assert!(
        !passed && error.contains("\n-// Mine.\n+// Material 0.\n"),
        "{error}"
    );
    assert!(error.contains("lodc check --bless m0.wgsl"), "{error}");
    assert!(!assert("m0.lod.toml", "").0);
    assert!(assert("m0.wgsl", "1").0);
    assert_eq!(fs::read_to_string(&path).expect("it is there"), made);
    let (passed, error) = assert("m1.wgsl", "1");
    assert!(
        !passed && error.contains("there is no lock `m1.lod.toml`"),
        "{error}"
    );
}
