//! From rounds of times to a ratio, its interval and the noise floor.
//!
//! A round draws the original first and last and the variants between them, so that what disturbs the machine for longer
//! than a round changes all of its times alike and cancels in their ratios. What disturbs it for less makes outliers,
//! which a median bears. Disturbances last, so neighbouring rounds are alike: the bootstrap draws blocks of rounds, not
//! single ones, or its intervals would be too narrow.
//!
//! This work is based on: H. R. Künsch, "The jackknife and the bootstrap for general stationary observations", 1989
//! (blocks).

use lodc_machine::chance::{child, unit};

/// How often the bootstrap draws.
const RESAMPLES: u64 = 1000;
/// What is left out at each end of an interval of 99 %.
const TAIL: f64 = 0.005;
/// By how much in all the original must get slower, ever more so, to be called throttled.
const THROTTLED: f64 = 1.1;

/// The times of batches drawn one after the other, all in the same unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Round {
    /// The original's, as the first and as the last of the round.
    pub originals: [f64; 2],
    /// The variants', in the order in which they were given, whatever the order in which they were drawn.
    pub variants: Vec<f64>,
}

impl Round {
    /// The original's time: the geometric mean, which is that in the middle where it drifts steadily.
    fn original(&self) -> f64 {
        let [first, last] = self.originals;
        (first * last).sqrt()
    }
}

/// A median and its interval of 99 %.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The median.
    pub median: f64,
    /// The lower end.
    pub low: f64,
    /// The upper end.
    pub high: f64,
}

impl Estimate {
    /// The median of all numbers of a series in the order of time, `N` of each round, by a block bootstrap. The same
    /// always for the same series. Of less than four rounds the interval means nothing.
    ///
    /// The bootstrap alone is too sure of few rounds: in noise as the tests make it, its interval of 99 % of 15 rounds held the
    /// truth in 94 of 100 cases. So it is widened as Student's distribution is wider than the normal one, with as many
    /// observations as there are blocks.
    pub fn of<const N: usize>(series: &[[f64; N]]) -> Self {
        let length = series.len();
        // As long as the third root of the series, which grows with it, and slower.
        let block = (length as f64).cbrt().ceil() as usize;
        let mut drawn: Vec<f64> = series.iter().flatten().copied().collect();
        let median = middle(&mut drawn);
        if !median.is_finite() {
            return Self {
                median,
                low: median,
                high: median,
            };
        }
        let mut medians: Vec<f64> = (0..RESAMPLES)
            .map(|resample| {
                drawn.clear();
                let seed = child(0, resample);
                for number in 0.. {
                    if drawn.len() >= N * length {
                        break;
                    }
                    // The series is a circle, so that its ends are drawn as often as its middle.
                    let start = (unit(child(seed, number)) * length as f64) as usize;
                    drawn.extend((start..start + block).flat_map(|at| series[at % length]));
                }
                drawn.truncate(N * length);
                middle(&mut drawn)
            })
            .collect();
        medians.sort_by(f64::total_cmp);
        let left_out = (TAIL * RESAMPLES as f64) as usize;
        let wider = wider(length as f64 / block as f64 - 1.0);
        let end = |drawn: f64| median * (drawn / median).powf(wider);
        Self {
            median,
            low: end(medians[left_out]),
            high: end(medians[medians.len() - 1 - left_out]),
        }
    }

    /// Half of the interval, as a part of the median.
    pub fn half_width(&self) -> f64 {
        (self.high - self.low) / (2.0 * self.median)
    }
}

/// How much wider 99 % of Student's distribution are than those of the normal one: the first terms of its expansion in one
/// over the degrees of freedom (Abramowitz and Stegun 1964, 26.7.5).
fn wider(freedom: f64) -> f64 {
    let few = 1.0 / freedom.max(1.0);
    1.0 + few * (1.909 + few * 3.43)
}

/// The median; NaN of nothing.
pub fn median(values: &[f64]) -> f64 {
    middle(&mut values.to_vec())
}

/// The median of what may be put in another order.
fn middle(values: &mut [f64]) -> f64 {
    let length = values.len();
    if length == 0 {
        return f64::NAN;
    }
    let (below, upper, _) = values.select_nth_unstable_by(length / 2, f64::total_cmp);
    let upper = *upper;
    if length % 2 == 1 {
        return upper;
    }
    let lower = below.iter().copied().max_by(f64::total_cmp);
    lower.map_or(upper, |lower| (lower + upper) / 2.0)
}

/// How many times as long as the original a variant takes, by its place in the rounds. Each round has two ratios, to the
/// original before and after: their median is the truth where what interrupts one batch alone makes it longer, and that
/// of the ratio to a mean of the two is not.
pub fn ratio(rounds: &[Round], variant: usize) -> Estimate {
    let ratios = rounds
        .iter()
        .map(|round| round.originals.map(|own| round.variants[variant] / own));
    Estimate::of(&ratios.collect::<Vec<_>>())
}

/// How far the original is from itself: the end of the interval of its last time over its first that is farther from 1.
pub fn floor(rounds: &[Round]) -> f64 {
    let ratios = rounds.iter().map(|round| {
        let [first, last] = round.originals;
        [last / first]
    });
    let own = Estimate::of(&ratios.collect::<Vec<_>>());
    own.high.max(1.0 / own.low) - 1.0
}

/// Whether the original's own time drifted from the first third of the rounds to the last by more than the floor.
pub fn drifts(rounds: &[Round], floor: f64) -> bool {
    let own: Vec<[f64; 1]> = rounds.iter().map(|round| [round.original()]).collect();
    let third = own.len() / 3;
    if third < 4 {
        return false;
    }
    let [first, last] = [&own[..third], &own[own.len() - third..]].map(Estimate::of::<1>);
    let widen = 1.0 + floor;
    last.low > first.high * widen || last.high * widen < first.low
}

