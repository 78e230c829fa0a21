//! How long a device takes for what it is given.
//!
//! A GPU is asked for its own timestamps. A software adapter is this process's threads, and what they take by any clock
//! that goes on while they wait is mostly what other processes let them: so there it is the time that they ran on
//! processors, where the system tells that. Where nothing better is left it is the wall clock.

use crate::gpu::adapter::Gpu;
use crate::gpu::read::words_of;
use crate::{Diagnostic, Result};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::time::{Duration, Instant};
use wgpu::{BufferUsages, CommandBuffer, CommandEncoder, RenderPassTimestampWrites};

/// How many timestamps are looked at for the timer's smallest step.
const LOOKED_AT: u32 = 64;

/// What times are taken with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Clock {
    /// Timestamps that the device writes.
    Device {
        /// Nanoseconds of its unit.
        unit: f64,
        /// The smallest difference that it was seen to make, but for none, nanoseconds.
        step: f64,
    },
    /// What all threads of this process together ran on processors, from submission to completion.
    Processor,
    /// The wall clock, from submission to completion.
    Wall,
}

/// For how long the threads of a software adapter go on after they are done, at most: they fall asleep then, and only
/// then does the system count what they ran.
const ASLEEP: Duration = Duration::from_micros(200);

/// Where the timestamps of what is being recorded go.
pub(super) struct Stamps<'a> {
    set: &'a wgpu::QuerySet,
    /// The places of the first and the last.
    at: [u32; 2],
}

impl<'a> Stamps<'a> {
    /// What the first and the last pass of a batch write; one pass may be both.
    pub(super) fn of_pass(
        this: &Option<Self>,
        first: bool,
        last: bool,
    ) -> Option<RenderPassTimestampWrites<'a>> {
        let stamps = this.as_ref().filter(|_| first || last)?;
        Some(RenderPassTimestampWrites {
            query_set: stamps.set,
            beginning_of_pass_write_index: first.then_some(stamps.at[0]),
            end_of_pass_write_index: last.then_some(stamps.at[1]),
        })
    }
}

