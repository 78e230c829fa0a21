//! Shaders of other people: how many go all the way, and why the others do not.
//!
//! They are fetched into the target folder, from the registries of Python and Rust, and belong to no commit. Each goes
//! through the stages of the main job at a small scene: read, normal form, scene, evaluation, candidates, edits,
//! emission. How many get how far is `tests/corpus/counts.txt`, which may only get better; what is refused is listed
//! there with what lodc says. `LODC_BLESS=1 cargo test --test corpus` writes it again when nothing got worse.
//!
//! What cannot be fetched is skipped, aloud; under `CI` that is a failure. The MaterialX documents are those of
//! `$LODC_DATA/mtlx`, by default `../shared/data/mtlx`, and are skipped where they are not.
#![cfg(feature = "search")]

use lodc::compile::normal_form;
use lodc::emit::{self, EmitLevel, Output};
use lodc::eval::draw::shade;
use lodc::eval::program::Program;
use lodc::eval::programs::Stand;
use lodc::eval::raster::rasterize;
use lodc::front::{Source, Stages};
use lodc::scene::Scene;
use lodc::search::{SampleSet, Samples};
use lodc::{Diagnostic, Result};
use lodc_passes::{Candidate, Shader, Stage, recipe};
use naga::back::pipeline_constants::process_overrides;
use naga::{Module, ShaderStage};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

/// Crates that ship complete shaders in WGSL.
const CRATES: &[&str] = &[
    "blade-egui@0.9.0",
    "egui-wgpu@0.37.0",
    "femtovg@0.28.0",
    "galileo@0.2.1",
    "glyphon@0.12.0",
    "iced_wgpu@0.14.0",
    "imgui-wgpu@0.28.0",
    "kiss3d@0.47.0",
    "pixels@0.17.2",
    "rend3-routine@0.3.0",
    "wgpu_glyph@0.28.0",
    "wgpu_text@30.0.1",
    "yakui-wgpu@0.3.0",
];

const MATERIALX: &str = "materialx==1.39.5";

/// How far a shader got: the stages in their order.
const STAGES: &[&str] = &[
    "read", "normal", "scene", "drawn", "edited", "emitted", "equal",
];

/// How many candidates are applied one after the other.
const EDITS: usize = 6;

/// A source of shaders.
struct Group {
    name: String,
    /// Where they are, by the names that they are listed under.
    shaders: BTreeMap<String, PathBuf>,
}

/// How far one shader got, and what stopped it.
struct Outcome {
    stages: usize,
    refused: Option<String>,
}

#[test]
fn the_corpus_goes_as_far_as_it_did() {
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus/counts.txt");
    let before = Table::parse(&fs::read_to_string(&golden).unwrap_or_default());
    let mut table = Table::default();
    let mut skipped = Vec::new();
    for group in groups() {
        match group {
            Ok(group) => table.groups.push(run(&group)),
            Err((names, why)) => {
                eprintln!("SKIPPED: {}: {why}", names.join(", "));
                skipped.push(why);
                for name in names {
                    table.groups.extend(before.group(name).cloned());
                }
            }
        }
    }
    let text = table.to_string();
    let worse = table.worse_than(&before);
    let written = before.to_string();
    if std::env::var_os("LODC_BLESS").is_some() && worse.is_empty() {
        fs::write(&golden, &text).expect("the table can be written");
    } else if text != written {
        let diff = similar::TextDiff::from_lines(&written, &text);
        panic!(
            "{}\n{}\n{}",
            diff.unified_diff().header("counts.txt", "now"),
            worse.join("\n"),
            match worse.is_empty() {
                true =>
                    "nothing got worse; to write it down: LODC_BLESS=1 cargo test --test corpus",
                false => "fewer shaders go as far as they did",
            }
        );
    }
}

/// Every source of shaders; of one that cannot be had, the names of its groups and why.
fn groups() -> Vec<std::result::Result<Group, (Vec<String>, String)>> {
    let folder = fetched_folder();
    let mut groups = materialx(&folder);
    for name in CRATES {
        groups.push(match of_crate(name) {
            Ok(group) => Ok(group),
            Err(why) => Err(missing(vec![crate_group(name)], why)),
        });
    }
    groups
}

