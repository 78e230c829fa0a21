//! The candidate law, held against random recipes over every shader in `testdata`.
//!
//! No randomness from outside: a small generator with a fixed seed per recipe, so that a failure names
//! the recipe that failed and comes again.

mod fixtures;
mod synthetic;

use lodc::front::Source;
use lodc_passes::operands::User;
use lodc_passes::recipe::{self, Candidate, Declined, Recipe};
use lodc_passes::{Facts, PASSES, Shader, Stage};
use naga::TypeInner;
use naga::valid::{Capabilities, ValidationFlags, Validator};
use similar::TextDiff;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::{fs, thread};

/// Random recipes altogether, spread evenly over the shaders.
const RECIPES: usize = 1000;
/// The most candidates in one recipe.
const STEPS: usize = 8;

/// A sequence of numbers that look random (Sebastiano Vigna, "An experimental exploration of Marsaglia's
/// xorshift generators, scrambled", 2016).
struct Random(u64);

impl Random {
    fn new(seed: usize) -> Self {
        Self((seed as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15))
    }

    /// A number below `end`, which is not 0.
    fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 33) as usize % end
    }
}

struct Subject {
    name: String,
    shader: Shader,
    facts: Facts,
}

/// The materials, the adversarial shaders and the passes' fixtures, in normal form.
fn subjects() -> Vec<Subject> {
    let mut paths = fixtures::complete();
    for pass in PASSES {
        let folder = Path::new("testdata/passes").join(pass.name());
        paths.extend(fixtures::shaders(folder));
    }
    let mut random = Random::new(paths.len());
    paths
        .iter()
        .map(|path| {
            let shader = normal_form(path);
            let facts = synthetic::awkward_facts(&shader, |end| random.below(end));
            let name = path
                .file_stem()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned();
            Subject {
                name,
                shader,
                facts,
            }
        })
        .collect()
}

fn normal_form(path: &Path) -> Shader {
    let source = Source::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    lodc::compile::normal_form(&source).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// Whether local arrays or matrices are indexed at run time. Should an edit make such an index
/// constant, the variable is taken apart by the normal form only, not by the edit.
fn keeps_arrays(shader: &Shader) -> bool {
    let functions = shader.module().entry_points.iter().map(|e| &e.function);
    functions
        .flat_map(|f| f.local_variables.iter())
        .any(|(_, variable)| {
            let inner = &shader.module().types[variable.ty].inner;
            matches!(inner, TypeInner::Array { .. } | TypeInner::Matrix { .. })
        })
}

/// What a shader is written as: byte for byte the same for the same shader.
fn wgsl(shader: &Shader) -> String {
    let mut module = shader.module().clone();
    // naga's writer takes no computed defaults; what is emitted has the author's text for them.
    for (_, value) in module.overrides.iter_mut() {
        value.init = None;
    }
    let info = Validator::new(ValidationFlags::all(), Capabilities::all())
        .validate(&module)
        .expect("the shader was validated before");
    let flags = naga::back::wgsl::WriterFlags::empty();
    naga::back::wgsl::write_string(&module, &info, flags).expect("a valid module is written")
}

/// Applies a candidate and holds the result against the law.
fn step(subject: &str, shader: &Shader, candidate: &Candidate) -> Result<Shader, Declined> {
    let next = recipe::apply(shader, candidate)?;
    if let Err(error) = next.validate() {
        let after = format!("{:#?}", next.module().entry_points);
        let before = format!("{:#?}", shader.module().entry_points);
        let diff = TextDiff::from_lines(&before, &after);
        panic!(
            "{subject}: {candidate}\n{:?}\n{}",
            error.into_inner(),
            diff.unified_diff()
        );
    }
    assert_ne!(
        next.fingerprint(),
        shader.fingerprint(),
        "{subject}: {candidate} changed nothing"
    );
    Ok(next)
}

/// Runs `body` for 0..count on two threads; a panic in one is a panic of the test.
fn on_two_threads(count: usize, body: impl Fn(usize) + Sync) {
    let next = AtomicUsize::new(0);
    thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                loop {
                    let i = next.fetch_add(1, Ordering::Relaxed);
                    if i >= count {
                        break;
                    }
                    body(i);
                }
            });
        }
    });
}