impl Clock {
    /// The best clock for an adapter. `pass` records a small pass.
    ///
    /// # Errors
    /// When the device was lost.
    pub(super) fn new(
        gpu: &Gpu,
        pass: impl Fn(&mut CommandEncoder, Option<Stamps<'_>>),
    ) -> Result<Self> {
        if gpu.label().software && ran().is_some() {
            return Ok(Self::Processor);
        }
        let device = Self::of_device(gpu, pass)?;
        Ok(device.unwrap_or(Self::Wall))
    }

    /// The device's own timer, where it has one that goes.
    fn of_device(
        gpu: &Gpu,
        pass: impl Fn(&mut CommandEncoder, Option<Stamps<'_>>),
    ) -> Result<Option<Self>> {
        let has = gpu
            .device()
            .features()
            .contains(wgpu::Features::TIMESTAMP_QUERY);
        // OpenGL may tell the time at which a command was given, and not that at which it was done, as Mesa's does in
        // software.
        if !has || gpu.is_opengl() {
            return Ok(None);
        }
        let unit = f64::from(gpu.queue().get_timestamp_period());
        let stamps = stamps(gpu, LOOKED_AT, |set| {
            let passes = (0..LOOKED_AT / 2).map(|number| {
                let mut encoder = gpu.device().create_command_encoder(&Default::default());
                let at = [2 * number, 2 * number + 1];
                pass(&mut encoder, Some(Stamps { set, at }));
                encoder.finish()
            });
            Ok(passes.collect())
        })?;
        let differences = stamps
            .windows(2)
            .map(|pair| pair[1].saturating_sub(pair[0]));
        let step = differences.filter(|ticks| *ticks > 0).min();
        // A timer that stands still is none.
        Ok(step.map(|step| Self::Device {
            unit,
            step: step as f64 * unit,
        }))
    }

    /// The smallest step, nanoseconds.
    pub(super) fn step(self) -> f64 {
        match self {
            Self::Device { step, .. } => step,
            // What is missing of a thread that is still awake.
            Self::Processor => 2e4,
            // What the system wakes a waiting thread by.
            Self::Wall => 1e5,
        }
    }

    /// How long a batch takes at least, nanoseconds.
    pub(super) fn least(self) -> f64 {
        match self {
            // Waking threads and putting them to sleep takes some time more or less.
            Self::Processor => 2e7,
            Self::Device { .. } | Self::Wall => 4e6,
        }
    }

    /// How long each of so many parts takes that are submitted one after the other, nanoseconds. `record` records one.
    ///
    /// # Errors
    /// When the device was lost, or its timer ran backwards.
    pub(super) fn times(
        self,
        gpu: &Gpu,
        parts: usize,
        record: impl Fn(usize, &mut CommandEncoder, Option<Stamps<'_>>),
    ) -> Result<Vec<f64>> {
        let recorded = |part: usize, stamps: Option<Stamps<'_>>| {
            let mut encoder = gpu.device().create_command_encoder(&Default::default());
            record(part, &mut encoder, stamps);
            encoder.finish()
        };
        match self {
            Self::Processor | Self::Wall => {
                // Recorded before, so that nothing is recorded while something is timed.
                let all: Vec<CommandBuffer> = (0..parts).map(|part| recorded(part, None)).collect();
                let mut times = Vec::new();
                for commands in all {
                    let before = match self {
                        Self::Processor => ran(),
                        _ => None,
                    };
                    let start = Instant::now();
                    gpu.queue().submit([commands]);
                    let waited = gpu.device().poll(wgpu::PollType::wait_indefinitely());
                    waited.map_err(|error| unfinished(&error))?;
                    let wall = start.elapsed().as_nanos() as f64;
                    times.push(match before {
                        None => wall,
                        Some(before) => {
                            std::thread::sleep(ASLEEP);
                            ran().map_or(wall, |after| since(&before, &after) as f64)
                        }
                    });
                }
                Ok(times)
            }
            Self::Device { unit, .. } => {
                let all = stamps(gpu, 2 * parts as u32, |set| {
                    let parts = (0..parts).map(|part| {
                        let at = 2 * part as u32;
                        let at = [at, at + 1];
                        recorded(part, Some(Stamps { set, at }))
                    });
                    Ok(parts.collect())
                })?;
                let pairs = all.as_chunks::<2>().0.iter();
                let times = pairs.map(|[start, end]| {
                    let ticks = end.checked_sub(*start).ok_or_else(|| {
                        Diagnostic::error(format!("the timer of `{}` ran backwards", gpu.label()))
                            .with_note("its driver has a bug; another adapter may do: `--adapter`")
                    })?;
                    Ok(ticks as f64 * unit)
                });
                times.collect()
            }
        }
    }
}

/// How long each thread of this process has run on processors so far, nanoseconds; `None` where the system does not tell.
fn ran() -> Option<BTreeMap<OsString, u64>> {
    let threads = std::fs::read_dir("/proc/self/task").ok()?;
    let mut all = BTreeMap::new();
    for thread in threads {
        let thread = thread.ok()?;
        // One that ended meanwhile has none.
        if let Ok(text) = std::fs::read_to_string(thread.path().join("schedstat")) {
            let first = text.split_whitespace().next()?;
            all.insert(thread.file_name(), first.parse().ok()?);
        }
    }
    // Systems that do not count say 0.
    all.values().any(|time| *time > 0).then_some(all)
}

/// What threads ran since before: all of it where they are new.
fn since(before: &BTreeMap<OsString, u64>, after: &BTreeMap<OsString, u64>) -> u64 {
    let own = |(thread, time): (&OsString, &u64)| {
        time.saturating_sub(before.get(thread).copied().unwrap_or(0))
    };
    after.iter().map(own).sum()
}

fn unfinished(error: &dyn std::fmt::Display) -> Box<Diagnostic> {
    Diagnostic::error("what was timed did not end").with_reason(error)
}

/// So many timestamps that some commands write, which are submitted one by one, the device busy from the first to the last.
fn stamps(
    gpu: &Gpu,
    count: u32,
    record: impl FnOnce(&wgpu::QuerySet) -> Result<Vec<CommandBuffer>>,
) -> Result<Vec<u64>> {
    let device = gpu.device();
    let set = device.create_query_set(&wgpu::QuerySetDescriptor {
        label: None,
        ty: wgpu::QueryType::Timestamp,
        count,
    });
    let commands = record(&set)?;
    let resolved = resolved(gpu, &set, count, u64::from(count));
    for commands in commands {
        gpu.queue().submit([commands]);
    }
    resolved()
}

/// The numbers of so many queries, `count` of them in all, that were recorded: to be asked for when what writes them
/// was submitted.
pub(super) fn resolved<'a>(
    gpu: &'a Gpu,
    set: &wgpu::QuerySet,
    queries: u32,
    count: u64,
) -> impl FnOnce() -> Result<Vec<u64>> + use<'a> {
    let device = gpu.device();
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: 8 * count,
        usage: BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    encoder.resolve_query_set(set, 0..queries, &buffer, 0);
    let resolve = encoder.finish();
    move || {
        gpu.queue().submit([resolve]);
        let words = words_of(gpu, &buffer)?;
        let pairs = words.as_chunks::<2>().0.iter();
        Ok(pairs
            .map(|[low, high]| u64::from(*high) << 32 | u64::from(*low))
            .collect())
    }
}

