//! Leaves out levels that gain little over the one before.
//!
//! This work is based on: Liang 2022, section 6.2.

/// A level that saves less than this share of the original's time is left out: Liang's W.
pub const MERGE_BELOW: f64 = 0.04;

/// Which of so many levels are kept, in order: the first one, and each that saves at least `below` of the original's time, where it begins,
/// over the last one that is kept. `time` says what a level takes where another begins, as a share of the original's time there; nothing where
/// it must not be used so far, so that the other is kept.
///
/// The paper compares with the level before whether that is kept or not. Many small gains would then be left out together.
///
/// # Errors
/// What `time` fails with.
pub fn merge<E>(
    levels: usize,
    below: f64,
    mut time: impl FnMut(usize, usize) -> Result<Option<f64>, E>,
) -> Result<Vec<usize>, E> {
    let mut kept: Vec<usize> = Vec::new();
    for level in 0..levels {
        let gains = match kept.last() {
            None => true,
            Some(before) => match (time(*before, level)?, time(level, level)?) {
                (Some(without), Some(with)) => without - with >= below,
                (None, _) => true,
                (Some(_), None) => false,
            },
        };
        if gains {
            kept.push(level);
        }
    }
    Ok(kept)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    fn merged(times: &[f64]) -> Vec<usize> {
        let time = |level: usize, _| Ok::<_, Infallible>(Some(times[level]));
        let Ok(kept) = merge(times.len(), MERGE_BELOW, time);
        kept
    }

    #[test]
    fn what_gains_little_is_left_out_and_what_adds_up_is_not() {
        assert_eq!(merged(&[1.0, 0.99, 0.5, 0.48, 0.3]), [0, 2, 4]);
        // Each saves 3 % over the one before: every other is worth it.
        assert_eq!(merged(&[1.0, 0.97, 0.94, 0.91, 0.88]), [0, 2, 4]);
        assert_eq!(merged(&[1.0, 1.2]), [0]);
        assert_eq!(merged(&[]), []);
    }

    #[test]
    fn a_level_stays_where_the_one_before_must_not_be_used() {
        let time = |level: usize, at: usize| match (level, at) {
            (0, 1) => Ok::<_, Infallible>(None),
            _ => Ok(Some(0.5)),
        };
        assert_eq!(merge(3, MERGE_BELOW, time), Ok(vec![0, 1]));
    }
}
