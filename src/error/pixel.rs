//! A pixel of the reference, and how far a drawn pixel is from it.

use crate::eval::image::srgb_encode;

/// Encoded colours of a pixel over a black background, and over a white one.
pub(crate) type Shown = [[f32; 3]; 2];

/// The backgrounds themselves.
pub(crate) const BACKGROUNDS: Shown = [[0.0; 3], [1.0; 3]];

/// A pixel of the reference: 4 x 4 samples, averaged in linear light over each background.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ReferencePixel {
    over: Shown,
}

impl ReferencePixel {
    /// From the means over all samples of the pixel, in linear light: of what is displayed over black, and of how much
    /// more that is over white, which is 1 where a sample shows nothing. A NaN in the reference counts as 0.
    pub(crate) fn new(mean: [f32; 3], through: [f32; 3]) -> Self {
        Self {
            over: [
                mean.map(srgb_encode),
                std::array::from_fn(|i| srgb_encode(mean[i] + through[i])),
            ],
        }
    }

    /// Its encoded colours over black and over white.
    pub(crate) fn over(&self) -> Shown {
        self.over
    }

    /// What is drawn less the reference: three channels over black, then three over white. A picture that does not
    /// cover the pixel shows [`BACKGROUNDS`]. A NaN on the screen is as wrong as a colour can be: 1.
    pub(crate) fn difference(&self, drawn: &Shown) -> [f32; 6] {
        std::array::from_fn(|i| {
            let (drawn, reference) = (drawn[i / 3][i % 3], self.over[i / 3][i % 3]);
            if drawn.is_nan() {
                1.0
            } else {
                drawn - reference
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fully_covered_pixel_does_not_see_the_background() {
        let pixel = ReferencePixel::new([0.25; 3], [0.0; 3]);
        let same = [srgb_encode(0.25); 3];
        assert_eq!(pixel.difference(&[same; 2]), [0.0; 6]);
        let moved = pixel.difference(&[[same[0] + 0.125, same[1], same[2]]; 2]);
        assert_eq!(moved, [0.125, 0.0, 0.0, 0.125, 0.0, 0.0]);
    }

    #[test]
    fn a_missing_pixel_differs_by_its_coverage() {
        // Half covered by black: black over black; over white the encoding of 0.5.
        let pixel = ReferencePixel::new([0.0; 3], [0.5; 3]);
        let white = pixel.difference(&BACKGROUNDS)[3];
        assert!((white - (1.0 - 0.735_357)).abs() < 1e-6, "{white}");
        assert_eq!(pixel.difference(&BACKGROUNDS)[..3], [0.0; 3]);
        assert_eq!(
            ReferencePixel::new([0.0; 3], [1.0; 3]).difference(&BACKGROUNDS),
            [0.0; 6]
        );
    }

    #[test]
    fn a_nan_is_the_largest_difference_and_never_skipped() {
        let pixel = ReferencePixel::new([0.5; 3], [0.0; 3]);
        let found = pixel.difference(&[[f32::NAN, 0.0, srgb_encode(0.5)]; 2]);
        assert_eq!((found[0], found[3]), (1.0, 1.0));
        assert!(found[1] < -0.7 && found[2] == 0.0);
        // A NaN of the original is a black reference, from which the original's own NaN differs wholly.
        let broken = ReferencePixel::new([f32::NAN; 3], [0.0; 3]);
        assert_eq!(broken.difference(&[[f32::NAN; 3]; 2]), [1.0; 6]);
        assert_eq!(broken.difference(&[[0.0; 3]; 2]), [0.0; 6]);
    }
}
