//! Blending: how the fragments of a draw get into the picture, and the order in which a pixel's fragments are composed.
//!
//! Opaque draws come first: the nearest of their fragments hides what is behind. Blended ones are tested against
//! that depth and write none; those in front of it are composed from the farthest to the nearest, pixel by pixel. That is
//! the picture that a host comes as near to as its sorting allows, and it does not depend on the order of triangles.

use super::Shading;
use crate::eval::raster::{Block, Coverage};

/// What becomes of a fragment's colour and of what is behind it. With the shader's colour `c` and alpha `a` of
/// location 0, and a target that holds premultiplied colour `C` and coverage `A`:
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Blend {
    /// `C = c`, `A = 1`, depth is written. The shader's alpha is not seen.
    #[default]
    Opaque,
    /// `C = a c + (1 - a) C`, `A = a + (1 - a) A`: source alpha, one minus source alpha.
    Alpha,
    /// `C = c + (1 - a) C`, `A = a + (1 - a) A`: one, one minus source alpha.
    Premultiplied,
    /// `C = a c + C`, `A = A`: source alpha, one; of alpha zero, one.
    Additive,
}

impl Blend {
    /// All of them.
    pub const ALL: [Self; 4] = [
        Self::Opaque,
        Self::Alpha,
        Self::Premultiplied,
        Self::Additive,
    ];

    /// How a scene names it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Opaque => "opaque",
            Self::Alpha => "alpha",
            Self::Premultiplied => "premultiplied",
            Self::Additive => "additive",
        }
    }

    /// The one of a name.
    pub fn of_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|blend| blend.name() == name)
    }

    /// What a target holds once a fragment's colour has been drawn over what it held. Both are colour and coverage,
    /// the latter premultiplied; alpha is in 0..1.
    pub fn over(self, [r, g, b, a]: [f32; 4], behind: [f32; 4]) -> [f32; 4] {
        let kept = 1.0 - a;
        match self {
            Self::Opaque => [r, g, b, 1.0],
            Self::Alpha => {
                let [red, green, blue, alpha] = behind.map(|c| kept * c);
                [a * r + red, a * g + green, a * b + blue, a + alpha]
            }
            Self::Premultiplied => {
                let [red, green, blue, alpha] = behind.map(|c| kept * c);
                [r + red, g + green, b + blue, a + alpha]
            }
            Self::Additive => {
                let [red, green, blue, alpha] = behind;
                [a * r + red, a * g + green, a * b + blue, alpha]
            }
        }
    }
}

impl Blend {
    /// How much of the light that arrives from a fragment's place is its own, by its colour as the target holds it:
    /// its alpha. What is premultiplied may add more light than it hides.
    fn share(self, [r, g, b, a]: [f32; 4]) -> f32 {
        let share = match self {
            Self::Opaque => 1.0,
            Self::Alpha | Self::Additive => a,
            Self::Premultiplied => a.max(r).max(g).max(b),
        };
        of_one(share)
    }

    /// How much of what is behind a fragment is still seen.
    fn kept(self, [_, _, _, a]: [f32; 4]) -> f32 {
        match self {
            Self::Opaque => 0.0,
            Self::Alpha | Self::Premultiplied => of_one(1.0 - a),
            Self::Additive => 1.0,
        }
    }
}

/// A share, within 0..1. A NaN is none, which `clamp` would keep.
#[allow(clippy::manual_clamp)]
fn of_one(share: f32) -> f32 {
    share.max(0.0).min(1.0)
}

/// How a draw gets into the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DrawState {
    /// What becomes of its colours. Opaque draws are drawn first and write depth; the others are drawn after them in
    /// the order from far to near, are tested with `less`, and write none.
    pub blend: Blend,
    /// Whether its back faces are left out. Of opaque draws they are not.
    pub front_only: bool,
}

/// The state of a draw among those of a mesh: one beyond the last is as the last, and without any all is opaque.
pub(crate) fn state_of(states: &[DrawState], draw: usize) -> DrawState {
    let state = states.get(draw).or(states.last());
    state.copied().unwrap_or_default()
}

/// The fragments that a picture is made of, place by place, from the farthest to the nearest.
pub(crate) struct Layers {
    /// For each place its farthest fragment.
    first: Vec<u32>,
    /// For each fragment the next nearer one.
    layers: Vec<Layer>,
}

#[derive(Clone, Copy)]
struct Layer {
    next: u32,
    depth: f32,
    blend: Blend,
}

const NONE: u32 = u32::MAX;