/// What cannot be fetched must be there in CI.
fn missing(names: Vec<String>, why: String) -> (Vec<String>, String) {
    assert!(
        std::env::var_os("CI").is_none(),
        "{}: {why}",
        names.join(", ")
    );
    (names, why)
}

/// Where what was fetched lies: beside the tests' other output, and kept from run to run.
fn fetched_folder() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("corpus");
    fs::create_dir_all(&folder).expect("the target folder can be written");
    folder
}

/// Runs a program to its end.
fn done(command: &mut Command) -> std::result::Result<String, String> {
    let shown = format!("{command:?}");
    let output = command.output().map_err(|e| format!("{shown}: {e}"))?;
    match output.status.success() {
        true => Ok(String::from_utf8_lossy(&output.stdout).into_owned()),
        false => {
            let said = String::from_utf8_lossy(&output.stderr);
            let last = said.lines().last().unwrap_or_default();
            Err(format!("{shown}: {}: {last}", output.status))
        }
    }
}

fn materialx(folder: &Path) -> Vec<std::result::Result<Group, (Vec<String>, String)>> {
    let name = |set: &str| {
        let vulkan = format!("materialx {set}, combined samplers");
        [format!("materialx {set}"), vulkan]
    };
    let all: Vec<String> = ["library", "documents"]
        .into_iter()
        .flat_map(name)
        .collect();
    let venv = folder.join("venv");
    let python = venv.join("bin/python");
    let installed = || {
        if python.is_file() && done(Command::new(&python).args(["-c", "import MaterialX"])).is_ok()
        {
            return Ok(());
        }
        done(Command::new("python3").args(["-m", "venv"]).arg(&venv))?;
        let pip = ["-m", "pip", "install", "--quiet", MATERIALX];
        done(Command::new(&python).args(pip)).map(drop)
    };
    if let Err(why) = installed() {
        return vec![Err(missing(all, why))];
    }
    let data = std::env::var_os("LODC_DATA").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
        PathBuf::from,
    );
    let documents = data.join("mtlx");
    let out = folder.join("materialx");
    let _ = fs::remove_dir_all(&out);
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus/materialx.py");
    let mut command = Command::new(&python);
    command.arg(script).arg(&out);
    if documents.is_dir() {
        command.arg(&documents);
    }
    if let Err(why) = done(&mut command) {
        return vec![Err(missing(all, why))];
    }
    let mut groups = Vec::new();
    for set in ["library", "documents"] {
        let [apart, combined] = name(set);
        let folder = out.join(set);
        if !folder.is_dir() {
            let why = format!("no MaterialX documents in {}", documents.display());
            groups.push(Err((vec![apart, combined], why)));
            continue;
        }
        let (mut one, mut other) = (BTreeMap::new(), BTreeMap::new());
        for path in files(&folder, &["frag"]) {
            let name = file_name(&path);
            match name.strip_suffix(".vulkan.frag") {
                Some(material) => other.insert(material.to_owned(), path),
                None => one.insert(name.trim_end_matches(".frag").to_owned(), path),
            };
        }
        for (name, shaders) in [(apart, one), (combined, other)] {
            groups.push(Ok(Group { name, shaders }));
        }
    }
    groups
}

fn crate_group(name: &str) -> String {
    name.replace('@', " ")
}

/// The complete shaders that a crate ships: those with a fragment stage.
fn of_crate(name: &str) -> std::result::Result<Group, String> {
    let folder = name.replace('@', "-");
    let home = std::env::var_os("CARGO_HOME").map(PathBuf::from);
    let home = home.or_else(|| Some(PathBuf::from(std::env::var_os("HOME")?).join(".cargo")));
    let sources = home.unwrap_or_default().join("registry/src");
    let unpacked = || {
        let registries = fs::read_dir(&sources).ok()?;
        let mut found = registries.flatten().map(|entry| entry.path().join(&folder));
        found.find(|path| path.is_dir())
    };
    if unpacked().is_none() {
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        // It unpacks the crate alone.
        done(Command::new(cargo).args(["info", "--quiet", name]))?;
    }
    let root = unpacked().ok_or_else(|| format!("{name} is not in {}", sources.display()))?;
    let is_complete = |path: &PathBuf| {
        let text = fs::read_to_string(path).unwrap_or_default();
        let wgsl = path.extension().is_some_and(|e| e == "wgsl");
        text.contains(if wgsl { "@fragment" } else { "void main" })
    };
    let shaders = files(&root, &["wgsl", "frag"])
        .into_iter()
        .filter(is_complete)
        .map(|path| {
            let inside = path.strip_prefix(&root).unwrap_or(&path);
            (inside.to_string_lossy().replace('\\', "/"), path.clone())
        });
    Ok(Group {
        name: crate_group(name),
        shaders: shaders.collect(),
    })
}

