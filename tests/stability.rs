//! Traps and innocents: what a simplification breaks beyond the pictures is found, with its line, and what it does not is not.
//!
//! A file of `testdata/stability` is a shader whose second line says what is done to it, `// trap: pass path choice` or
//! `// innocent: ...`, a step after the other with ` then ` between them. What is said of a trap is beside it, `.says`.
//! `// stiff: ...` and `// smooth: ...` are the same of jumps and slopes, which fail nothing; without a step it is the original
//! that is looked at.
#![cfg(feature = "search")]

mod fixtures;

use fixtures::Goldens;
use lodc::compile::{self, Compiled, Request, StabilityRequest, normal_form};
use lodc::eval::program::Program;
use lodc::eval::programs::Stand;
use lodc::front::Source;
use lodc::scene::Scene;
use lodc::search::{SampleSet, Samples};
use lodc::stability::{Asked, Battery, Device, Verdict, Ways};
use lodc_passes::{Recipe, Shader, Stage, all_passes, recipe};
use std::fs;
use std::path::{Path, PathBuf};

/// What a shader is an example of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Trap,
    Innocent,
    Stiff,
    Smooth,
}

/// What is done to a shader, by its second line.
struct Case {
    kind: Kind,
    steps: Vec<String>,
}

fn case(text: &str) -> Case {
    let line = text.lines().nth(1).unwrap_or_default();
    let (kind, steps) = line.split_once(": ").expect("it says what is done");
    Case {
        kind: match kind {
            "// trap" => Kind::Trap,
            "// innocent" => Kind::Innocent,
            "// stiff" => Kind::Stiff,
            "// smooth" => Kind::Smooth,
            other => panic!("{other}"),
        },
        steps: steps
            .split(" then ")
            .filter(|step| *step != "nothing")
            .map(str::to_owned)
            .collect(),
    }
}

/// Whether something is found of the shader of a file after its steps, and what is said of it.
fn judged(path: &Path) -> Result<(Kind, bool, String), String> {
    let source = Source::read(path).unwrap_or_else(|e| panic!("{e}"));
    let scene_file = path.with_extension("toml");
    let scene = Scene::read(&source, Some(&*scene_file).filter(|file| file.is_file()));
    let scene = scene.unwrap_or_else(|e| panic!("{e}"));
    let base = normal_form(&source).expect("it is small");
    let vertex = match (&scene.vertex_stage, base.index(Stage::Vertex)) {
        (Some(stage), _) => Program::compile(&stage.module, 0, &[]),
        (None, index) => Program::compile(base.module(), index.expect("it has one"), &[]),
    };
    let vertex = vertex.expect("it runs");
    let stand = Stand {
        base: &base,
        vertex: &vertex,
        scene: &scene,
    };
    let case = case(&source.text);
    // Only steps ask for facts.
    let steps_asked = !case.steps.is_empty();
    let set = steps_asked.then(|| SampleSet::new(&stand, scene.nearest, Samples::Search));
    let set = set.transpose().expect("it runs");
    let mut made = base.clone();
    let mut steps = Vec::new();
    for wanted in &case.steps {
        let facts = set.as_ref().map(|set| set.facts(&made)).unwrap_or_default();
        let offered: Vec<_> = all_passes()
            .flat_map(|pass| pass.candidates(&made, &facts))
            .collect();
        let step = offered
            .iter()
            .find(|candidate| candidate.to_string().starts_with(wanted));
        let Some(step) = step else {
            let all: Vec<String> = offered.iter().map(ToString::to_string).collect();
            return Err(format!("`{wanted}` is none of\n{}", all.join("\n")));
        };
        made = recipe::apply(&made, step).expect("it was offered");
        steps.push(step.clone());
    }
    if let Kind::Stiff | Kind::Smooth = case.kind {
        let ways = Ways::new(&stand).expect("it runs");
        let found = match steps.is_empty() {
            true => ways.of_original(),
            false => {
                let compared = ways.compare((&base, &Recipe(steps)), &made);
                compared.expect("it runs")
            }
        };
        let says = found.iter().map(|stiff| {
            let whole = stiff.diagnostic(&base, &source).render(false);
            format!("{}\n{whole}", stiff.says(&source))
        });
        let says: Vec<String> = says.collect();
        return Ok((case.kind, !says.is_empty(), says.join("\n")));
    }
    let battery = Battery::new(&stand).expect("it runs");
    let judged = battery.judge_and_hunt(&made).expect("it runs");
    let says = judged.failures.first().map(|failure| {
        let blamed = battery.blame((&base, &Recipe(steps)), failure);
        format!(
            "{}\n{}",
            blamed.says(&base, &source),
            blamed.diagnostic(&base, &source).render(false)
        )
    });
    let is_found = judged.verdict == Verdict::Unstable;
    Ok((case.kind, is_found, says.unwrap_or_default()))
}

