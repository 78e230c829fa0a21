//! Words a recipe for people: what changed, in one short sentence.

use lodc_passes::{Candidate, Recipe, ValueId};

/// How many names a list has before it becomes a number.
const NAMED: usize = 3;

/// What a recipe changed, grouped by pass: lower case, without a full stop. Sites of `entry_point` are named
/// without it.
pub fn says(recipe: &Recipe, entry_point: &str) -> String {
    let mut passes: Vec<&str> = Vec::new();
    for candidate in &recipe.0 {
        if !passes.contains(&candidate.pass.as_str()) {
            passes.push(&candidate.pass);
        }
    }
    let clauses: Vec<String> = passes
        .into_iter()
        .flat_map(|pass| {
            let of_pass: Vec<&Candidate> = recipe.0.iter().filter(|c| c.pass == pass).collect();
            clauses(pass, &of_pass, entry_point)
        })
        .collect();
    match clauses.is_empty() {
        true => "nothing".to_owned(),
        false => clauses.join("; "),
    }
}

/// One clause for each kind of change. The words of a choice are its pass's own; those that several passes
/// share read as a sentence, the others stand as they are.
fn clauses(pass: &str, candidates: &[&Candidate], entry_point: &str) -> Vec<String> {
    let short = |path: &str| -> String {
        path.strip_prefix(entry_point)
            .and_then(|rest| rest.strip_prefix('.'))
            .unwrap_or(path)
            .to_owned()
    };
    let mut means = Vec::new();
    let mut constants = Vec::new();
    let mut kept = Vec::new();
    let mut fitted = Vec::new();
    let mut without = Vec::new();
    let mut widened = Vec::new();
    let mut moved = Vec::new();
    let mut per_draw = Vec::new();
    let mut averaged = Vec::new();
    let mut branched = Vec::new();
    let mut baked = Vec::new();
    let mut smooth = Vec::new();
    let mut others = Vec::new();
    for candidate in candidates {
        let site = short(candidate.site.path());
        match candidate.choice.split_once(' ') {
            Some(("keep", operand)) => {
                let operand = ValueId::from(operand);
                kept.push(format!("{site} keeps {}", short(operand.path())));
            }
            None if candidate.choice == "without" => without.push(site),
            None if candidate.choice.rsplit('-').next() == Some("mean") => means.push(site),
            None if candidate.choice == "best" => constants.push(site),
            Some(("fit" | "fit-within", operand)) => {
                let operand = ValueId::from(operand);
                fitted.push(format!("{site} fitted to {}", short(operand.path())));
            }
            Some(("normal-to-roughness", _)) => widened.push(site),
            Some(("same" | "levels" | "resampled" | "bake", _)) => baked.push(site),
            Some(("harmonics", _)) => smooth.push(format!("{site} replaced by harmonics")),
            Some(("lights", _)) => smooth.push(format!("{site} replaced by lights")),
            Some(("polynomial", _)) => smooth.push(format!("{site} replaced by a polynomial")),
            None if pass == "vertex-motion" => moved.push(site),
            None if candidate.choice == "exact" => per_draw.push(site),
            Some(("average", _)) => averaged.push(site),
            Some(("branch" | "branch-at-one", _)) => branched.push(site),
            _ => others.push(format!("{site}: {}", candidate.choice)),
        }
    }
    let mut clauses = Vec::new();
    match &*means {
        [] => {}
        [one] => clauses.push(format!("{one} replaced by its mean")),
        several => clauses.push(format!(
            "{} replaced by their means",
            listed(several, "values")
        )),
    }
    match &*constants {
        [] => {}
        [one] => clauses.push(format!("{one} replaced by a constant")),
        several => clauses.push(format!(
            "{} replaced by constants",
            listed(several, "values")
        )),
    }
    match smooth.len() {
        0..=2 => clauses.append(&mut smooth),
        n => clauses.push(format!("{n} textures replaced by sums of functions")),
    }
    if !without.is_empty() {
        clauses.push(format!("{} left out", listed(&without, "values")));
    }
    if !widened.is_empty() {
        clauses.push(format!(
            "{} removed, roughness widened",
            listed(&widened, "normal maps")
        ));
    }
    match &*baked {
        [] => {}
        [one] => clauses.push(format!("{one} baked into a texture")),
        several => clauses.push(format!("{} baked into textures", listed(several, "values"))),
    }
    if !moved.is_empty() {
        clauses.push(format!("{} per vertex", listed(&moved, "values")));
    }
    if !averaged.is_empty() {
        clauses.push(format!("{} averaged per draw", listed(&averaged, "values")));
    }
    if !per_draw.is_empty() {
        clauses.push(format!("{} per draw", listed(&per_draw, "values")));
    }
    if !branched.is_empty() {
        clauses.push(format!("{} in a branch", listed(&branched, "values")));
    }
    match kept.len() {
        0..=2 => clauses.append(&mut kept),
        n => clauses.push(format!("{n} operations keep one operand")),
    }
    match fitted.len() {
        0..=2 => clauses.append(&mut fitted),
        n => clauses.push(format!("{n} operations fitted to an operand")),
    }
    match others.len() {
        0..=2 => clauses.append(&mut others),
        n => clauses.push(format!("{n} changes by {pass}")),
    }
    clauses
}