/// Files below a folder with one of these extensions.
fn files(folder: &Path, extensions: &[&str]) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut waiting = vec![folder.to_owned()];
    while let Some(here) = waiting.pop() {
        for entry in fs::read_dir(&here).into_iter().flatten().flatten() {
            let path = entry.path();
            let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("");
            if path.is_dir() {
                waiting.push(path);
            } else if extensions.contains(&extension) {
                found.push(path);
            }
        }
    }
    found
}

fn file_name(path: &Path) -> String {
    path.file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned()
}

fn run(group: &Group) -> Row {
    let start = Instant::now();
    let outcomes: Vec<(&String, Outcome)> = group
        .shaders
        .par_iter()
        .map(|(name, path)| (name, outcome(path)))
        .collect();
    eprintln!(
        "{}: {} shaders, {:.1} s",
        group.name,
        outcomes.len(),
        start.elapsed().as_secs_f64()
    );
    let mut row = Row {
        name: group.name.clone(),
        counts: vec![0; STAGES.len() + 1],
        refused: Vec::new(),
    };
    let mut refused: BTreeMap<String, Vec<&str>> = BTreeMap::new();
    for (name, outcome) in outcomes {
        for count in &mut row.counts[..=outcome.stages] {
            *count += 1;
        }
        if let Some(why) = outcome.refused {
            refused.entry(why).or_default().push(name);
        }
    }
    for (why, names) in refused {
        let names = match names.len() == group.shaders.len() && names.len() > 1 {
            true => "all of them".to_owned(),
            false => names.join(", "),
        };
        row.refused.push(format!("{why}: {names}"));
    }
    row
}

/// Takes a shader through the stages.
fn outcome(path: &Path) -> Outcome {
    let mut stages = 0;
    let refused = match catch_unwind(AssertUnwindSafe(|| through(path, &mut stages))) {
        Ok(Ok(())) => None,
        Ok(Err(error)) => Some(one_line(&error, path)),
        Err(_) => Some("PANIC".to_owned()),
    };
    Outcome { stages, refused }
}

/// A refusal as the table lists it: the message, which points at a place or says what to do.
fn one_line(error: &Diagnostic, path: &Path) -> String {
    let helps = !error.labels.is_empty() || !error.notes.is_empty();
    let said = error.message.replace('\n', " ");
    let said = said.replace(&format!("`{}`", path.display()), "it");
    format!(
        "{said}{}",
        if helps { "" } else { " (NO PLACE, NO WAY OUT)" }
    )
}

/// Reads a shader; of several fragment entry points, the one that lodc suggests.
fn read(path: &Path) -> Result<Source> {
    Source::read(path).or_else(|error| {
        let suggested = error.notes.iter().find_map(|note| {
            let (_, name) = note.split_once("`--fragment ")?;
            Some(name.trim_end_matches('`').to_owned())
        });
        let stages = Stages {
            fragment: Some(suggested.ok_or(error)?),
            ..Stages::default()
        };
        Source::read_stages(path, &stages)
    })
}

