//! The candidate law, held against random recipes over every shader in `testdata`.
//!
//! No randomness from outside: a small generator with a fixed seed per recipe, so that a failure names
//! the recipe that failed and comes again.

mod fixtures;
mod synthetic;

use lodc::front::Source;
use lodc_passes::recipe::{self, Candidate, Declined, Recipe};
use lodc_passes::{Facts, Generated, Pass, Shader, Stage, all_passes, specialize};
use naga::valid::{Capabilities, ValidationFlags, Validator};
use similar::TextDiff;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::{fs, thread};

/// Random recipes altogether, spread evenly over the shaders.
const RECIPES: usize = 1000;
/// About how many pairs of candidates of one shader are made in both orders.
const PAIRS: usize = 400;
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

/// Whether a pass moves values between stages.
fn moves(pass: &str) -> bool {
    ["vertex-motion", "to-parameter"].contains(&pass)
}

/// Every candidate of every pass, those that move values between stages last.
fn offered(shader: &Shader, facts: &Facts) -> Vec<Candidate> {
    all_passes()
        .flat_map(|pass| pass.candidates(shader, facts))
        .collect()
}

/// The materials, the adversarial shaders and the passes' fixtures, in normal form.
fn subjects() -> Vec<Subject> {
    let mut paths = fixtures::complete();
    let fixtures_of = |pass: &dyn Pass| {
        let folder = Path::new("testdata/passes").join(pass.name());
        fixtures::shaders(folder)
    };
    let (within, between): (Vec<_>, Vec<_>) = all_passes().partition(|pass| !moves(pass.name()));
    paths.extend(within.into_iter().flat_map(fixtures_of));
    let mut random = Random::new(paths.len());
    paths.extend(between.into_iter().flat_map(fixtures_of));
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
            let candidates = offered(&shader, &facts);
            if candidates.is_empty() {
                break;
            }
            let mut candidate = candidates[random.below(candidates.len())].clone();
            // A search changes numbers for better ones.
            let pass = shader
                .passes()
                .of_name(&candidate.pass)
                .expect("passes offer under their own names");
            let numbers: Vec<f32> = candidate.numbers().map(|n| n * 0.75 + 0.125).collect();
            if random.below(4) == 0
                && let Some(better) = pass.with_numbers(&candidate, &numbers)
                && pass.applies(&shader, &better).is_ok()
            {
                candidate = better;
            }
            let candidate = &candidate;
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
        let stages = [Stage::Vertex, Stage::Fragment, Stage::Parameter];
        let entries = stages.iter().filter_map(|stage| {
            let point = shader.entry_point(*stage)?;
            Some((*stage, point.name.as_str()))
        });
        let entries: Vec<_> = entries.collect();
        let again = lodc_passes::normalize_stages(shader.module(), &entries, 100_000)
            .expect("edits make shaders smaller");
        // What a module alone does not say is how the texels of new textures are computed.
        if shader.generated().is_empty() {
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
        let candidates = offered(&subject.shader, &subject.facts);
        assert_eq!(candidates, offered(&subject.shader.clone(), &subject.facts));
        for (i, candidate) in candidates.iter().enumerate() {
            assert!(
                !candidates[..i].contains(candidate),
                "{}: {candidate} is offered twice",
                subject.name
            );
            let pass = subject
                .shader
                .passes()
                .of_name(&candidate.pass)
                .expect("passes offer under their own names");
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
        .flat_map(|subject| offered(&subject.shader, &subject.facts))
        .collect();
    let words = [
        "",
        "keep",
        "keep ",
        "keep fs_main",
        "mean",
        "without",
        "best",
        "fit fs_main",
        "fit-within fs_main",
        "seen-mean",
        "affine",
        "interpolate",
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
            4 => {
                candidate.pass = all_passes()
                    .nth(random.below(all_passes().count()))
                    .map_or(String::new(), |pass| pass.name().into())
            }
            _ => {}
        }
        let subject = &subjects[random.below(subjects.len())];
        for pass in all_passes() {
            // Asked of the wrong pass as well: an answer is all that counts.
            if pass.applies(&subject.shader, &candidate).is_ok() && pass.name() == candidate.pass {
                let next = pass.apply(&subject.shader, &candidate);
                assert!(next.validate().is_ok(), "{}: {candidate}", subject.name);
            }
        }
    });
}

/// Whether a value that one of two edits moves is the same with the other edit made before: what has been moved is not
/// changed any more.
fn independent(edits: [&Candidate; 2], alone: [&Shader; 2], one: &Shader, other: &Shader) -> bool {
    // Into a branch goes what nothing else needs at the time: these are made first, in their order.
    if edits
        .iter()
        .any(|edit| specialize::branched(edit).is_some())
    {
        return false;
    }
    // What has gone into a texture is not removed from it any more.
    let made = |shader: &Shader| -> Vec<_> { shader.made().map(Generated::definition).collect() };
    let is_removal = |edit: &&Candidate| edit.pass == "texture-removal";
    if edits.iter().any(is_removal) && made(one) != made(other) {
        return false;
    }
    let of_vertices = |shader: &Shader| shader.stage_fingerprint(Stage::Vertex);
    match edits.map(|edit| edit.pass == "vertex-motion") {
        [true, false] => of_vertices(alone[0]) == of_vertices(other),
        [false, true] => of_vertices(alone[1]) == of_vertices(one),
        // The statements of two loops stay in the order in which they were moved.
        [true, true] => alone.iter().all(|shader| {
            let function = shader.function(Stage::Vertex);
            function.is_some_and(|function| function.local_variables.is_empty())
        }),
        [false, false] => true,
    }
}