#[test]
fn traps_are_found_with_their_lines_and_innocents_are_not_flagged() {
    let mut goldens = Goldens::of("stability");
    let mut counts = [0; 4];
    for path in fixtures::shaders("testdata/stability") {
        let path = path
            .strip_prefix(env!("CARGO_MANIFEST_DIR"))
            .expect("it is there");
        let name = path.display();
        let (kind, is_found, says) = match judged(path) {
            Ok(judged) => judged,
            Err(wrong) => {
                goldens.wrong(format!("{name}: {wrong}"));
                continue;
            }
        };
        counts[kind as usize] += 1;
        match (matches!(kind, Kind::Trap | Kind::Stiff), is_found) {
            (true, true) => {
                let file = path.with_extension("says");
                goldens.compare(&name.to_string(), &file, &says);
            }
            (true, false) => goldens.wrong(format!("{name} is not found")),
            (false, true) => goldens.wrong(format!("{name} is flagged:\n{says}")),
            (false, false) => {}
        }
    }
    goldens.finish();
    let [traps, innocents, stiff, smooth] = counts;
    assert!(traps >= 12 && innocents >= 12, "{counts:?}");
    assert!(stiff >= 8 && smooth >= 4, "{counts:?}");
}

/// A trap in the folder of a test, with a scene that is quick to search.
///
/// Tests run at the same time: no two of them may name one folder.
fn small(test: &str, name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("stability")
        .join(test);
    fs::create_dir_all(&folder).expect("the folder can be written");
    let from = Path::new("testdata/stability").join(name);
    let to = folder.join("trap.wgsl");
    fs::copy(from.with_extension("wgsl"), &to).expect("it can be copied");
    let scene = fs::read_to_string(from.with_extension("toml")).unwrap_or_default();
    let quick = "resolution = [48, 48]\nlevels = 3\noffsets = 1\ne_max = 0.2\n";
    fs::write(to.with_extension("toml"), format!("{quick}{scene}")).expect("it can be written");
    to
}

fn compiled(shader: &Path, unstable: bool) -> Compiled {
    let request = Request {
        shader: shader.to_owned(),
        unstable,
        ..Request::default()
    };
    compile::compile(&request, &|_| {}).unwrap_or_else(|e| panic!("{e}"))
}

/// Guards that no picture needs are all that can be saved within a small bound.
#[test]
fn the_search_avoids_what_it_would_choose_otherwise() {
    let shader = small("avoids", "normalize_of_what_can_vanish");
    let text = fs::read_to_string(&shader).expect("it was written");
    let (head, _) = text
        .split_once("@fragment")
        .expect("it has a fragment stage");
    let body = "@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    let left = 1.0 - 0.3 * in.world_normal;
    let low = max(left, vec3f(0.001));
    let high = min(low, vec3f(3.0));
    let up = sqrt(high);
    return vec4f(0.3 * up, 1.0);
}
";
    let shader = shader.with_file_name("guarded.wgsl");
    fs::write(&shader, format!("{head}{body}")).expect("it can be written");
    let scene = "resolution = [48, 48]\nlevels = 3\noffsets = 1\ne_max = 0.0001\n";
    fs::write(shader.with_extension("toml"), scene).expect("it can be written");
    let verdicts = |compiled: &Compiled| -> Vec<String> {
        let levels = compiled.report.levels.iter();
        let verdicts = levels.map(|level| level.stability.verdict.clone());
        verdicts.map(Option::unwrap_or_default).collect()
    };
    let allowed = compiled(&shader, true);
    let verdicts_of_allowed = verdicts(&allowed);
    assert!(
        verdicts_of_allowed.contains(&"unstable".to_owned()),
        "{verdicts_of_allowed:?}"
    );
    let mut notes = allowed.warnings.iter().flat_map(|warning| &warning.notes);
    assert!(notes.any(|note| note.contains("UNSTABLE")));
    let held = compiled(&shader, false);
    let verdicts = verdicts(&held);
    assert!(
        verdicts.iter().all(|verdict| verdict == "stable"),
        "{verdicts:?}"
    );
    // What the quick check of the search refuses is said as what the whole one does.
    let left_out = &held.report.left_out;
    let why = "because of `op-removal fs_main.low keep";
    assert!(
        left_out.iter().any(|line| line.contains(why)),
        "{left_out:#?}"
    );
}

