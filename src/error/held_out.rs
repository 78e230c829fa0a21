//! Errors on pictures that decided nothing, with what chance does to them.
//!
//! A held-out split is independent draws of a view, of the uniforms and of an offset. `E^2` over them is a ratio of
//! two means, squared differences over coverage; its standard error is that of the ratio estimator (Cochran,
//! "Sampling Techniques", 1977, section 2.11): the residuals `S_i - R C_i` of the pictures, as independent numbers.

use super::figures::Details;
use lodc_passes::autolod::BoundReading;

/// How many standard errors above its bound an excess is no chance any more: one time in forty it is.
const ERRORS: f64 = 2.0;

/// The error of a level on a held-out split, in units of displayed colour.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct HeldOut {
    /// Root mean square difference from the reference.
    pub rmse: f64,
    /// Its standard error; `None` when there are fewer than two pictures to tell it from.
    pub standard_error: Option<f64>,
    /// What the level adds to the original's own error on the same pictures.
    pub excess: f64,
}

impl HeldOut {
    /// From what was measured of the level and of the original.
    pub(crate) fn new(level: &Details, original: &Details) -> Self {
        let sums = level.frames.iter().map(|sum| (sum.squares, sum.coverage));
        let (square, standard_error) = ratio(sums);
        let rmse = square.sqrt();
        Self {
            rmse,
            // d sqrt(x) = dx / (2 sqrt(x))
            standard_error: standard_error.map(|error| match rmse > 0.0 {
                true => error / (2.0 * rmse),
                false => 0.0,
            }),
            excess: (square - original.error.square()).max(0.0).sqrt(),
        }
    }
}

/// Whether a level's excess is over the bound by more than chance explains.
pub(crate) fn exceeds(
    level: &Details,
    original: &Details,
    (bound, reading): (f64, BoundReading),
) -> bool {
    let pairs = level.frames.iter().zip(&original.frames);
    let added = pairs.map(|(level, original)| match reading {
        BoundReading::Excess => (level.squares - original.squares, level.coverage),
        BoundReading::Paper => (3.0 * level.squares, level.coverage),
    });
    let allowed = match reading {
        BoundReading::Excess => bound * bound,
        BoundReading::Paper => bound,
    };
    let (found, standard_error) = ratio(added);
    found - ERRORS * standard_error.unwrap_or(0.0) > allowed
}

/// The sum of the first over the sum of the second numbers, and its standard error.
fn ratio(pairs: impl Iterator<Item = (f64, f64)> + Clone) -> (f64, Option<f64>) {
    let (count, above, below) = pairs.clone().fold((0.0, 0.0, 0.0), |(n, a, b), pair| {
        (n + 1.0, a + pair.0, b + pair.1)
    });
    if below <= 0.0 {
        return (0.0, None);
    }
    let ratio = above / below;
    let residuals: f64 = pairs.map(|(a, b)| (a - ratio * b).powi(2)).sum();
    let error = || (residuals * count / (count - 1.0)).sqrt() / below;
    (ratio, (count > 1.0).then(error))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::ErrorSum;

    fn details(frames: &[(f64, f64)]) -> Details {
        let frames: Vec<_> = frames
            .iter()
            .map(|(squares, coverage)| ErrorSum {
                squares: *squares,
                coverage: *coverage,
                max: 0.0,
            })
            .collect();
        let mut error = ErrorSum::default();
        frames.iter().for_each(|frame| error.merge(frame));
        Details {
            error,
            frames,
            ..Details::default()
        }
    }

    #[test]
    fn the_standard_error_by_hand() {
        // Ratio 6 / 24 = 0.25; residuals -1, 0, 1; sqrt(2 * 3 / 2) / 24.
        let level = details(&[(1.0, 8.0), (2.0, 8.0), (3.0, 8.0)]);
        let original = details(&[(0.5, 8.0), (0.5, 8.0), (0.5, 8.0)]);
        let found = HeldOut::new(&level, &original);
        assert!((found.rmse - 0.5).abs() < 1e-12);
        let error = found.standard_error.unwrap();
        assert!((error - 3f64.sqrt() / 24.0).abs() < 1e-12, "{error}");
        assert!((found.excess - (0.25_f64 - 0.0625).sqrt()).abs() < 1e-12);
        assert_eq!(
            HeldOut::new(&details(&[(1.0, 4.0)]), &original).standard_error,
            None
        );
    }

    #[test]
    fn only_what_chance_does_not_explain_is_over_the_bound() {
        let original = details(&[(0.0, 8.0); 4]);
        let level = details(&[(0.5, 8.0), (1.5, 8.0), (0.5, 8.0), (1.5, 8.0)]);
        // 4 / 32 = 0.125; residuals of 0.5; sqrt(4 * 0.25 * 4 / 3) / 32 = 0.0361.
        assert!(exceeds(
            &level,
            &original,
            (0.05_f64.sqrt(), BoundReading::Excess)
        ));
        assert!(!exceeds(
            &level,
            &original,
            (0.06_f64.sqrt(), BoundReading::Excess)
        ));
        // The same everywhere is no chance.
        let steady = details(&[(1.0, 8.0); 4]);
        assert!(exceeds(
            &steady,
            &original,
            (0.12_f64.sqrt(), BoundReading::Excess)
        ));
        assert!(!exceeds(
            &steady,
            &original,
            (0.13_f64.sqrt(), BoundReading::Excess)
        ));
    }
}