#[test]
fn two_orders_of_independent_edits_are_one_variant() {
    let subjects = subjects();
    let both_ways = AtomicUsize::new(0);
    on_two_threads(subjects.len(), |i| {
        let Subject {
            name,
            shader,
            facts,
        } = &subjects[i];
        let mut random = Random::new(i);
        let candidates = offered(shader, facts);
        let after: Vec<Shader> = candidates
            .iter()
            .map(|candidate| recipe::apply(shader, candidate).expect("it was offered"))
            .collect();
        // All pairs are too many: some, spread over all. Of those with a moved value, as many.
        let within = candidates.iter().filter(|edit| !moves(&edit.pass)).count();
        for (count, moved) in [(within, false), (candidates.len(), true)] {
            let pairs = count * count;
            let stride = (pairs / PAIRS).max(1);
            let mut pair = random.below(stride);
            while pair < pairs {
                let (first, second) = (pair / count, pair % count);
                pair += 1 + random.below(2 * stride - 1);
                let edits = [&candidates[first], &candidates[second]];
                if moved != edits.iter().any(|edit| edit.pass == "vertex-motion") {
                    continue;
                }
                // Where one takes the other's site or operand away, that order is declined.
                if first < second
                    && let Ok(one) = recipe::apply(&after[first], edits[1])
                    && let Ok(other) = recipe::apply(&after[second], edits[0])
                    && independent(edits, [&after[first], &after[second]], &one, &other)
                {
                    let [first, second] = edits;
                    assert_eq!(
                        one.fingerprint(),
                        other.fingerprint(),
                        "{name}: {first}; {second}"
                    );
                    both_ways.fetch_add(1, Ordering::Relaxed);
                }
            }
        }
    });
    assert!(both_ways.into_inner() > 10 * PAIRS);
}

/// Pairs of edits, each with a shader, whose two orders gave two variants once.
const ONCE_TWO_VARIANTS: [(&str, [&str; 3], [&str; 3], Orders); 6] = [
    // The second makes a read equal to the first one's, and so one value of two.
    (
        "drops_shadow_comparison",
        ["texture-removal", "near", "seen-mean = 1e30"],
        ["op-removal", "far.mul", "keep fs_main.place.xy"],
        Orders::One,
    ),
    // A part of the `if` becomes a selection, which asks for the same test.
    (
        "returned_values",
        ["op-removal", "sphere.result.found.greater", "reject"],
        [
            "op-removal",
            "nearer_2.result.normal_3",
            "keep fs_main.nearer_2.result.normal",
        ],
        Orders::One,
    ),
    // A switch with one case is kept for a `break`, and the `break` goes.
    (
        "switches",
        ["op-removal", "kind.mul", "mean = 0.5"],
        ["op-removal", "pick.if.greater", "accept"],
        Orders::Both,
    ),
    // A load becomes a value that is stored, too.
    (
        "out_pointers",
        ["op-removal", "ray.length", "keep fs_main.uv.x"],
        ["op-removal", "ray.length_2", "mean = 2"],
        Orders::One,
    ),
    // The first leaves a value that nobody needs, and what the second leaves is equal to it.
    (
        "own_autolod",
        ["op-removal", "shade", "keep fs_main.shade.mul"],
        ["op-removal", "shade_2.mul_4", "mean = 0.5"],
        Orders::Both,
    ),
    // A value in a loop becomes equal to one in front of it, whose own users go.
    (
        "pbr",
        ["op-removal", "ambient_light.f", "mean = 1, 0, 1"],
        [
            "op-removal",
            "direct_light.distribution.a2",
            "keep fs_main.read_surface.surface.alpha",
        ],
        Orders::Both,
    ),
];

/// In which orders two edits can be made.
#[derive(Debug, PartialEq)]
enum Orders {
    Both,
    One,
}

#[test]
fn orders_of_edits_that_were_two_variants_once_are_one_or_declined() {
    let subjects = subjects();
    for (name, first, second, orders) in &ONCE_TWO_VARIANTS {
        let subject = subjects.iter().find(|subject| subject.name == *name);
        let shader = &subject.expect("the shader is there").shader;
        let [first, second] = [first, second].map(|[pass, site, choice]| {
            let (choice, value) = choice.split_once(" = ").unwrap_or((choice, ""));
            let number = |number: &str| number.parse::<f32>().expect("a number").to_bits();
            Candidate {
                pass: (*pass).into(),
                site: format!("fs_main.{site}").as_str().into(),
                choice: choice.into(),
                value: match value {
                    "" => Vec::new(),
                    list => list.split(", ").map(number).collect(),
                },
            }
        });
        let in_order = |edits: [&Candidate; 2]| {
            let mut recipe = edits.into_iter();
            recipe.try_fold(shader.clone(), |shader, edit| recipe::apply(&shader, edit))
        };
        let made = [in_order([&first, &second]), in_order([&second, &first])];
        let prints: Vec<_> = made.iter().flatten().map(Shader::fingerprint).collect();
        let found = match prints[..] {
            [one, other] => {
                assert_eq!(one, other, "{name}: {first}; {second}");
                Orders::Both
            }
            [_] => Orders::One,
            _ => panic!("{name}: {first}; {second}: {made:?}"),
        };
        assert_eq!(found, *orders, "{name}: {first}; {second}");
    }
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
    for candidate in offered(&old, &synthetic::facts(&old)) {
        let recipe = Recipe(vec![candidate]);
        let before = recipe.replay(&old).expect("it was offered");
        let after = recipe
            .replay(&new)
            .unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(before.fingerprint(), after.fingerprint(), "{}", recipe.0[0]);
    }
}
