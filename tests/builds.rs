//! Build systems that run lodc: Ninja by `tests/ninja/build.ninja`, Make by a depfile, and many shaders in one call.
//!
//! Ninja comes from `.ci/run`. Where it is missing its test says `SKIPPED` aloud, and fails when `CI` is set.
#![cfg(feature = "cli")]

mod numbered;
mod synthetic;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant, SystemTime};

/// An empty folder of a test's own.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("builds")
        .join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a folder can be made");
    folder
}

/// What a program says, and how it ends.
fn run(program: &str, folder: &Path, arguments: &[&str]) -> (Option<i32>, String, String) {
    let output = Command::new(program)
        .args(arguments)
        .current_dir(folder)
        .output();
    let output = output.unwrap_or_else(|error| panic!("{program}: {error}"));
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("it says text");
    (
        output.status.code(),
        text(output.stdout),
        text(output.stderr),
    )
}

const LODC: &str = env!("CARGO_BIN_EXE_lodc");

/// Whether a program is there; where it is not, that is said, and in CI it is a failure.
fn is_there(program: &str) -> bool {
    if Command::new(program).arg("--version").output().is_ok() {
        return true;
    }
    let missing = format!("{program} is missing; .ci/run installs it");
    assert!(std::env::var_os("CI").is_none(), "{missing}");
    println!("SKIPPED: {missing}");
    false
}

/// When each of the outputs was written.
fn times(folder: &Path) -> BTreeMap<PathBuf, SystemTime> {
    let entries = fs::read_dir(folder.join("out")).expect("there are outputs");
    let paths = entries.map(|entry| entry.expect("a readable folder").path());
    paths
        .map(|path| {
            let known = fs::metadata(&path).expect("it is there");
            (path, known.modified().expect("it has a time"))
        })
        .collect()
}

/// Writes a file when clocks have moved on, so that its time is after that of all others.
fn touch(path: &Path, contents: &str) {
    std::thread::sleep(Duration::from_millis(30));
    fs::write(path, contents).expect("it can be written");
}

/// A copy of a numbered material under another name, with its lock.
fn called(folder: &Path, number: usize, name: &str) {
    let shader = folder.join(name);
    fs::write(&shader, numbered::material(number)).expect("it can be written");
    let lock = numbered::lock(&shader);
    fs::write(shader.with_extension("lod.toml"), lock).expect("it can be written");
}

#[test]
fn ninja_builds_what_has_changed_and_nothing_else() {
    if !is_there("ninja") {
        return;
    }
    let folder = folder("ninja");
    let rules = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/ninja/build.ninja");
    let rules = fs::read_to_string(rules).expect("the rules are there");
    let tool = LODC
        .replace('$', "$$")
        .replace(' ', "$ ")
        .replace(':', "$:");
    let with_tool = rules.replace("\nlodc = lodc\n", &format!("\nlodc = \"{tool}\"\n"));
    assert_ne!(rules, with_tool);
    fs::write(folder.join("build.ninja"), with_tool).expect("it can be written");
    numbered::write(&folder, 0);
    numbered::write(&folder, 1);
    called(&folder, 2, "two words.wgsl");
    let ninja = || {
        let (code, out, error) = run("ninja", &folder, &[]);
        assert_eq!(code, Some(0), "{out}{error}");
        out
    };
    assert!(ninja().contains("[4/4] pack out/all.pack"));
    assert!(folder.join("out/two words.lod.wgsl").exists());
    assert!(ninja().contains("no work to do"));

    // The same once more: it is built, and nothing comes of it.
    let before = times(&folder);
    touch(&folder.join("m0.wgsl"), &numbered::material(0));
    let said = ninja();
    assert!(said.contains("lodc m0.wgsl"), "{said}");
    assert!(
        !said.contains("m1.wgsl") && !said.contains("pack"),
        "{said}"
    );
    assert_eq!(times(&folder), before);
    assert!(ninja().contains("no work to do"));

    // Another text, and a lock that says something else: of each, its own output and what is made of that.
    let other = numbered::material(1).replace("// Material 1.", "// Another comment.");
    touch(&folder.join("m1.wgsl"), &other);
    let said = ninja();
    assert!(
        said.contains("lodc m1.wgsl") && said.contains("pack"),
        "{said}"
    );
    assert!(
        !said.contains("m0.wgsl") && !said.contains("two words"),
        "{said}"
    );
    let lock = folder.join("two words.lod.toml");
    let text = fs::read_to_string(&lock).expect("it is there");
    touch(&lock, &text.replace("autolod = 2.0", "autolod = 2.5"));
    let said = ninja();
    assert!(
        said.contains("lodc 'two words.wgsl'") && said.contains("pack"),
        "{said}"
    );
    assert!(
        !said.contains("m0.wgsl") && !said.contains("m1.wgsl"),
        "{said}"
    );
    let packed = fs::read_to_string(folder.join("out/all.pack")).expect("it is there");
    assert!(packed.contains("// Another comment.") && packed.contains("autoLOD >= 2.5"));
    assert!(ninja().contains("no work to do"));
}