#[test]
fn a_thousand_random_recipes_are_valid_and_replay_to_the_same_bytes() {
    let subjects = subjects();
    let made = AtomicUsize::new(0);
    on_two_threads(RECIPES, |seed| {
        let subject = &subjects[seed % subjects.len()];
        let mut random = Random::new(seed);
        let mut shader = subject.shader.clone();
        let mut recipe = Recipe::default();
        for _ in 0..1 + random.below(STEPS) {
            let facts = synthetic::awkward_facts(&shader, |end| random.below(end));
            let candidates = recipe::candidates(&shader, &facts);
            if candidates.is_empty() {
                break;
            }
            let candidate = &candidates[random.below(candidates.len())];
            shader = step(&subject.name, &shader, candidate).unwrap_or_else(|declined| {
                panic!("{}: {candidate} was offered, but {declined}", subject.name)
            });
            recipe.0.push(candidate.clone());
        }
        made.fetch_add(recipe.0.len(), Ordering::Relaxed);

        let json = serde_json::to_string(&recipe).expect("a recipe is data");
        let from_json: Recipe = serde_json::from_str(&json).expect("what was written can be read");
        assert_eq!(from_json, recipe, "{json}");
        #[derive(serde::Serialize, serde::Deserialize)]
        struct Level {
            recipe: Recipe,
        }
        let toml = toml::to_string(&Level {
            recipe: recipe.clone(),
        })
        .expect("a recipe is data");
        let from_toml: Level = toml::from_str(&toml).expect("what was written can be read");
        assert_eq!(from_toml.recipe, recipe, "{toml}");

        let replayed = from_toml
            .recipe
            .replay(&subject.shader)
            .unwrap_or_else(|error| panic!("{}: {error}\n{toml}", subject.name));
        assert_eq!(replayed.fingerprint(), shader.fingerprint(), "{toml}");
        let text = wgsl(&shader);
        if !keeps_arrays(&subject.shader) {
            let point = |stage| shader.entry_point(stage).map(|point| point.name.as_str());
            let fragment = point(Stage::Fragment).expect("there always is one");
            let vertex = point(Stage::Vertex);
            let again = lodc_passes::normalize(shader.module(), vertex, fragment, 100_000)
                .expect("edits make shaders smaller");
            assert_eq!(again.fingerprint(), shader.fingerprint(), "{text}\n{toml}");
        }
        assert_eq!(wgsl(&replayed), text, "{toml}");
        if let Err(error) = naga::front::wgsl::parse_str(&text) {
            panic!("{}: {}\n{toml}", subject.name, error.emit_to_string(&text));
        }
    });
    let made = made.into_inner();
    assert!(made > 2 * RECIPES, "only {made} steps could be made");
}

#[test]
fn candidates_are_the_same_every_time_and_all_apply() {
    for subject in &subjects() {
        let candidates = recipe::candidates(&subject.shader, &subject.facts);
        assert_eq!(
            candidates,
            recipe::candidates(&subject.shader.clone(), &subject.facts)
        );
        for (i, candidate) in candidates.iter().enumerate() {
            assert!(
                !candidates[..i].contains(candidate),
                "{}: {candidate} is offered twice",
                subject.name
            );
            let pass = recipe::pass(&candidate.pass).expect("passes offer under their own names");
            assert_eq!(
                pass.applies(&subject.shader, candidate),
                Ok(()),
                "{candidate}"
            );
        }
    }
}

