//! What is the same for a whole draw, moved to parameters where a level ends: it costs no error, so that the search need
//! not choose it.

use super::kept::Kept;
use lodc_passes::to_parameter::ToParameter;
use lodc_passes::{Candidate, Class, Facts, Pass, Recipe, Shader, recipe};

/// A recipe with all that can be moved exactly but for what is to be kept, and the shader that it makes; nothing where
/// nothing can.
pub(super) fn with_exact(
    recipe: &Recipe,
    shader: &Shader,
    kept: &Kept,
) -> Option<(Recipe, Shader)> {
    let mut recipe = recipe.clone();
    let mut moved = None;
    loop {
        let shader = moved.as_ref().unwrap_or(shader);
        // What is exact asks for no facts.
        let candidates = ToParameter.candidates(shader, &Facts::default());
        let mut exact = candidates
            .into_iter()
            .filter(|candidate| is_exact(candidate) && !kept.refuses(candidate));
        let next = exact.find_map(|candidate| {
            let made = recipe::apply(shader, &candidate).ok()?;
            kept.holds(&made).then_some((candidate, made))
        });
        let Some((candidate, made)) = next else {
            break;
        };
        recipe.0.push(candidate);
        moved = Some(made);
    }
    moved.map(|shader| (recipe, shader))
}

/// A recipe without what [`with_exact`] has put behind it.
pub(super) fn without_exact(recipe: &Recipe) -> Recipe {
    let kept = recipe.0.iter().filter(|candidate| !is_exact(candidate));
    Recipe(kept.cloned().collect())
}

/// Whether a candidate moves to parameters what is the same for a whole draw.
pub(super) fn is_exact(candidate: &Candidate) -> bool {
    candidate.pass == ToParameter.name() && ToParameter.class(candidate) == Class::Lossless
}
