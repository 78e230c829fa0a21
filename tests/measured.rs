//! A search by measured run times, as a person runs it: recorded, replayed, kept, killed, and without an adapter.
//!
//! Nothing here says how long anything takes: only where times come from, and what is made of them.
#![cfg(all(feature = "gpu", feature = "cli"))]

mod fixtures;
mod pictures;

use lodc::time::store::Recording;
use pictures::open;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

const SHADER: &str = "
@group(0) @binding(0) var<uniform> time: f32;
@fragment fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    var noise = 0.0;
    for (var i = 1; i < 200; i++) {
        noise += sin(uv.x * f32(i) + time) * cos(uv.y * f32(2 * i)) / f32(i * i);
    }
    let rim = pow(uv.x, 4.0) + 0.2 * uv.y;
    let glow = exp(uv.y) * 0.1 + noise * 0.02;
    return vec4f(rim, glow, uv.x * 0.1 + 0.4, 1.0);
}";

const SCENE: &str = "resolution = [64, 64]
levels = 3
offsets = 1
object = \"plane\"
[views]
directions = [[0, 1, 0.3], [0.3, 1, 1]]
[uniforms]
time = 1.0
";

/// A shader with its scene in a folder of its own.
struct Place(PathBuf);

impl Place {
    fn new(name: &str) -> Self {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("measured-{name}"));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).expect("the target folder can be written");
        fs::write(folder.join("a.wgsl"), SHADER).expect("it can be written");
        fs::write(folder.join("a.toml"), SCENE).expect("it can be written");
        Self(folder)
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_lodc"));
        command
            .current_dir(&self.0)
            .env("LODC_CACHE", self.0.join("cache"))
            .args(["a.wgsl", "--time-budget", "0.1"])
            .args(arguments);
        command
    }

    fn measured(&self, arguments: &[&str]) -> Output {
        let fixed = ["--time", "measured", "--adapter", "vulkan"];
        let all: Vec<&str> = fixed.into_iter().chain(arguments.iter().copied()).collect();
        let output = self.command(&all).output().expect("lodc starts");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{said}");
        output
    }

    fn read(&self, file: &str) -> String {
        fs::read_to_string(self.0.join(file)).unwrap_or_else(|e| panic!("{file}: {e}"))
    }

    fn report(&self) -> Value {
        serde_json::from_str(&self.read("a.lod.json")).expect("it is JSON")
    }

    /// How many timings were taken and how many were found, as the terminal says it.
    fn counts(output: &Output) -> [usize; 2] {
        let said = String::from_utf8_lossy(&output.stdout);
        let line = said
            .lines()
            .find(|line| line.trim_start().starts_with("timings"));
        let line = line.unwrap_or_else(|| panic!("{said}"));
        let words: Vec<&str> = line.split_whitespace().collect();
        let before = |word: &str| {
            let at = words.iter().position(|w| w.trim_end_matches(',') == word);
            let count = at.and_then(|at| words[at - 1].parse().ok());
            count.unwrap_or_else(|| panic!("{line}"))
        };
        [before("taken"), before("found")]
    }
}

#[test]
fn pairs_of_meshes_and_shaders_are_timed_recorded_and_replayed() {
    if open("vulkan").is_none() {
        return;
    }
    let place = Place::new("pairs");
    let scene = SCENE.replace("plane", "torus-knot");
    let scene = scene.replace("levels = 3", "levels = 2");
    fs::write(place.0.join("a.toml"), scene).expect("it can be written");
    let few = ["--search", "separate", "--meshes", "4", "--shaders", "4"];
    let few = [&few[..], &["--mesh-views", "6"]].concat();
    place.measured(&[&few[..], &["--record", "times.json"]].concat());
    let all = ["a.lod.wgsl", "a.lod.toml", "a.lod/a.meshes.toml"];
    let written = all.map(|file| place.read(file));
    let report = place.report();
    let levels = report["levels"].as_array().expect("it has levels");
    let simpler = levels
        .iter()
        .skip(1)
        .filter(|level| !level["mesh"]["file"].is_null());
    assert!(simpler.count() > 0, "{levels:?}");
    for level in &levels[1..] {
        assert_eq!(level["time"]["kind"], "measured", "{level}");
    }
    // A mesh that is simpler takes its own time, and the branch of a shader is timed on one mesh only.
    assert!(levels[1]["time"]["branching"].is_null(), "{levels:?}");
    let mut command = Command::new(env!("CARGO_BIN_EXE_lodc"));
    let command = command.current_dir(&place.0).arg("a.wgsl").args(&few);
    let output = command.args(["--recordings", "times.json"]).output();
    assert!(output.expect("lodc starts").status.success());
    assert_eq!(all.map(|file| place.read(file)), written);
    assert_eq!(place.report()["levels"], report["levels"]);
}