#[test]
fn make_and_ninja_read_names_that_are_hard_to_say() {
    let names = [
        "plain",
        "two  words",
        "cost$5",
        "a#1",
        "back\\slash",
        "colon:ed",
        "a\\ b",
    ];
    for (tool, name) in ["make", "ninja"]
        .into_iter()
        .flat_map(|tool| names.map(|name| (tool, name)))
    {
        if !is_there(tool) || cfg!(windows) {
            continue;
        }
        let folder = folder("names");
        called(&folder, 3, &format!("{name}.wgsl"));
        let command = format!("'{LODC}' -q --locked '{name}.wgsl' -o out.lod.wgsl --depfile out.d");
        match tool {
            "make" => {
                let command = command.replace('$', "$$");
                let rules = format!("out.lod.wgsl:\n\t{command}\n-include out.d\n");
                fs::write(folder.join("Makefile"), rules).expect("written");
            }
            _ => {
                let command = command.replace('$', "$$");
                let rules = format!(
                    "rule lodc\n  command = {command}\n  depfile = out.d\n  deps = gcc\nbuild out.lod.wgsl: lodc\n"
                );
                fs::write(folder.join("build.ninja"), rules).expect("written");
            }
        }
        let built = || {
            let (code, out, error) = run(tool, &folder, &[]);
            assert_eq!(code, Some(0), "{tool}, {name}: {out}{error}");
            out.contains("--locked") || out.contains("[1/1]")
        };
        assert!(built(), "{tool}, {name}");
        assert!(!built(), "{tool}, {name}: twice");
        touch(
            &folder.join(format!("{name}.wgsl")),
            &format!("// New.\n{}", numbered::material(3)),
        );
        assert!(built(), "{tool}, {name}: after a change");
    }
}

#[test]
fn a_depfile_names_what_matters() {
    let folder = folder("depfile");
    numbered::write(&folder, 0);
    numbered::write(&folder, 1);
    let args = [
        "-q",
        "--locked",
        "m0.wgsl",
        "m1.wgsl",
        "-o",
        "out",
        "--depfile",
        "out/all.d",
    ];
    assert_eq!(
        run(LODC, &folder, &args),
        (Some(0), String::new(), String::new())
    );
    let rules = fs::read_to_string(folder.join("out/all.d")).expect("it is written");
    let rule = |name| format!("out/{name}.lod.wgsl: \\\n  {name}.wgsl \\\n  {name}.lod.toml\n");
    assert_eq!(rules, rule("m0") + &rule("m1"));
}

