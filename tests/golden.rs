//! Golden files: what each pass makes of each of its fixtures, as full-context diffs.
//!
//! Beside `testdata/passes/<pass>/<case>.wgsl` lies `<case>.diff`: for every candidate in order, the
//! fragment stage before and after, as it would be emitted, of a pass that changes others too all; for what the pass
//! declines, the reason.
//! A fixture may open with comments that are read here:
//!
//! ```text
//! // expect: 3 candidates
//! // facts: fs_main.size min 0.5 max 0.9 mean 0.7      one number for all components, or one for each
//! // facts: fs_main.rare unseen                          or count 16: by fewer samples than others
//! // facts: texture albedo dynamic                      or flat: one colour everywhere
//! // facts: fixed material.flags 5                     stated by the scene; a float has a point
//! // facts: texture bumps slopes 0.25 0.125             a map of normals: the variance along both axes, level by level
//! // facts: texture dust size 64                        texels along each edge, or layers; 16 and 4 otherwise
//! // facts: sampler tiled repeats                       along both axes
//! // in turn: fs_main.diffuse_3 fs_main.specular_3     only what the first candidates of these make, one after the other
//! // facts: texture sky harmonics 1                     smooth: near such a sum, of 0.5, 0.25, 0.125 and so on
//! ```
//!
//! The facts are those of [`synthetic`] otherwise. `LODC_BLESS=1 cargo test --test golden` writes the golden
//! files anew; the `expect` line is for hands only, so that blessing carelessly fails.

mod fixtures;
mod moved;
mod synthetic;

use fixtures::Goldens;

use lodc::compile::normal_form;
use lodc::emit::{self, EmitLevel, Form, Output};
use lodc::front::Source;
use lodc_passes::basis::Basis;
use lodc_passes::facts::{Facts, Fit, ValueFacts};
use lodc_passes::{Pass, Shader, Stage, ValueId, all_passes, specialize};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

#[test]
fn passes_do_to_their_fixtures_what_the_goldens_say() {
    let mut goldens = Goldens::of("golden");
    for pass in all_passes() {
        for path in fixtures::shaders(Path::new("testdata/passes").join(pass.name())) {
            let (golden, offered) = golden(pass, &path);
            let name = format!(
                "{}/{}",
                pass.name(),
                path.file_stem().unwrap_or_default().display()
            );
            let text = fs::read_to_string(&path).expect("the fixture can be read");
            let expected = text
                .lines()
                .find_map(|line| line.strip_prefix("// expect: "));
            let found = format!("{offered} candidates");
            if expected != Some(&found) {
                let expected = expected.unwrap_or("nothing");
                goldens.wrong(format!("{name} expects {expected}, but offers {found}\n"));
            }
            goldens.compare(&name, &path.with_extension("diff"), &golden);
        }
    }
    goldens.finish();
}

#[test]
fn parameters_are_written_as_rust_as_the_goldens_say() {
    let mut goldens = Goldens::of("golden");
    for path in fixtures::shaders("testdata/parameters") {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let (_, files) = moved::with_parameters(&path);
        let written = files
            .iter()
            .find(|(name, _)| name.extension().is_some_and(|e| e == "rs"));
        let (_, written) = written.unwrap_or_else(|| panic!("{name} has no parameters"));
        let written = String::from_utf8_lossy(written);
        goldens.compare(&name, &path.with_extension("lod.rs"), &written);
    }
    goldens.finish();
}

/// The golden text of a fixture, and how many candidates it has.
fn golden(pass: &dyn Pass, path: &Path) -> (String, usize) {
    let fail = |e: &dyn std::fmt::Display| -> ! { panic!("{}: {e}", path.display()) };
    let text = fs::read_to_string(path).expect("the fixture can be read");
    // Without its comments, so that those are not in every diff.
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let source = Source::parse(&name, text.as_str()).unwrap_or_else(|e| fail(&e));
    let shader = normal_form(&source).unwrap_or_else(|e| fail(&e));
    let facts = facts(&shader, &text).unwrap_or_else(|line| fail(&format!("cannot read `{line}`")));
    let all = ["vertex-motion", "to-parameter", "texture-collapse"].contains(&pass.name());
    let stages = |variant: &Shader, all| stages((&source, &shader), variant, all);
    let mut lines = text.lines();
    let in_turn = lines.find_map(|line| line.strip_prefix("// in turn: "));
    let mut golden = String::new();
    let mut offered = 0;
    for considered in pass.consider(&shader, &facts) {
        let candidate = considered.candidate;
        if let Some(declined) = considered.declined {
            let _ = writeln!(golden, "# {candidate}: declined, {declined}\n");
            continue;
        }
        offered += 1;
        let _ = writeln!(golden, "# {candidate}");
        assert_eq!(
            pass.applies(&shader, &candidate),
            Ok(()),
            "{name}: {candidate}"
        );
        let all = all || specialize::stage(&shader, &candidate) == Some(Stage::Vertex);
        let before = stages(&shader, all);
        let after = stages(&pass.apply(&shader, &candidate), all);
        assert_ne!(before, after, "{name}: {candidate} changes nothing");
        golden.push_str(&fixtures::whole_diff(&before, &after));
        golden.push('\n');
    }
    if let Some(sites) = in_turn {
        golden.clear();
        let mut variant = shader.clone();
        let mut made = Vec::new();
        for site in sites.split(' ') {
            let mut all = pass.candidates(&variant, &facts).into_iter();
            let first = all.find(|candidate| candidate.site.path() == site);
            let candidate = first.unwrap_or_else(|| fail(&format!("`{site}` is not offered then")));
            variant = pass.apply(&variant, &candidate);
            made.push(candidate.to_string());
        }
        let _ = writeln!(golden, "# {}", made.join(", then "));
        let [before, after] = [&shader, &variant].map(|shader| stages(shader, all));
        golden.push_str(&fixtures::whole_diff(&before, &after));
        golden.push('\n');
    }
    if golden.is_empty() {
        golden.push_str("# nothing to consider\n");
    }
    (golden.trim_end().to_owned() + "\n", offered)
}

