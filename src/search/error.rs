//! The error of a picture against the reference: DESIGN's `E`, with its constants stated.
//!
//! Colours are compared as a display shows them: sRGB-encoded, clamped to 0..1, premultiplied with
//! coverage, as the mean over a black and a white background and three channels. The sum runs over
//! the pixels that the reference or the picture covers, and is divided by the reference's coverage.
//! This is eq. 6 of Liang 2022; the RMSE is its root.

use crate::eval::image::{srgb_decode, srgb_encode};
use crate::scene::{Output, ToneMapping};

/// What a display shows of a fragment's colour, in linear light of 0..1. NaN stays NaN.
pub(crate) fn displayed(output: Output, colour: [f32; 4]) -> [f32; 3] {
    let [r, g, b, _] = colour;
    [r, g, b].map(|c| {
        if c.is_nan() {
            return c;
        }
        match output {
            Output::Display => c.clamp(0.0, 1.0),
            Output::Encoded => srgb_decode(c),
            Output::Linear {
                exposure,
                tone_mapping,
            } => {
                let light = (c * exposure).max(0.0);
                let mapped = match tone_mapping {
                    ToneMapping::None => light,
                    ToneMapping::Reinhard => light / (1.0 + light),
                    // Narkowicz 2015.
                    ToneMapping::Aces => {
                        light * (2.51 * light + 0.03) / (light * (2.43 * light + 0.59) + 0.14)
                    }
                };
                // An infinite light is as bright as can be.
                if mapped.is_nan() {
                    1.0
                } else {
                    mapped.min(1.0)
                }
            }
        }
    })
}

/// The same as sRGB, 0..1: what the error compares.
pub(crate) fn encoded(output: Output, colour: [f32; 4]) -> [f32; 3] {
    displayed(output, colour).map(|c| if c.is_nan() { c } else { srgb_encode(c) })
}

/// A pixel of the reference: 4 x 4 samples, averaged in linear light over each background.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ReferencePixel {
    /// Encoded colour over black.
    black: [f32; 3],
    /// Encoded colour over white.
    white: [f32; 3],
}

impl ReferencePixel {
    /// From the sum of the covered samples' displayed linear colours and the covered share, 0..1.
    /// `mean` is premultiplied: the sum divided by the count of all samples of the pixel.
    pub(crate) fn new(mean: [f32; 3], coverage: f32) -> Self {
        Self {
            black: mean.map(srgb_encode),
            white: mean.map(|c| srgb_encode(c + (1.0 - coverage))),
        }
    }

    /// Squared difference, mean over backgrounds and channels, and the largest single difference.
    /// `colour` is encoded; `None` where the picture does not cover the pixel.
    pub(crate) fn difference(&self, colour: Option<[f32; 3]>) -> (f64, f32) {
        let (black, white) = match colour {
            Some(colour) => (colour, colour),
            None => ([0.0; 3], [1.0; 3]),
        };
        let mut square = 0.0;
        let mut largest = 0.0_f32;
        for channel in 0..3 {
            for (reference, have) in [
                (self.black[channel], black[channel]),
                (self.white[channel], white[channel]),
            ] {
                // A NaN on the screen is as wrong as a colour can be.
                let difference = if have.is_nan() {
                    1.0
                } else {
                    (reference - have).abs()
                };
                square += f64::from(difference) * f64::from(difference);
                largest = largest.max(difference);
            }
        }
        (square / 6.0, largest)
    }
}

/// Error sums of one variant over a set of samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ErrorSum {
    /// Sum of squared differences, each the mean over backgrounds and channels.
    pub squares: f64,
    /// Sum of the reference's coverage, in pixels.
    pub coverage: f64,
    /// The largest difference of one channel of one pixel, 0..1.
    pub max: f32,
}

impl ErrorSum {
    /// `E^2`: the mean squared difference. 0 when nothing is covered.
    pub fn square(&self) -> f64 {
        if self.coverage > 0.0 {
            self.squares / self.coverage
        } else {
            0.0
        }
    }

    /// Adds the sums of another part of the samples.
    pub(crate) fn merge(&mut self, other: &Self) {
        self.squares += other.squares;
        self.coverage += other.coverage;
        self.max = self.max.max(other.max);
    }
}

/// The error of a level at its distance, in units of displayed colour, 0..1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorFigures {
    /// E(v): root mean square difference of the level from the reference.
    pub rmse: f64,
    /// E(o): that of the original, which aliases.
    pub floor: f64,
    /// The bound `e_a(d)` on the excess.
    pub bound: f64,
    /// The largest difference of a channel of a pixel.
    pub max: f64,
}

impl ErrorFigures {
    /// From the squares of the level's and the original's error.
    pub(crate) fn new(level: &ErrorSum, original: &ErrorSum, bound: f64) -> Self {
        Self {
            rmse: level.square().sqrt(),
            floor: original.square().sqrt(),
            bound,
            max: f64::from(level.max),
        }
    }

    /// What the level adds to the original's own error: sqrt(max(0, rmse^2 - floor^2)).
    pub fn excess(&self) -> f64 {
        (self.rmse * self.rmse - self.floor * self.floor)
            .max(0.0)
            .sqrt()
    }

    /// Peak signal-to-noise ratio of the level, in decibels; infinite when it equals the reference.
    pub fn psnr(&self) -> f64 {
        -20.0 * self.rmse.log10()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fully_covered_pixel_does_not_see_the_background() {
        let pixel = ReferencePixel::new([0.25; 3], 1.0);
        let same = [srgb_encode(0.25); 3];
        assert_eq!(pixel.difference(Some(same)), (0.0, 0.0));
        let (square, largest) = pixel.difference(Some([same[0] + 0.1, same[1], same[2]]));
        assert!((square - 0.01 / 3.0).abs() < 1e-6, "{square}");
        assert!((largest - 0.1).abs() < 1e-6, "{largest}");
    }

    #[test]
    fn a_missing_pixel_differs_by_its_coverage() {
        let pixel = ReferencePixel::new([0.5; 3], 0.5);
        let (square, _) = pixel.difference(None);
        assert!(square > 0.1, "{square}");
        assert_eq!(ReferencePixel::new([0.0; 3], 0.0).difference(None).0, 0.0);
    }

    #[test]
    fn a_nan_counts_as_the_largest_difference() {
        let pixel = ReferencePixel::new([0.5; 3], 1.0);
        assert_eq!(pixel.difference(Some([f32::NAN; 3])), (1.0, 1.0));
    }
}