fn through(path: &Path, stages: &mut usize) -> Result<()> {
    let source = read(path)?;
    *stages += 1;
    let base = normal_form(&source)?;
    *stages += 1;
    let scene = scene_of(&source, path)?;
    *stages += 1;

    let refused = |refused: lodc::eval::program::Refused| {
        source.error(
            format!("cannot evaluate {}", refused.what),
            refused.span,
            "",
        )
    };
    let (vertex, fragment) = programs(&source, &scene).map_err(refused)?;
    let stand = Stand {
        base: &base,
        vertex: &vertex,
        scene: &scene,
    };
    let set = SampleSet::new(&stand, scene.nearest, Samples::Search).map_err(refused)?;
    *stages += 1;

    let candidates = recipe::candidates(&base, &set.facts(&base));
    let variant = edited(&base, &candidates);
    if !candidates.is_empty() && variant.fingerprint() == base.fingerprint() {
        return Err(Diagnostic::error("no candidate changes anything"));
    }
    set.measure(&variant).map_err(refused)?;
    *stages += 1;

    let level = EmitLevel {
        autolod: 1.0,
        shader: variant.clone(),
        distance: scene.nearest,
        error: 0.0,
        cost: 1.0,
        time: None,
        says: "some edits".to_owned(),
    };
    let files = emit::emit(&source, &base, &[level], Output::default())?;
    let text = String::from_utf8_lossy(&files[0].1).into_owned();
    let chosen = Stages {
        vertex: source.vertex.clone(),
        fragment: Some(source.fragment.clone()),
        ..Stages::default()
    };
    let emitted = Source::parse_stages("emitted.wgsl", text, &chosen)?;
    *stages += 1;

    let drawn = |program: &Program| draw(&scene, &vertex, program);
    let original = drawn(&fragment);
    if original.is_empty() {
        return Err(
            Diagnostic::error("nothing is drawn with the values that lodc suggests")
                .with_note("a scene of its own would show it"),
        );
    }
    let lanes = compiled(variant.module(), variant.index(Stage::Fragment)).map_err(refused)?;
    for (autolod, wanted) in [(0.0, &original), (1.0, &drawn(&lanes))] {
        let module = with_autolod(&emitted, autolod);
        let at = position(&module, ShaderStage::Fragment, &source.fragment);
        let program = compiled(&module, at).map_err(refused)?;
        if drawn(&program) != *wanted {
            return Err(Diagnostic::error(format!(
                "level {autolod} of the emitted shader draws another picture"
            )));
        }
    }
    *stages += 1;
    Ok(())
}

/// The scene beside a shader, or what is told from names; with the lines that lodc asks for where that is not enough.
fn scene_of(source: &Source, path: &Path) -> Result<Scene> {
    let file = path.with_extension("toml");
    let mut text = fs::read_to_string(&file).unwrap_or_else(|_| {
        "resolution = [32, 32]\nlevels = 2\n[views]\ndirections = [[0.3, 0.4, 1.0]]\n".to_owned()
    });
    let mut last = Scene::resolve(source, Some((&file, &text)));
    for _ in 0..4 {
        let Err(error) = &last else { break };
        let Some(lines) = asked_for(error) else { break };
        for (table, line) in lines {
            let header = format!("[{table}]\n");
            match text.find(&header) {
                Some(at) => text.insert_str(at + header.len(), &format!("{line}\n")),
                None => writeln!(text, "{header}{line}").expect("a string takes text"),
            }
        }
        last = Scene::resolve(source, Some((&file, &text)));
    }
    last
}

/// The lines of a scene that an error asks for, each with its table.
fn asked_for(error: &Diagnostic) -> Option<Vec<(String, String)>> {
    let mut lines = Vec::new();
    for note in &error.notes {
        let mut table = None;
        for line in note.lines().skip(1) {
            match line
                .strip_prefix('[')
                .and_then(|rest| rest.strip_suffix(']'))
            {
                Some(name) => table = Some(name.to_owned()),
                None => lines.extend(table.clone().map(|table| (table, line.to_owned()))),
            }
        }
    }
    (!lines.is_empty()).then_some(lines)
}

/// Some candidates, applied one after the other where they still apply.
fn edited(base: &Shader, candidates: &[Candidate]) -> Shader {
    let step = (candidates.len() / EDITS).max(1);
    let chosen = candidates.iter().step_by(step).take(EDITS);
    chosen.fold(base.clone(), |shader, candidate| {
        recipe::apply(&shader, candidate).unwrap_or(shader)
    })
}