/// The text of a variant's fragment stage, or of all with what they declare, as emitted.
fn stages((source, base): (&Source, &Shader), shader: &Shader, all: bool) -> String {
    let level = EmitLevel {
        autolod: 1.0,
        shader: shader.clone(),
        distance: 1.0,
        error: 0.0,
        cost: 1.0,
        time: None,
        says: "a variant".into(),
    };
    let output = Output {
        form: Form::Files,
        ..Output::default()
    };
    let files = emit::emit(source, base, &[level], output)
        .unwrap_or_else(|e| panic!("{}: {e}", source.name));
    let mut texts = files.iter().rev();
    let (_, bytes) = texts
        .find(|(name, _)| name.extension().is_some_and(|e| e == "wgsl"))
        .expect("one file a level");
    let text = String::from_utf8(bytes.clone()).expect("WGSL is text");
    let start = match all {
        true => text.find("\n\n").map(|header| header + 2),
        false => text.find("@fragment"),
    };
    text[start.expect("there is a fragment stage")..].to_owned()
}

/// The synthetic facts, changed as the fixture's comments say; the line that cannot be read otherwise.
fn facts(shader: &Shader, text: &str) -> Result<Facts, String> {
    let mut facts = synthetic::facts(shader);
    for line in text.lines() {
        let Some(fact) = line.strip_prefix("// facts: ") else {
            continue;
        };
        let words: Vec<&str> = fact.split_whitespace().collect();
        let read = match words[..] {
            ["texture", name, "dynamic"] => facts.textures.remove(name).map(drop),
            ["texture", name, "flat"] => facts.textures.get_mut(name).map(|texture| {
                for deviation in &mut texture.deviation {
                    *deviation = [0.0; 4];
                }
            }),
            ["texture", name, "slopes", ref levels @ ..] => {
                let slope = |word: &&str| word.parse().ok().map(|number| [number; 2]);
                let slopes: Option<Vec<_>> = levels.iter().map(slope).collect();
                facts
                    .textures
                    .get_mut(name)
                    .zip(slopes)
                    .map(|(texture, slopes)| texture.slopes = slopes)
            }
            ["texture", name, "size", edge] => {
                let texture = facts.textures.get_mut(name);
                let edge = edge.parse().ok();
                texture
                    .zip(edge)
                    .map(|(texture, edge)| texture.size = [edge; 2])
            }
            ["texture", name, "layers", count] => {
                let texture = facts.textures.get_mut(name);
                let count = count.parse().ok();
                texture
                    .zip(count)
                    .map(|(texture, count)| texture.layers = count)
            }
            ["sampler", name, "repeats"] => {
                facts.repeating.insert(name.into());
                Some(())
            }
            ["texture", name, word, degree] => {
                let fit = Basis::parse(word, degree).map(|basis| Fit {
                    basis,
                    numbers: (0..basis.count())
                        .map(|i| [0.5_f32.powi(1 + i as i32); 4])
                        .collect(),
                    lobes: (0..basis.lights())
                        .map(|i| std::array::from_fn(|c| if i == c { 8.0 } else { 0.0 }))
                        .collect(),
                    left: 0.125,
                });
                facts
                    .textures
                    .get_mut(name)
                    .zip(fit)
                    .map(|(texture, fit)| texture.fits.push(fit))
            }
            ["dynamic", path] => {
                facts.dynamic.insert(path.into());
                Some(())
            }
            ["fixed", path, ref numbers @ ..] => {
                let words: Option<Vec<u32>> = numbers.iter().map(|number| word(number)).collect();
                words.map(|words| drop(facts.fixed.insert(path.into(), words)))
            }
            [path, "unseen"] => facts.values.remove(&id(shader, path)).map(drop),
            [path, ..] => facts
                .values
                .get_mut(&id(shader, path))
                .and_then(|value| figures(value, &words[1..])),
            [] => None,
        };
        read.ok_or_else(|| line.to_owned())?;
    }
    Ok(facts)
}

/// The bits of a number: of a float when it has a point.
fn word(number: &str) -> Option<u32> {
    match number.contains('.') {
        true => number.parse().ok().map(f32::to_bits),
        false => number.parse().ok().map(i32::cast_unsigned),
    }
}

fn id(shader: &Shader, path: &str) -> ValueId {
    match shader.find(&path.into()) {
        Some((stage, value)) => shader.id(stage, value).clone(),
        None => path.into(),
    }
}

/// Reads `min 0.5 max 0.9 mean 0.6 0.7 0.8 count 16`.
fn figures(value: &mut ValueFacts, mut words: &[&str]) -> Option<()> {
    while let [word, rest @ ..] = words {
        if let ("count", [count, rest @ ..]) = (*word, rest) {
            value.count = count.parse().ok()?;
            words = rest;
            continue;
        }
        let figure = match *word {
            "mean" => &mut value.mean,
            "min" => &mut value.min,
            "max" => &mut value.max,
            _ => return None,
        };
        let numbers: Vec<f32> = rest.iter().map_while(|word| word.parse().ok()).collect();
        words = &rest[numbers.len()..];
        match numbers[..] {
            [number] => figure.fill(number),
            _ if numbers.len() == figure.len() => figure.copy_from_slice(&numbers),
            _ => return None,
        }
    }
    Some(())
}