#[cfg(test)]
mod tests {
    use super::super::canvas::{Canvas, Views};
    use super::super::tiles::{Part, Tiles};
    use super::*;
    use wgpu::TextureFormat;

    /// Passes that clear 512 x 512 pixels.
    fn canvas(gpu: &Gpu) -> (Canvas, Views) {
        let part = Part {
            at: [0; 2],
            size: [512; 2],
        };
        let formats = [Some(TextureFormat::Rgba8Unorm)];
        let canvas = Canvas::new(gpu, &formats, Tiles::new(&[part], 1, 512));
        let views = Views {
            frame: [512; 2],
            parts: vec![part],
        };
        (canvas, views)
    }

    #[test]
    fn every_clock_sees_that_forty_passes_take_longer_than_one() {
        for label in crate::gpu::list() {
            let gpu = Gpu::open(Some(&label.to_string())).unwrap();
            // It may leave out a pass whose picture is cleared again.
            if gpu.is_opengl() {
                continue;
            }
            let (canvas, views) = canvas(&gpu);
            let of_device = Clock::of_device(&gpu, |encoder, stamps| {
                canvas.record(&views, None, 0..1, stamps, encoder);
            });
            let mut clocks = vec![Clock::Wall];
            clocks.extend(of_device.unwrap());
            clocks.extend((label.software && ran().is_some()).then_some(Clock::Processor));
            for clock in clocks {
                assert!(clock.step() > 0.0);
                let count = |part: usize| [1, 40][part % 2];
                let times = clock.times(&gpu, 20, |part, encoder, stamps| {
                    canvas.record(&views, None, 0..count(part), stamps, encoder);
                });
                let times = times.unwrap();
                // The least, since other processes make some of them longer.
                let of = |wanted| {
                    let own = (0..20).filter(|part| count(*part) == wanted);
                    own.map(|part| times[part]).fold(f64::INFINITY, f64::min)
                };
                assert!(of(40) > 2.0 * of(1), "{label}, {clock:?}: {times:?}");
            }
        }
    }

    #[test]
    fn threads_that_came_meanwhile_count() {
        let threads = |all: &[(&str, u64)]| {
            let all = all.iter().map(|(name, time)| (OsString::from(name), *time));
            all.collect::<BTreeMap<_, _>>()
        };
        let before = threads(&[("1", 100), ("2", 50)]);
        let after = threads(&[("1", 130), ("3", 7)]);
        assert_eq!(since(&before, &after), 37);
    }
}
