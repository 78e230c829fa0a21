//! A pixel of the reference, and how far a drawn pixel is from it.

use crate::eval::image::srgb_encode;

/// A pixel of the reference: 4 x 4 samples, averaged in linear light over each background.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ReferencePixel {
    /// Encoded colour over black, then over white.
    over: [[f32; 3]; 2],
}

impl ReferencePixel {
    /// From the mean of the covered samples' displayed linear colours, premultiplied (their sum divided by the count
    /// of all samples of the pixel), and the covered share, 0..1. A NaN in the reference counts as 0.
    pub(crate) fn new(mean: [f32; 3], coverage: f32) -> Self {
        Self {
            over: [
                mean.map(srgb_encode),
                mean.map(|c| srgb_encode(c + (1.0 - coverage))),
            ],
        }
    }

    /// Its encoded colours over black and over white.
    pub(crate) fn over(&self) -> [[f32; 3]; 2] {
        self.over
    }

    /// What is drawn less the reference: three channels over black, then three over white. `colour` is
    /// encoded; `None` where the picture does not cover the pixel and shows the background.
    /// A NaN on the screen is as wrong as a colour can be: 1.
    pub(crate) fn difference(&self, colour: Option<[f32; 3]>) -> [f32; 6] {
        let drawn = match colour {
            Some(colour) => [colour; 2],
            None => [[0.0; 3], [1.0; 3]],
        };
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
        let pixel = ReferencePixel::new([0.25; 3], 1.0);
        let same = [srgb_encode(0.25); 3];
        assert_eq!(pixel.difference(Some(same)), [0.0; 6]);
        let moved = pixel.difference(Some([same[0] + 0.125, same[1], same[2]]));
        assert_eq!(moved, [0.125, 0.0, 0.0, 0.125, 0.0, 0.0]);
    }

    #[test]
    fn a_missing_pixel_differs_by_its_coverage() {
        // Half covered by black: black over black; over white the encoding of 0.5.
        let pixel = ReferencePixel::new([0.0; 3], 0.5);
        let white = pixel.difference(None)[3];
        assert!((white - (1.0 - 0.735_357)).abs() < 1e-6, "{white}");
        assert_eq!(pixel.difference(None)[..3], [0.0; 3]);
        assert_eq!(
            ReferencePixel::new([0.0; 3], 0.0).difference(None),
            [0.0; 6]
        );
    }

    #[test]
    fn a_nan_is_the_largest_difference_and_never_skipped() {
        let pixel = ReferencePixel::new([0.5; 3], 1.0);
        let found = pixel.difference(Some([f32::NAN, 0.0, srgb_encode(0.5)]));
        assert_eq!((found[0], found[3]), (1.0, 1.0));
        assert!(found[1] < -0.7 && found[2] == 0.0);
        // A NaN of the original is a black reference, from which the original's own NaN differs wholly.
        let broken = ReferencePixel::new([f32::NAN; 3], 1.0);
        assert_eq!(broken.difference(Some([f32::NAN; 3])), [1.0; 6]);
        assert_eq!(broken.difference(Some([0.0; 3])), [0.0; 6]);
    }
}