/// What the fragments of a coverage weigh in its picture, 0..1 each; 0 for those that are hidden.
#[derive(Clone, Debug, PartialEq)]
pub struct Weights {
    /// How much of the light that leaves a fragment's place arrives, through what is in front of it: what the
    /// fragment's opacity is worth.
    pub arrives: Vec<f32>,
    /// The part of it that is the fragment's own, by its alpha: what its colour is worth.
    pub share: Vec<f32>,
}

impl Layers {
    /// Finds them. `place` numbers the pixels, below `places`, from a fragment and its fine pixel.
    pub(crate) fn new(
        coverage: &Coverage,
        shading: &Shading,
        places: usize,
        place: impl Fn(usize, u32) -> u32,
    ) -> Self {
        let mut found = Self {
            first: vec![NONE; places],
            layers: vec![
                Layer {
                    next: NONE,
                    depth: 1.0,
                    blend: Blend::Opaque,
                };
                coverage.fragments
            ],
        };
        let alive = |block: &Block, visit: &mut dyn FnMut(usize, usize, f32)| {
            for (i, lane) in block.covered.lanes().enumerate() {
                let fragment = block.first + i;
                if shading.alive[fragment] {
                    let place = place(fragment, block.pixels[lane]) as usize;
                    visit(fragment, place, shading.depth(fragment, block.depths[lane]));
                }
            }
        };
        let (opaque, blended): (Vec<&Block>, Vec<&Block>) = coverage
            .blocks
            .iter()
            .partition(|block| coverage.state(block.draw).blend == Blend::Opaque);
        for block in opaque {
            alive(block, &mut |fragment, place, depth| {
                let nearest = match found.first[place] {
                    NONE => 1.0,
                    other => found.layers[other as usize].depth,
                };
                if depth < nearest {
                    found.layers[fragment].depth = depth;
                    found.first[place] = fragment as u32;
                }
            });
        }
        for block in blended {
            let blend = coverage.state(block.draw).blend;
            alive(block, &mut |fragment, place, depth| {
                found.insert(fragment, place, depth, blend);
            });
        }
        found
    }

    /// Puts a blended fragment in front of those that are as far or farther, unless something opaque hides it.
    fn insert(&mut self, fragment: usize, place: usize, depth: f32, blend: Blend) {
        let mut before = NONE;
        let mut next = self.first[place];
        while let Some(layer) = self.layers.get(next as usize) {
            let hidden = layer.blend == Blend::Opaque && depth >= layer.depth;
            if hidden {
                return;
            }
            if layer.blend != Blend::Opaque && layer.depth < depth {
                break;
            }
            before = next;
            next = layer.next;
        }
        if depth >= 1.0 {
            return;
        }
        self.layers[fragment] = Layer { next, depth, blend };
        match self.layers.get_mut(before as usize) {
            Some(layer) => layer.next = fragment as u32,
            None => self.first[place] = fragment as u32,
        }
    }

    /// The fragments at a place, from the farthest to the nearest, with how they are drawn over those before.
    pub(crate) fn at(&self, place: usize) -> impl Iterator<Item = (usize, Blend)> + '_ {
        let mut next = self.first[place];
        std::iter::from_fn(move || {
            let layer = self.layers.get(next as usize)?;
            let fragment = std::mem::replace(&mut next, layer.next);
            Some((fragment as usize, layer.blend))
        })
    }

    /// What each fragment weighs in the picture, its colours being as the target holds them.
    pub(crate) fn weights(
        &self,
        shading: &Shading,
        held: impl Fn([f32; 4]) -> [f32; 4],
    ) -> Weights {
        let mut weights = Weights {
            arrives: vec![0.0; self.layers.len()],
            share: vec![0.0; self.layers.len()],
        };
        for place in 0..self.first.len() {
            let layers: Vec<_> = self.at(place).collect();
            let mut arrives = 1.0;
            for (fragment, blend) in layers.into_iter().rev() {
                let colour = held(shading.colours[fragment]);
                weights.arrives[fragment] = arrives;
                weights.share[fragment] = arrives * blend.share(colour);
                arrives *= blend.kept(colour);
            }
        }
        weights
    }

    /// What is composed at a place, of colours as the target holds them: premultiplied colour and coverage. `None`
    /// where no background looks different for it.
    pub(crate) fn compose(
        &self,
        place: usize,
        shading: &Shading,
        held: impl Fn([f32; 4]) -> [f32; 4],
    ) -> Option<[f32; 4]> {
        let composed = self.at(place).fold([0.0; 4], |behind, (fragment, blend)| {
            blend.over(held(shading.colours[fragment]), behind)
        });
        (composed != [0.0; 4]).then_some(composed)
    }
}
