//! How long a device takes for what it is given, by its own timer or, where it has none, by the wall clock.

use crate::gpu::adapter::Gpu;
use crate::gpu::read::words_of;
use crate::{Diagnostic, Result};
use std::time::Instant;
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
    /// The wall clock, from submission to completion.
    Wall,
}

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
    /// The device's clock. `pass` records a small pass.
    ///
    /// # Errors
    /// When the device was lost.
    pub(super) fn new(
        gpu: &Gpu,
        pass: impl Fn(&mut CommandEncoder, Option<Stamps<'_>>),
    ) -> Result<Self> {
        let has = gpu
            .device()
            .features()
            .contains(wgpu::Features::TIMESTAMP_QUERY);
        // OpenGL may tell the time at which a command was given, and not that at which it was done, as Mesa's does in
        // software.
        if !has || gpu.is_opengl() {
            return Ok(Self::Wall);
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
        Ok(step.map_or(Self::Wall, |step| Self::Device {
            unit,
            step: step as f64 * unit,
        }))
    }

    /// The smallest step, nanoseconds.
    pub(super) fn step(self) -> f64 {
        match self {
            Self::Device { step, .. } => step,
            // What the system wakes a waiting thread by.
            Self::Wall => 1e5,
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
            Self::Wall => {
                // Recorded before, so that nothing is recorded while something is timed.
                let all: Vec<CommandBuffer> = (0..parts).map(|part| recorded(part, None)).collect();
                let timed = all.into_iter().map(|commands| {
                    let start = Instant::now();
                    gpu.queue().submit([commands]);
                    let waited = gpu.device().poll(wgpu::PollType::wait_indefinitely());
                    waited.map_err(|error| unfinished(&error))?;
                    Ok(start.elapsed().as_secs_f64() * 1e9)
                });
                timed.collect()
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