/// Whether the original got slower from each fifth of the rounds to the next, by more than 10 % in all.
pub fn throttles(rounds: &[Round]) -> bool {
    let own: Vec<f64> = rounds.iter().map(Round::original).collect();
    let fifth = own.len() / 5;
    if fifth < 3 {
        return false;
    }
    let parts: Vec<f64> = own.chunks_exact(fifth).take(5).map(median).collect();
    parts.is_sorted_by(|a, b| a < b) && parts[4] > THROTTLED * parts[0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::{Timing, Verdict};

    /// Numbers of a normal distribution of deviation 1, by chance.
    fn normal(seed: u64) -> f64 {
        let [a, b] = [0, 1].map(|number| unit(child(seed, number)));
        (-2.0 * (1.0 - a).ln()).sqrt() * (std::f64::consts::TAU * b).cos()
    }

    /// Rounds of one variant that takes so many times as long as the original: noise of each time, a load that is there in
    /// one round and, mostly, in the next, and interruptions of single batches.
    fn rounds(seed: u64, count: usize, ratio: f64) -> Vec<Round> {
        let mut load = 0.0;
        let mut number = 0;
        let mut chance = || {
            number += 1;
            child(seed, number)
        };
        (0..count)
            .map(|_| {
                load = 0.8 * load + 0.2 * normal(chance());
                let mut time = |ratio: f64| {
                    let interrupted = match unit(chance()) < 0.1 {
                        true => 1.0 + unit(chance()),
                        false => 1.0,
                    };
                    ratio * interrupted * (load + 0.05 * normal(chance())).exp()
                };
                Round {
                    originals: [time(1.0), time(1.0)],
                    variants: vec![time(ratio)],
                }
            })
            .collect()
    }

    fn verdict(rounds: &[Round]) -> Verdict {
        let ratio = ratio(rounds, 0);
        Timing {
            low: ratio.low,
            high: ratio.high,
            ..Timing::made_up(ratio.median, 0.0, floor(rounds))
        }
        .verdict()
    }

    /// How often of 1,000 times rounds of such a variant are called this.
    fn said(wanted: Verdict, ratio: f64, count: usize) -> usize {
        let verdicts = (0..1000).map(|seed| verdict(&rounds(seed, count, ratio)));
        verdicts.filter(|verdict| *verdict == wanted).count()
    }

    #[test]
    fn the_same_is_no_difference_in_noise_that_lasts_and_interrupts() {
        for count in [7, 15, 40] {
            let said = said(Verdict::NoDifference, 1.0, count);
            assert!(said >= 995, "{count} rounds: {said}");
        }
    }

    #[test]
    fn a_fifth_more_or_less_is_told_apart_in_such_noise() {
        let said = [(Verdict::Slower, 1.2), (Verdict::Faster, 1.0 / 1.2)]
            .map(|(wanted, ratio)| said(wanted, ratio, 40));
        assert!(said.iter().all(|count| *count >= 970), "{said:?}");
    }

    #[test]
    fn an_interval_holds_the_truth_as_often_as_it_says() {
        for length in [5, 15, 40] {
            let holds = |seed: &u64| {
                let own = ratio(&rounds(*seed, length, 1.0), 0);
                own.low <= 1.0 && 1.0 <= own.high
            };
            let count = (0..1000).filter(holds).count();
            assert!(count >= 975, "{length} rounds: {count}");
        }
    }

    #[test]
    fn an_estimate_is_of_the_series_and_the_same_always() {
        let series: Vec<[f64; 1]> = (0..30).map(|i| [1.0 + 0.1 * normal(i)]).collect();
        let own = Estimate::of(&series);
        assert_eq!(own, Estimate::of(&series));
        assert!(own.low < own.median && own.median < own.high && own.half_width() < 0.15);
        assert_eq!(Estimate::of(&[[2.0]; 9]).half_width(), 0.0);
        assert!(Estimate::of::<1>(&[]).median.is_nan());
        assert_eq!(median(&[3.0, 1.0, 2.0, 10.0]), 2.5);
        assert_eq!(median(&[3.0, 1.0, 2.0]), 2.0);
    }

    /// Rounds whose original takes so long, with little noise.
    fn own(times: impl Iterator<Item = f64>) -> Vec<Round> {
        let noisy = (0..).zip(times).map(|(seed, time)| {
            let time = |number| time * (1.0 + 0.005 * normal(child(seed, number)));
            Round {
                originals: [time(0), time(1)],
                variants: vec![time(2)],
            }
        });
        noisy.collect()
    }

    #[test]
    fn a_clock_that_drifts_or_is_throttled_is_said_to() {
        let steady = own((0..50).map(|_| 3.0));
        let slower = own((0..50).map(|i| 3.0 + 0.02 * f64::from(i)));
        let faster = own((0..50).map(|i| 3.0 - 0.02 * f64::from(i)));
        // It went and came back.
        let hump = own((0..50).map(|i| 3.0 + 0.02 * f64::from((i - 25i32).abs())));
        let said = |rounds: &[Round]| (drifts(rounds, floor(rounds)), throttles(rounds));
        assert_eq!(said(&steady), (false, false));
        assert_eq!(said(&slower), (true, true));
        assert_eq!(said(&faster), (true, false));
        assert_eq!(said(&hump), (false, false));
        assert_eq!(said(&[]), (false, false));
        // And ratios bear all of it.
        for rounds in [slower, faster, hump] {
            assert_eq!(verdict(&rounds), Verdict::NoDifference);
        }
    }
}