#[test]
fn any_candidate_can_be_asked_of_any_shader() {
    let subjects = subjects();
    let all: Vec<Candidate> = subjects
        .iter()
        .flat_map(|subject| recipe::candidates(&subject.shader, &subject.facts))
        .collect();
    let words = [
        "",
        "keep",
        "keep ",
        "keep fs_main",
        "mean",
        "without",
        "seen-mean",
        "no such word",
    ];
    on_two_threads(20_000, |seed| {
        let mut random = Random::new(seed);
        let mut candidate = all[random.below(all.len())].clone();
        match random.below(6) {
            0 => candidate.choice = words[random.below(words.len())].into(),
            1 => candidate.value = vec![f32::NAN.to_bits(); random.below(6)],
            2 => candidate.value = vec![0x3f00_0000; random.below(6)],
            3 => candidate.site = all[random.below(all.len())].site.clone(),
            4 => candidate.pass = PASSES[random.below(PASSES.len())].name().into(),
            _ => {}
        }
        let subject = &subjects[random.below(subjects.len())];
        for pass in PASSES {
            // Asked of the wrong pass as well: an answer is all that counts.
            if pass.applies(&subject.shader, &candidate).is_ok() && pass.name() == candidate.pass {
                let next = pass.apply(&subject.shader, &candidate);
                assert!(next.validate().is_ok(), "{}: {candidate}", subject.name);
            }
        }
    });
}

/// Whether an edit gives the site of another one users that it did not have: a read that has become the same as
/// another is one value with it, and what replaces the one then replaces both.
fn gains_users(shader: &Shader, edit: &Candidate, other: &Candidate) -> bool {
    let users = |shader: &Shader| {
        let (stage, site) = shader.find(&other.site)?;
        // By name, since places change; a statement has none.
        let name = |user: &User| match user {
            User::Value(value) => Some(shader.id(stage, *value).clone()),
            User::Statement(_) => None,
        };
        let users = shader.users(stage, site).iter().map(name);
        Some(users.collect::<Vec<_>>())
    };
    let after = Recipe(vec![edit.clone()]).replay(shader);
    let (Some(mut before), Some(after)) = (users(shader), after.ok().as_ref().and_then(users))
    else {
        return false;
    };
    after.iter().any(|user| {
        let known = before.iter().position(|have| have == user);
        known.map(|place| before.swap_remove(place)).is_none()
    })
}

#[test]
fn two_orders_of_independent_edits_are_one_variant() {
    let subjects = subjects();
    let both_ways = AtomicUsize::new(0);
    on_two_threads(2 * RECIPES, |seed| {
        let subject = &subjects[seed % subjects.len()];
        let mut random = Random::new(seed);
        let candidates = recipe::candidates(&subject.shader, &subject.facts);
        if candidates.len() < 2 {
            return;
        }
        let first = &candidates[random.below(candidates.len())];
        let second = &candidates[random.below(candidates.len())];
        let in_order =
            |pair: [&Candidate; 2]| Recipe(pair.map(Clone::clone).into()).replay(&subject.shader);
        if gains_users(&subject.shader, first, second)
            || gains_users(&subject.shader, second, first)
        {
            return;
        }
        // Where one takes the other's site or operand away, that order is declined.
        if let (Ok(one), Ok(other)) = (in_order([first, second]), in_order([second, first])) {
            assert_eq!(
                one.fingerprint(),
                other.fingerprint(),
                "{}: {first}; {second}",
                subject.name
            );
            both_ways.fetch_add(1, Ordering::Relaxed);
        }
    });
    assert!(both_ways.into_inner() > RECIPES / 2);
}

#[test]
fn a_recipe_finds_what_was_renamed_since() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata/passes/op-removal");
    let text = fs::read_to_string(folder.join("drops_shared_fresnel.wgsl")).expect("it is there");
    let renamed = text
        .replace("fresnel", "schlick")
        .replace("mirrored", "of_sky")
        .replace("cosine", "n_dot_v");
    let normal_form = |text: String| {
        let source = Source::parse("fresnel.wgsl", text).expect("the fixture parses");
        lodc_passes::normalize(&source.module, None, &source.fragment, 100_000)
            .expect("it is small")
    };
    let (old, new) = (normal_form(text), normal_form(renamed));
    assert_eq!(old.fingerprint(), new.fingerprint());
    for candidate in recipe::candidates(&old, &synthetic::facts(&old)) {
        let recipe = Recipe(vec![candidate]);
        let before = recipe.replay(&old).expect("it was offered");
        let after = recipe
            .replay(&new)
            .unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(before.fingerprint(), after.fingerprint(), "{}", recipe.0[0]);
    }
}