fn compiled(
    module: &Module,
    entry: Option<usize>,
) -> std::result::Result<Program, lodc::eval::program::Refused> {
    Program::compile(module, entry.expect("the entry point is there"), &[])
}

fn position(module: &Module, stage: ShaderStage, name: &str) -> Option<usize> {
    let mut entries = module.entry_points.iter();
    entries.position(|e| e.stage == stage && e.name == name)
}

/// The vertex and the fragment program of a source as it stands.
fn programs(
    source: &Source,
    scene: &Scene,
) -> std::result::Result<(Program, Program), lodc::eval::program::Refused> {
    let vertex = match &scene.vertex_stage {
        Some(supplied) => compiled(&supplied.module, Some(0))?,
        None => compiled(&source.module, source.vertex_entry().map(|(at, _)| at))?,
    };
    let fragment = compiled(&source.module, Some(source.fragment_entry().0))?;
    Ok((vertex, fragment))
}

fn with_autolod(emitted: &Source, autolod: f64) -> Module {
    let stage = Some((ShaderStage::Fragment, emitted.fragment.as_str()));
    let constants = [("autoLOD".to_owned(), autolod)].into_iter().collect();
    let made = process_overrides(&emitted.module, &emitted.info, stage, &constants);
    made.expect("autoLOD takes any number").0.into_owned()
}

/// The bits of every covered fragment's colour; all NaNs are one.
fn draw(scene: &Scene, vertex: &Program, fragment: &Program) -> Vec<u32> {
    let mut bits = Vec::new();
    for frame in scene.frames(scene.nearest) {
        let coverage = rasterize(vertex, fragment, &frame);
        let shading = shade(fragment, &coverage, &frame.bindings);
        for colour in shading.colours.iter().flatten() {
            bits.push(if colour.is_nan() {
                f32::NAN.to_bits()
            } else {
                colour.to_bits()
            });
        }
    }
    bits
}

/// The golden table.
#[derive(Default)]
struct Table {
    groups: Vec<Row>,
}

#[derive(Clone)]
struct Row {
    name: String,
    /// How many shaders there are, and how many get through each stage.
    counts: Vec<usize>,
    refused: Vec<String>,
}

impl Table {
    fn parse(text: &str) -> Self {
        let mut groups: Vec<Row> = Vec::new();
        for line in text
            .lines()
            .filter(|line| !line.starts_with('#') && !line.is_empty())
        {
            if let Some(refused) = line.strip_prefix("    ") {
                let group = groups.last_mut().expect("a refusal stands under its group");
                group.refused.push(refused.to_owned());
                continue;
            }
            let (name, counts) = line.split_once(':').expect("a group has a name");
            let counts = counts
                .split_whitespace()
                .map(|n| n.parse().expect("a count"));
            groups.push(Row {
                name: name.to_owned(),
                counts: counts.collect(),
                refused: Vec::new(),
            });
        }
        Self { groups }
    }

    fn group(&self, name: String) -> Option<&Row> {
        self.groups.iter().find(|group| group.name == name)
    }

    /// Which counts are lower than they were.
    fn worse_than(&self, before: &Self) -> Vec<String> {
        let mut worse = Vec::new();
        for old in &before.groups {
            let Some(new) = self.group(old.name.clone()) else {
                worse.push(format!("{} is gone", old.name));
                continue;
            };
            let named = std::iter::once(&"shaders").chain(STAGES);
            for ((stage, old_count), count) in named.zip(&old.counts).zip(&new.counts) {
                if count < old_count {
                    worse.push(format!("{}: {stage} {old_count} -> {count}", old.name));
                }
            }
        }
        worse
    }
}

impl std::fmt::Display for Table {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(
            f,
            "# How many shaders of other people go how far; the others with the reason."
        )?;
        writeln!(f, "# shaders {}", STAGES.join(" "))?;
        for group in &self.groups {
            write!(f, "\n{}:", group.name)?;
            group
                .counts
                .iter()
                .try_for_each(|count| write!(f, " {count}"))?;
            writeln!(f)?;
            group
                .refused
                .iter()
                .try_for_each(|refused| writeln!(f, "    {refused}"))?;
        }
        Ok(())
    }
}
