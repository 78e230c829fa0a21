//! What textures that are made for levels would gain where the host does not bind them: samples at the same coordinates
//! collapsed where a level ends.

use super::kept::Kept;
use lodc_passes::texture_collapse::{self, TextureCollapse};
use lodc_passes::{Facts, Pass, Shader, recipe};

/// A shader with all that can be collapsed texel by texel; nothing where nothing can.
pub(super) fn collapsed(shader: &Shader, facts: &Facts, kept: &Kept) -> Option<Shader> {
    let mut collapsed: Option<Shader> = None;
    loop {
        let shader = collapsed.as_ref().unwrap_or(shader);
        let candidates = TextureCollapse.candidates(shader, facts).into_iter();
        let mut candidates = candidates.filter(|candidate| {
            texture_collapse::is_texel_by_texel(candidate) && !kept.refuses(candidate)
        });
        let next = candidates.find_map(|candidate| {
            let made = recipe::apply(shader, &candidate).ok()?;
            kept.holds(&made).then_some(made)
        });
        match next {
            Some(made) => collapsed = Some(made),
            None => return collapsed,
        }
    }
}