#[test]
fn many_in_one_call_are_as_one_by_one_and_errors_stop_nothing() {
    let folder = folder("many");
    let count = 24;
    let names: Vec<String> = (0..count).map(|number| format!("m{number}.wgsl")).collect();
    for number in 0..count {
        numbered::write(&folder, number);
    }
    let outputs = || {
        let name = |number| folder.join(format!("m{number}.lod.wgsl"));
        let files = (0..count).map(|number| fs::read(name(number)).ok());
        files.collect::<Vec<_>>()
    };
    for name in &names {
        assert_eq!(run(LODC, &folder, &["-q", "--locked", name]).0, Some(0));
    }
    let alone = outputs();
    assert!(alone.iter().all(Option::is_some));
    for number in 0..count {
        fs::remove_file(folder.join(format!("m{number}.lod.wgsl"))).expect("it is there");
    }
    // One that is no shader, and one without a lock.
    fs::write(folder.join("m5.wgsl"), "fn {").expect("it can be written");
    fs::remove_file(folder.join("m7.lod.toml")).expect("it is there");
    let mut arguments = vec!["--locked", "-j4"];
    arguments.extend(names.iter().map(String::as_str));
    let (code, out, error) = run(LODC, &folder, &arguments);
    assert_eq!(code, Some(2));
    let told: Vec<&str> = error
        .lines()
        .filter(|line| line.starts_with("error"))
        .collect();
    assert_eq!(told.len(), 2, "{error}");
    assert!(
        told[1].contains("there is no lock `m7.lod.toml`"),
        "{error}"
    );
    let expected = (0..count).filter(|number| ![5, 7].contains(number));
    let expected: Vec<String> = expected
        .map(|n| format!("  wrote           m{n}.lod.wgsl"))
        .collect();
    assert_eq!(out.lines().collect::<Vec<_>>(), expected);
    for (number, (one, all)) in alone.into_iter().zip(outputs()).enumerate() {
        match [5, 7].contains(&number) {
            true => assert_eq!(all, None),
            false => assert_eq!(all, one, "m{number}"),
        }
    }
    let (code, out, _) = run(LODC, &folder, &["--locked", "m0.wgsl"]);
    assert_eq!((code, &*out), (Some(0), "  unchanged       m0.lod.wgsl\n"));
}

#[test]
fn outputs_of_several_do_not_meet() {
    let folder = folder("meet");
    numbered::write(&folder, 0);
    numbered::write(&folder.join("deep"), 0);
    let (code, _, error) = run(
        LODC,
        &folder,
        &["--locked", "m0.wgsl", "deep/m0.wgsl", "-o", "out"],
    );
    assert_eq!(code, Some(2));
    assert!(error.contains("would have the same outputs"), "{error}");
    assert!(!folder.join("out").exists());
    let (code, ..) = run(LODC, &folder, &["--locked", "m0.wgsl", "deep/m0.wgsl"]);
    assert_eq!(code, Some(0));
}

/// How long lodc takes for so many materials of a folder, so many at a time, and the most memory that it has had, in MiB, where the
/// system tells.
fn replayed(folder: &Path, names: &[String], jobs: usize) -> (Duration, Option<f64>) {
    let began = Instant::now();
    let mut child = Command::new(LODC)
        .args(["--locked", "-q", "-o", &format!("out{jobs}")])
        .args(["-j", &jobs.to_string()])
        .args(names)
        .current_dir(folder)
        .spawn()
        .expect("lodc starts");
    let status = Path::new("/proc")
        .join(child.id().to_string())
        .join("status");
    let mut most = None;
    let ended = loop {
        let told = fs::read_to_string(&status).unwrap_or_default();
        let peak = told.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let kib = peak.and_then(|peak| peak.trim().strip_suffix(" kB")?.parse::<f64>().ok());
        most = kib.map(|kib| kib / 1024.0).or(most);
        if let Some(ended) = child.try_wait().expect("it can be waited for") {
            break ended;
        }
        std::thread::sleep(Duration::from_millis(5));
    };
    assert!(ended.success());
    (began.elapsed(), most)
}

#[test]
#[ignore = "a measurement: run it in release"]
fn a_thousand_materials() {
    let folder = folder("thousand");
    let names: Vec<String> = (0..1000).map(|number| format!("m{number}.wgsl")).collect();
    for number in 0..1000 {
        numbered::write(&folder, number);
    }
    for jobs in [1, 2] {
        let (taken, most) = replayed(&folder, &names, jobs);
        let most = most.map_or("unknown".to_owned(), |most| format!("{most:.0} MiB"));
        println!("-j{jobs}: {:.1} s, peak memory {most}", taken.as_secs_f64());
    }
    for number in 0..1000 {
        let [one, two] = [1, 2].map(|jobs| {
            let file = folder.join(format!("out{jobs}/m{number}.lod.wgsl"));
            fs::read(file).expect("it was written")
        });
        assert_eq!(one, two, "m{number}");
    }
}
