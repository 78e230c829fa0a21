//! Meshes with shaders, from the command line: the levels of a ball of clay, their files, and what the report says of the search.
#![cfg(all(feature = "cli", feature = "mesh"))]

use lodc::compile::ModelFile;
use lodc::front::hash;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A folder of its own with the clay, in small pictures; removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str, levels: usize) -> Self {
        let path = std::env::temp_dir().join(format!("lodc-joint-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).unwrap();
        let materials = Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata/materials");
        fs::copy(materials.join("clay.wgsl"), path.join("clay.wgsl")).unwrap();
        let scene = fs::read_to_string(materials.join("clay.toml")).unwrap();
        let small =
            format!("object = \"sphere\"\nresolution = [48, 48]\nlevels = {levels}\noffsets = 2");
        let scene = scene.replace("object = \"sphere\"", &small);
        let scene = scene.replace("count = 4", "count = 3");
        let scene = scene.replace("{ from = 3.0, to = 5.0, count = 2 }", "4.0");
        fs::write(path.join("clay.toml"), scene).unwrap();
        Self(path)
    }

    fn lodc(&self, flags: &[&str]) -> Output {
        let mut lodc = Command::new(env!("CARGO_BIN_EXE_lodc"));
        lodc.current_dir(&self.0).arg("clay.wgsl");
        lodc.args(flags).output().unwrap()
    }

    /// Searches for pairs of few meshes and shaders; the report.
    fn joined(&self, flags: &[&str]) -> Value {
        let few = ["--meshes", "6", "--shaders", "6", "--mesh-views", "6"];
        let done = self.lodc(&[&few, flags].concat());
        let said = String::from_utf8_lossy(&done.stderr).into_owned();
        assert!(done.status.success(), "{said}");
        serde_json::from_slice(&self.read("clay.lod.json")).unwrap()
    }

    fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.0.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn number(of: &Value) -> f64 {
    of.as_f64().unwrap_or_else(|| panic!("{of} is no number"))
}

fn list(of: &Value) -> &[Value] {
    of.as_array().map_or(&[], |list| &list[..])
}

#[test]
fn pairs_become_levels_with_their_meshes() {
    let folder = Folder::new("pairs", 3);
    let report = folder.joined(&["--search", "separate"]);
    let joint = &report["joint"];
    let (k, l) = (number(&joint["meshes"]), number(&joint["shaders"]));
    assert!((2.0..=6.0).contains(&k) && (2.0..=6.0).contains(&l));
    let walked = list(&joint["walked"]);
    assert_eq!(walked.len(), 2);
    for walk in walked {
        assert!(number(&walk["pairs"]) < k + l, "{walk}");
    }
    let j = ["chosen", "paper", "fastest"].map(|of| number(&joint[of]["j"]));
    assert!(j[0] <= j[1] + 1e-9 && j[0] <= j[2] + 1e-9, "{j:?}");
    assert!(j[0] < 1.0, "{j:?}");

    let levels = list(&report["levels"]);
    let whole = levels[0]["mesh"]["triangles"].as_u64().unwrap();
    assert!(levels[0]["mesh"]["file"].is_null() && levels[0]["error"]["transition"].is_null());
    let mut simpler = 0;
    for level in &levels[1..] {
        let error = &level["error"];
        assert!(
            number(&error["excess"]) <= number(&error["bound"]),
            "{error}"
        );
        assert!(number(&error["transition"]) > 0.0, "{error}");
        if !level["mesh"]["file"].is_null() {
            assert!(level["mesh"]["triangles"].as_u64().unwrap() != whole);
            simpler += 1;
        }
    }
    assert!(simpler > 0, "{levels:?}");

    // The lock names the meshes, and they are in the file.
    let lock: toml::Table = String::from_utf8(folder.read("clay.lod.toml"))
        .unwrap()
        .parse()
        .unwrap();
    let meshes = folder.read("clay.lod/clay.glb");
    assert_eq!(
        lock["meshes"]["hash"].as_str(),
        Some(hash(&meshes).as_str())
    );
    let named = lock["mesh"].as_array().unwrap();
    let model = ModelFile::read(&folder.0.join("clay.lod/clay.glb")).unwrap();
    let first = named[0]["triangles"].as_integer();
    assert_eq!(first, i64::try_from(model.mesh.indices.len() / 3).ok());
    let table = String::from_utf8(folder.read("clay.lod/clay.meshes.toml")).unwrap();
    assert_eq!(table.matches("[[level]]").count(), named.len());

    // The lock makes the same shader again.
    let before = folder.read("clay.lod.wgsl");
    assert!(folder.lodc(&["--locked"]).status.success());
    assert!(folder.read("clay.lod.wgsl") == before);

    // It is found again, by one thread alone.
    let files = ["clay.lod.toml", "clay.lod.json", "clay.lod/clay.glb"];
    let found = files.map(|file| folder.read(file));
    let again = Folder::new("again", 3);
    let mut lodc = Command::new(env!("CARGO_BIN_EXE_lodc"));
    lodc.current_dir(&again.0).env("RAYON_NUM_THREADS", "1");
    let few = ["--meshes", "6", "--shaders", "6", "--mesh-views", "6"];
    lodc.arg("clay.wgsl")
        .args(few)
        .args(["--search", "separate"]);
    assert!(lodc.output().unwrap().status.success());
    for (file, found) in files.into_iter().zip(found) {
        let same = again.read(file) == found;
        assert!(same, "{file}");
    }
}

#[test]
fn meshes_alone_shaders_alone_and_all_pairs() {
    let folder = Folder::new("alone", 2);
    let all = folder.joined(&["--search", "exhaustive"]);
    let joint = &all["joint"];
    let product = number(&joint["meshes"]) * number(&joint["shaders"]);
    for walk in list(&joint["walked"]) {
        // What draws the same for less takes the place of the original.
        let pairs = number(&walk["pairs"]);
        assert!(pairs == product || pairs == product - number(&joint["meshes"]));
    }
    let j = number(&joint["chosen"]["j"]);
    let meshes = folder.joined(&["--search", "separate", "--only", "mesh"]);
    for level in list(&meshes["levels"]) {
        assert!(list(&level["recipe"]).is_empty());
    }
    let of_meshes = number(&meshes["joint"]["chosen"]["j"]);
    assert!(j <= of_meshes + 0.01, "{j} of both, {of_meshes} of meshes");
    let shaders = folder.joined(&["--search", "separate", "--only", "shader"]);
    for level in list(&shaders["levels"]) {
        assert!(level["mesh"]["file"].is_null());
    }
    let of_shaders = number(&shaders["joint"]["chosen"]["j"]);
    assert!(
        j <= of_shaders + 0.01,
        "{j} of both, {of_shaders} of shaders"
    );
}

#[test]
fn what_does_not_go_together_is_said_before_the_search() {
    let folder = Folder::new("refused", 2);
    for (flags, says) in [
        (
            &["--search", "separate", "--transition", "blend"][..],
            "two meshes are not drawn in one another's place",
        ),
        (
            &["--search", "separate", "--per-pixel"],
            "a pixel cannot choose its mesh",
        ),
        (
            &["--search", "separate", "--goal", "accesses"],
            "levels of meshes and shaders are to save time",
        ),
        (
            &["--meshes", "4"],
            "`--meshes` is about a search of meshes and shaders",
        ),
        (&["--only", "mesh"], "there is no pass `mesh`"),
    ] {
        let done = folder.lodc(flags);
        let said = String::from_utf8_lossy(&done.stderr).into_owned();
        assert_eq!(done.status.code(), Some(2), "{said}");
        assert!(said.contains(says), "{said}");
    }
    assert!(!folder.0.join("clay.lod.wgsl").exists());
}

#[test]
fn pairs_that_are_made_for_each_other_are_there_to_choose() {
    let folder = Folder::new("made", 2);
    let report = folder.joined(&["--search", "interleaved"]);
    let joint = &report["joint"];
    assert!(number(&joint["spawned"]) >= 1.0, "{joint}");
    // What the walk finds is there to choose too.
    let j = ["chosen", "walk"].map(|of| number(&joint[of]["j"]));
    assert!(j[0] <= j[1] + 1e-9, "{j:?}");
    for level in &list(&report["levels"])[1..] {
        let error = &level["error"];
        assert!(
            number(&error["excess"]) <= number(&error["bound"]),
            "{error}"
        );
    }
    let before = folder.read("clay.lod.wgsl");
    assert!(folder.lodc(&["--locked"]).status.success());
    assert!(folder.read("clay.lod.wgsl") == before);
}

#[test]
fn a_table_compares_meshes_shaders_and_both() {
    let folder = Folder::new("table", 2);
    let bench = |arguments: &[&str]| {
        let mut lodc = Command::new(env!("CARGO_BIN_EXE_lodc"));
        let lodc = lodc.current_dir(&folder.0).args(["bench", "table2"]);
        let done = lodc.args(arguments).output().unwrap();
        let said = String::from_utf8_lossy(&done.stderr).into_owned();
        (done, said)
    };
    fs::copy(folder.0.join("clay.toml"), folder.0.join("ball.toml")).unwrap();
    let few = ["--meshes", "4", "--shaders", "4", "--mesh-views", "6"];
    let objects = ["clay.wgsl=ball.toml", "--search", "exhaustive", "--json"];
    let (done, said) = bench(&[&objects[..], &few].concat());
    assert!(done.status.success(), "{said}");
    let table: Value = serde_json::from_slice(&done.stdout).unwrap();
    let ball = &table["objects"][0];
    assert_eq!(ball["name"], "ball");
    let j = |of: &str| number(&ball[of]["j"]);
    for of in ["mesh_only", "shader_only", "walk"] {
        assert!(j("both") <= j(of) + 1e-9, "{of}: {ball}");
    }
    assert!(number(&ball["held_out"]) <= 1.2, "{ball}");
    let mean = number(&table["means"][0][1]);
    let time = number(&ball["both"]["time"]);
    assert!((mean * time - 1.0).abs() < 1e-9, "{table}");
    // Nothing is written.
    assert!(!folder.0.join("clay.lod.wgsl").exists());

    for (arguments, says) in [
        (&["clay.wgsl="][..], "it reads `material.wgsl`"),
        (
            &["clay.wgsl", "--search", "greedy"],
            "shaders alone have no meshes",
        ),
        (&["cloy.wgsl"], "cloy.wgsl"),
        (&["clay.wgsl=cloy.toml"], "cloy.toml"),
    ] {
        let (done, said) = bench(arguments);
        assert_eq!(done.status.code(), Some(2), "{said}");
        assert!(said.contains(says), "{said}");
    }
}

/// Times are data here, and all else is computed: the same levels come out everywhere. `LODC_BLESS=1` times anew, on Mesa's software
/// Vulkan, and writes what comes out.
#[test]
fn a_recorded_search_gives_the_levels_that_are_committed() {
    let recorded = Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata/recorded");
    let folder = Folder::new("recorded", 2);
    fs::copy(recorded.join("clay.toml"), folder.0.join("clay.toml")).unwrap();
    let search = ["--search", "separate"];
    let bless = std::env::var_os("LODC_BLESS").is_some();
    if bless {
        let timed = ["--time", "measured", "--adapter", "vulkan", "--no-cache"];
        folder.joined(&[&search[..], &timed, &["--record", "times.json"]].concat());
        fs::copy(folder.0.join("times.json"), recorded.join("times.json")).unwrap();
    }
    let times = recorded.join("times.json").display().to_string();
    folder.joined(&[&search[..], &["--recordings", &times]].concat());
    for file in [
        "clay.lod.toml",
        "clay.lod.wgsl",
        "clay.lod/clay.meshes.toml",
    ] {
        let found = String::from_utf8(folder.read(file)).unwrap();
        let golden = recorded.join(file);
        if bless {
            fs::create_dir_all(golden.parent().unwrap()).unwrap();
            fs::write(&golden, &found).unwrap();
        }
        let golden = fs::read_to_string(&golden).unwrap_or_default();
        assert!(
            found == golden,
            "{file} is not what is committed; if it should be: LODC_BLESS=1 cargo test --all-features --test joint recorded\n{found}"
        );
    }
}
