//! What a display shows of fragments that were shaded: of the reference, and of a picture.

use super::{BACKGROUNDS, Reference, ReferencePixel, Shown, displayed, encoded, held, through};
use crate::eval::draw::{Layers, Shading, each_visible, resolve};
use crate::eval::image::Picture;
use crate::eval::raster::Coverage;
use crate::scene::Output;

/// The pixels that the reference or a fragment covers, and the place of each in the picture, `y * width + x`, sorted.
pub(crate) fn reference_of<'c>(
    fine: &Coverage,
    shading: &Shading,
    coverages: impl Iterator<Item = &'c Coverage>,
    output: Output,
) -> (Reference, Vec<u32>) {
    let means = Means::of(fine, shading, output);
    let mut pixels: Vec<u32> = (0..)
        .zip(means.covered())
        .filter(|(_, c)| **c > 0.0)
        .map(|(i, _)| i)
        .collect();
    pixels.extend(coverages.flat_map(Coverage::pixels));
    pixels.sort_unstable();
    pixels.dedup();
    let reference = Reference::new(pixels.iter().map(|pixel| {
        let at = *pixel as usize;
        let place = [*pixel % means.picture.width, *pixel / means.picture.width];
        (place, means.pixel(at), means.covered()[at])
    }));
    (reference, pixels)
}

/// The means of a reference's fine pixels over each pixel.
pub(crate) struct Means {
    picture: Picture,
    behind: Option<Picture>,
}

impl Means {
    /// Of fragments at so many fine pixels a pixel as their coverage has.
    pub(crate) fn of(fine: &Coverage, shading: &Shading, output: Output) -> Self {
        let (picture, behind) = over_black(fine, shading, output);
        Self {
            picture: picture.box_filtered(fine.grid),
            behind: behind.map(|behind| behind.box_filtered(fine.grid)),
        }
    }

    /// How much of each pixel is covered, row by row.
    pub(crate) fn covered(&self) -> &[f32] {
        &self.picture.covered
    }

    /// What a pixel should show.
    pub(crate) fn pixel(&self, at: usize) -> ReferencePixel {
        let [r, g, b, _] = self.picture.pixels[at];
        let through = match &self.behind {
            Some(behind) => [0, 1, 2].map(|i| behind.pixels[at][i]),
            None => [1.0 - self.picture.covered[at]; 3],
        };
        ReferencePixel::new([r, g, b], through)
    }
}

/// What a display shows over black, in linear light, and, where fragments are blended, how much more over white.
pub(crate) fn over_black(
    fine: &Coverage,
    shading: &Shading,
    output: Output,
) -> (Picture, Option<Picture>) {
    if !fine.blends() {
        let mut picture = resolve(fine, shading);
        for (colour, covered) in picture.pixels.iter_mut().zip(&picture.covered) {
            if *covered > 0.0 {
                let [r, g, b] = displayed(output, *colour);
                *colour = [r, g, b, 1.0];
            }
        }
        return (picture, None);
    }
    let mut picture = Picture::empty(fine.width, fine.height);
    let mut behind = Picture::empty(fine.width, fine.height);
    let layers = Layers::new(fine, shading, picture.pixels.len(), |_, pixel| pixel);
    for place in 0..picture.pixels.len() {
        let colour = layers.compose(place, shading, |colour| held(output, colour));
        let [r, g, b] = through(output, colour.unwrap_or_default());
        behind.pixels[place] = [r, g, b, 1.0];
        if let Some(colour) = colour {
            let [r, g, b] = displayed(output, colour);
            picture.pixels[place] = [r, g, b, 1.0];
            picture.covered[place] = 1.0;
        }
    }
    (picture, Some(behind))
}

/// What a display shows at so many places of a picture, over each background; `place` says where a fragment is, from its
/// number and its pixel. Where nothing is seen, that is the background.
pub(crate) fn colours(
    coverage: &Coverage,
    shading: &Shading,
    (places, place): (usize, impl Fn(usize, u32) -> u32),
    output: Output,
) -> Vec<Shown> {
    let mut colours = vec![BACKGROUNDS; places];
    if coverage.blends() {
        let layers = Layers::new(coverage, shading, places, place);
        for (place, shown) in colours.iter_mut().enumerate() {
            let colour = layers.compose(place, shading, |colour| held(output, colour));
            if let Some(colour) = colour {
                let black = displayed(output, colour);
                let more = through(output, colour);
                let white = std::array::from_fn(|i| black[i] + more[i]);
                *shown = [black, white].map(encoded);
            }
        }
        return colours;
    }
    each_visible(coverage, shading, places, place, |place, fragment| {
        colours[place as usize] = [encoded(displayed(output, shading.colours[fragment])); 2];
    });
    colours
}