#[test]
fn a_search_is_recorded_and_replayed_to_the_same_bytes() {
    if open("vulkan").is_none() {
        return;
    }
    let place = Place::new("recorded");
    place.measured(&["--record", "times.json"]);
    let written = ["a.lod.wgsl", "a.lod.toml"].map(|file| place.read(file));
    let report = place.report();
    let recording = Recording::read(&place.0.join("times.json")).expect("it was written");
    assert!(recording.timings.len() > 3, "{}", recording.timings.len());
    assert!(report["timed"].as_u64() > Some(0), "{report}");
    fs::remove_dir_all(place.0.join("cache")).expect("it was kept");
    let replayed = |files: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_lodc"));
        let command = command.current_dir(&place.0).arg("a.wgsl");
        let output = command.args(files).output().expect("lodc starts");
        assert!(output.status.success(), "{output:?}");
        ["a.lod.wgsl", "a.lod.toml"].map(|file| place.read(file))
    };
    assert_eq!(replayed(&["--recordings", "times.json"]), written);
    assert_eq!(place.report()["levels"], report["levels"]);
    assert!(!place.0.join("cache").exists());

    // On a quiet adapter, whatever this one is: all variants take a third of the original's time.
    let make = |name: &str, ratio: f64| {
        let mut recording = recording.clone();
        recording.adapter = name.into();
        for timing in recording.timings.values_mut() {
            (timing.ratio, timing.low, timing.high) = (ratio, ratio - 0.01, ratio + 0.01);
            timing.floor = 0.01;
            timing.warnings.clear();
        }
        recording
    };
    let recording = make("one", 0.3);
    for recording in [&recording, &make("another", 0.4)] {
        let file = place.0.join(format!("{}.json", recording.adapter));
        fs::write(file, recording.json()).expect("it can be written");
    }
    let [shader, lock] = replayed(&["--recordings", "one.json"]);
    let time = place.report()["levels"][1]["time"].clone();
    assert_eq!(time["kind"], "measured");
    assert_eq!(time["adapter"], "one");
    assert_eq!(time["verdict"], "faster");
    assert_eq!(
        [&time["low"], &time["ratio"], &time["high"]],
        [0.29, 0.3, 0.31]
    );
    assert!(
        lock.contains("timed_on = [\"one\"]") && lock.contains("time = 0.3"),
        "{lock}"
    );
    assert!(shader.contains("cost  time  what changed"), "{shader}");
    // From the lock alone.
    assert_eq!(replayed(&["--locked"]), [shader, lock]);
    // Of two adapters, the one where a level is worst is in front.
    replayed(&["--recordings", "one.json", "another.json"]);
    let time = place.report()["levels"][1]["time"].clone();
    assert_eq!(time["adapter"], "another");
    assert_eq!(time["others"][0]["adapter"], "one");
}

#[test]
fn what_was_timed_is_not_timed_again() {
    if open("vulkan").is_none() {
        return;
    }
    let place = Place::new("kept");
    let [taken, _] = Place::counts(&place.measured(&[]));
    assert!(taken > 3);
    let shader = place.read("a.lod.wgsl");
    assert_eq!(Place::counts(&place.measured(&[]))[0], 0);
    assert_eq!(place.read("a.lod.wgsl"), shader);
    assert!(Place::counts(&place.measured(&["--no-cache"]))[0] > 3);
}

#[test]
fn twenty_kills_leave_whole_timings_and_the_next_run_goes_on() {
    if open("vulkan").is_none() {
        return;
    }
    let place = Place::new("killed");
    let scene = SCENE.replace("levels = 3", "levels = 2");
    fs::write(place.0.join("a.toml"), scene).expect("it can be written");
    let cache = place.0.join("cache");
    let kept = || -> usize {
        let mut whole = 0;
        let folders = fs::read_dir(cache.join("times"))
            .into_iter()
            .flatten()
            .flatten();
        for file in folders.flat_map(|folder| fs::read_dir(folder.path()).into_iter().flatten()) {
            let path = file.expect("a readable folder").path();
            if path
                .extension()
                .is_some_and(|extension| extension == "json")
            {
                let text = fs::read(&path).expect("a readable file");
                let timing: Result<lodc::time::Timing, _> = serde_json::from_slice(&text);
                timing.unwrap_or_else(|e| panic!("{}: {e}", path.display()));
                whole += 1;
            }
        }
        whole
    };
    // A seeded generator: of moments after the start, or after something was kept, when most is written.
    let mut state = 0x2545_f491_u32;
    for turn in 0..20 {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        let before = kept();
        let mut child = place
            .command(&["--time", "measured", "--adapter", "vulkan"])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("lodc starts");
        let ended = |child: &mut Child| !matches!(child.try_wait(), Ok(None));
        while turn % 2 == 0 && kept() == before && !ended(&mut child) {
            std::thread::sleep(Duration::from_millis(5));
        }
        std::thread::sleep(Duration::from_millis(u64::from(state % 500)));
        // It may have come to its end.
        let _ = child.kill();
        let _ = child.wait();
        kept();
    }
    let before = kept();
    let [taken, found] = Place::counts(&place.measured(&[]));
    assert!(before > 0, "no run got as far as to time anything");
    assert!(found > 0, "{before} timings were kept, {taken} were taken");
}

#[test]
fn without_the_adapter_everything_else_still_works() {
    let place = Place::new("none");
    let mut command = place.command(&["--time", "measured", "--adapter", "Voodoo 2"]);
    let output = command.output().expect("lodc starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    assert!(
        said.contains("nothing was timed, and all times are estimated"),
        "{said}"
    );
    let report = place.report();
    assert_eq!(report["levels"][1]["time"]["kind"], "estimated");
    let warnings = report["warnings"].to_string();
    assert!(warnings.contains("nothing was timed"), "{warnings}");
}