/// `a, b and c`, or `12 values` when there are many.
fn listed(names: &[String], noun: &str) -> String {
    match names {
        many if many.len() > NAMED => format!("{} {noun}", many.len()),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
        [] => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn candidate(pass: &str, site: &str, choice: &str) -> Candidate {
        Candidate {
            pass: pass.into(),
            site: site.into(),
            choice: choice.into(),
            value: Vec::new(),
        }
    }

    #[test]
    fn groups_by_pass_and_drops_the_function() {
        let recipe = Recipe(vec![
            candidate("texture-removal", "main.normal_map", "seen-mean"),
            candidate(
                "op-removal",
                "main.specular.mul",
                "keep main.specular.pow#0123456789abcdef",
            ),
            candidate("texture-removal", "main.albedo", "texture-mean"),
            candidate(
                "texture-removal",
                "main.detail_normal",
                "normal-to-roughness main.alpha#0123456789abcdef",
            ),
            candidate("texture-removal", "main.dusk", "harmonics 2"),
            candidate("op-removal", "main.ambient", "without"),
            candidate("op-removal", "main.sky", "best"),
            candidate("op-removal", "main.pow", "fit main.cosine#0123456789abcdef"),
            candidate("vertex-motion", "main.specular", "interpolate"),
            candidate("vertex-motion", "main.sun", "flat"),
            candidate(
                "specialize",
                "main.sheen",
                "branch main.load#0123456789abcdef",
            ),
            candidate("to-parameter", "main.tint", "exact"),
            candidate(
                "to-parameter",
                "main.glow",
                "average main.at#0123456789abcdef main.up",
            ),
        ]);
        assert_eq!(
            says(&recipe, "main"),
            "normal_map and albedo replaced by their means; dusk replaced by harmonics; detail_normal removed, roughness widened; sky replaced by a constant; ambient left out; specular.mul keeps specular.pow; pow fitted to cosine; specular and sun per vertex; sheen in a branch; glow averaged per draw; tint per draw"
        );
        assert_eq!(says(&Recipe::default(), "main"), "nothing");
    }

    #[test]
    fn many_changes_become_numbers() {
        let mut all = Vec::new();
        for n in 0..5 {
            all.push(candidate(
                "op-removal",
                &format!("main.a.mul.{n}"),
                "keep main.a",
            ));
            all.push(candidate("op-removal", &format!("main.b.{n}"), "mean"));
            all.push(candidate("other", &format!("main.c.{n}"), "half done"));
        }
        assert_eq!(
            says(&Recipe(all), "main"),
            "5 values replaced by their means; 5 operations keep one operand; 5 changes by other"
        );
    }
}
