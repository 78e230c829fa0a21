//! Run times: what is measured of them, and what is predicted.
//!
//! ```text
//! rounds of (original, variants, original) --statistics--> Timing: ratio, its interval, the noise floor, warnings
//! Timing --verdict--> no difference, faster, slower
//! what a draw executes --model--> its time, predicted
//! Timings --store--> kept on disk, or recorded, to stand in for a device
//! [Shader] --clock--> [Timing]                       what a search asks
//! ```
//!
//! The GPU's part, which takes the times, is `gpu::time`. Nothing here knows a device.

pub mod clock;
pub(crate) mod handed_over;
pub mod model;
pub mod statistics;
pub mod store;

use serde::{Deserialize, Serialize};
use std::fmt;
use std::time::Duration;

/// How long a variant's draw takes at a distance, against that of the original in the same batches.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Timing {
    /// The median of one instance's draw, over all rounds and the mean of the scene's views, milliseconds: of the device's
    /// timer, or, on a software adapter, of all its threads together on processors.
    pub ms: f64,
    /// The same of the original.
    pub original_ms: f64,
    /// How many times as long as the original it takes: the median over the rounds, each of which compares batches
    /// that were drawn one after the other.
    pub ratio: f64,
    /// The lower end of the ratio's bootstrap interval of 99 %.
    pub low: f64,
    /// Its upper end.
    pub high: f64,
    /// How far the original was found from itself in the same rounds, as the distance of a ratio from 1: the interval's
    /// end of 99 % that is farther off.
    pub floor: f64,
    /// How many rounds there were.
    pub rounds: u32,
    /// How many instances a batch drew.
    pub draws: u32,
    /// From the shader's text to its first drawn instance, milliseconds of wall clock: drivers compile late.
    pub compile_ms: f64,
    /// What is to be known before it is believed, in the order of [`TimingWarning`]'s variants.
    pub warnings: Vec<TimingWarning>,
    /// What the adapter counted for one instance, the mean of the views; `None` where it cannot count.
    pub statistics: Option<PipelineStatistics>,
}

impl Timing {
    /// What can be said: a difference, where the interval, widened by the noise floor at both ends, leaves out 1.
    pub fn verdict(&self) -> Verdict {
        let widen = 1.0 + self.floor;
        if self.high * widen < 1.0 {
            Verdict::Faster
        } else if self.low > widen {
            Verdict::Slower
        } else {
            // A number that is none is no difference either.
            Verdict::NoDifference
        }
    }
}

/// What a timing says of a variant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Verdict {
    /// None that can be told from noise.
    #[serde(rename = "no difference")]
    NoDifference,
    /// It takes less time than the original.
    #[serde(rename = "faster")]
    Faster,
    /// It takes more.
    #[serde(rename = "slower")]
    Slower,
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NoDifference => "no difference",
            Self::Faster => "faster",
            Self::Slower => "slower",
        })
    }
}

/// Why a timing is to be taken with care.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum TimingWarning {
    /// The original's own time in the last third of the rounds was not that in the first third, by more than the noise
    /// floor. Ratios hardly suffer, since they are of neighbours; milliseconds do.
    #[serde(rename = "clock drift")]
    ClockDrift,
    /// The budget was used up before the ratio's interval was as narrow as was asked for, or before the least rounds.
    #[serde(rename = "few samples")]
    FewSamples,
    /// The adapter is a program on the CPU: its times say nothing about a GPU.
    #[serde(rename = "software adapter")]
    SoftwareAdapter,
    /// A batch took less than 50 of the timer's smallest steps; or there was no timer but the wall clock, which was read
    /// around submission and completion.
    #[serde(rename = "timer too coarse")]
    TimerTooCoarse,
    /// The original got slower from each fifth of the rounds to the next, by more than 10 % in all: the device was
    /// probably slowed down because of heat or power.
    #[serde(rename = "throttled")]
    Throttled,
}

impl fmt::Display for TimingWarning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::ClockDrift => "clock drift",
            Self::FewSamples => "few samples",
            Self::SoftwareAdapter => "software adapter",
            Self::TimerTooCoarse => "timer too coarse",
            Self::Throttled => "throttled",
        })
    }
}

/// What an adapter counted while it drew one instance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PipelineStatistics {
    /// How often the vertex stage ran.
    pub vertex_invocations: f64,
    /// Triangles that came out of the clipper.
    pub clipper_primitives: f64,
    /// How often the fragment stage ran. Adapters differ in whether helpers count.
    pub fragment_invocations: f64,
}

/// How much time a timing may take, and how exact it is to be.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Effort {
    /// Rounds that are drawn, unless twice the budget is used up before. Of less than four there is no interval, so that
    /// there are never less.
    pub rounds_at_least: u32,
    /// Rounds that are not exceeded, beyond those four.
    pub rounds_at_most: u32,
    /// It ends when half of the ratio's interval, as a part of the ratio, is no more than this.
    pub half_width: f64,
    /// Wall-clock time for each variant, without compilation.
    pub budget: Duration,
}

impl Default for Effort {
    /// Up to 2 seconds a variant, for 1 %.
    fn default() -> Self {
        Self {
            rounds_at_least: 15,
            rounds_at_most: 500,
            half_width: 0.01,
            budget: Duration::from_secs(2),
        }
    }
}

#[cfg(test)]
impl Timing {
    /// A timing that tests make up: a ratio, the distance of its interval's ends, and the noise floor.
    pub(crate) fn made_up(ratio: f64, off: f64, floor: f64) -> Self {
        Self {
            ms: ratio,
            original_ms: 1.0,
            ratio,
            low: ratio - off,
            high: ratio + off,
            floor,
            rounds: 20,
            draws: 4,
            compile_ms: 1.0,
            warnings: Vec::new(),
            statistics: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn timing(low: f64, high: f64, floor: f64) -> Timing {
        Timing {
            low,
            high,
            warnings: vec![TimingWarning::ClockDrift, TimingWarning::SoftwareAdapter],
            ..Timing::made_up(1.0, 0.0, floor)
        }
    }

    #[test]
    fn a_difference_is_one_outside_of_the_interval_and_the_floor() {
        for (low, high, floor, verdict) in [
            (0.97, 1.02, 0.0, Verdict::NoDifference),
            (0.90, 0.95, 0.02, Verdict::Faster),
            (0.90, 0.95, 0.06, Verdict::NoDifference),
            (1.05, 1.10, 0.02, Verdict::Slower),
            (1.05, 1.10, 0.06, Verdict::NoDifference),
            (f64::NAN, f64::NAN, 0.0, Verdict::NoDifference),
        ] {
            assert_eq!(timing(low, high, floor).verdict(), verdict, "{low} {high}");
        }
    }

    #[test]
    fn a_timing_reads_as_it_was_written() {
        let timing = timing(0.9, 1.1, 0.01);
        let json = serde_json::to_string(&timing).unwrap();
        assert!(
            json.contains(r#"["clock drift","software adapter"]"#),
            "{json}"
        );
        assert_eq!(serde_json::from_str::<Timing>(&json).unwrap(), timing);
        let said: Vec<String> = timing.warnings.iter().map(ToString::to_string).collect();
        assert_eq!(said, ["clock drift", "software adapter"]);
    }
}