#[test]
fn the_worst_inputs_are_written_and_looked_at_again() {
    let shader = small("worst_inputs", "normalize_of_what_can_vanish");
    let text = fs::read_to_string(&shader).expect("it was written");
    // Without its guard.
    let bare = text.replace("max(square, 0.00000001)", "square");
    fs::write(&shader, bare).expect("it can be written");
    let worst = shader.with_extension("inputs.json");
    let looked = |replay: Option<PathBuf>| {
        let asked = StabilityRequest {
            request: Request {
                shader: shader.clone(),
                ..Request::default()
            },
            replay,
            record: Some(worst.clone()),
        };
        compile::stability(&asked).unwrap_or_else(|e| panic!("{e}"))
    };
    let first = looked(None);
    assert!(first.original.of_original > 0 && !first.findings.is_empty());
    let (path, recorded) = &first.files[0];
    fs::write(path, recorded).expect("it can be written");
    let again = looked(Some(worst.clone()));
    assert!(again.original.of_original > first.original.of_original);

    // NaN and infinities are told of, and fail nothing.
    let hostile = again.hostile[0];
    assert!(hostile.inputs > 0 && hostile.held < hostile.inputs && hostile.lost == 0);
    assert!(!again.fails());

    // With the guard it holds all of that.
    fs::write(&shader, text).expect("it can be written");
    let held = looked(Some(worst.clone()));
    assert_eq!(
        (held.original.verdict, held.findings.len()),
        (Verdict::Stable, 0)
    );
    fs::write(&worst, "[").expect("it can be written");
    let asked = StabilityRequest {
        request: Request {
            shader: shader.clone(),
            ..Request::default()
        },
        replay: Some(worst),
        record: None,
    };
    let error = compile::stability(&asked).expect_err("it is no file of inputs");
    assert!(
        error.message.contains("no file of recorded inputs"),
        "{error}"
    );
}

/// A device that calls every other fragment bad where a shader is not the original.
struct Fussy {
    original: lodc_passes::Fingerprint,
}

impl Device for Fussy {
    fn name(&self) -> &str {
        "a fussy device"
    }

    fn bad(&mut self, shaders: &[&Shader], asked: &Asked) -> Option<Vec<Vec<bool>>> {
        let all = shaders.iter().map(|shader| {
            let is_other = shader.fingerprint() != self.original;
            (0..asked.count())
                .map(|at| is_other && at % 2 == 1)
                .collect()
        });
        Some(all.collect())
    }
}

#[test]
fn what_a_device_alone_fails_on_is_blamed_on_the_step() {
    let path = Path::new("testdata/stability/guard_that_nothing_needs.wgsl");
    let source = Source::read(path).unwrap_or_else(|e| panic!("{e}"));
    let scene = Scene::read(&source, None).unwrap_or_else(|e| panic!("{e}"));
    let base = normal_form(&source).expect("it is small");
    let stage = scene.vertex_stage.as_ref().expect("lodc supplies one");
    let vertex = Program::compile(&stage.module, 0, &[]).expect("it runs");
    let stand = Stand {
        base: &base,
        vertex: &vertex,
        scene: &scene,
    };
    let set = SampleSet::new(&stand, scene.nearest, Samples::Search).expect("it runs");
    let facts = set.facts(&base);
    let mut offered = all_passes().flat_map(|pass| pass.candidates(&base, &facts));
    let step = offered.find(|step| step.to_string().starts_with("op-removal fs_main.far keep"));
    let step = step.expect("it is offered");
    let made = recipe::apply(&base, &step).expect("it was offered");
    let battery = Battery::new(&stand).expect("it runs");
    let judged = battery.judge_and_hunt(&made).expect("it runs");
    assert_eq!(judged.verdict, Verdict::Stable);
    let mut device = Fussy {
        original: base.fingerprint(),
    };
    let recipe = Recipe(vec![step.clone()]);
    let mut asked = |shader: &Shader| {
        let of = (&base, &recipe);
        let found = battery.on_device(&mut device, of, shader, &judged.near);
        found.expect("it was asked")
    };
    let found = asked(&made);
    assert!(found.inputs > 1000 && found.fails > 100, "{found:?}");
    let blamed = found.blamed.expect("it fails");
    assert_eq!(blamed.candidate, Some((0, step)));
    let says = blamed.says(&base, &source);
    assert!(
        says.starts_with("what is returned is not finite on a fussy device"),
        "{says}"
    );
    let held = asked(&base);
    assert_eq!((held.fails, held.inputs), (0, found.inputs));
}
