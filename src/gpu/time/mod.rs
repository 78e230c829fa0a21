//! How long a shader's draw takes on the device, beside the original's.
//!
//! ```text
//! Stages --compiled--> Timed              the shader as an engine has it, compiled once
//! frames --tiles--> instances             at their size on screen, on pixels of their own, enough for the clock
//! rounds: original, variants, original --clock--> times --crate::time::statistics--> Timing
//! ```
//!
//! What is drawn is what an engine would draw: the shader's own entry points, its own targets and depth, draws blended by
//! the device, one after the other. Of a deferred scene it is the material's pass. Nothing is read back. What clearing
//! the targets takes is measured and taken off, since a host clears once for all that it draws.

mod canvas;
mod clock;
mod tiles;

use super::adapter::Gpu;
use super::entry::{Colour, Targets};
use super::pass::{Drawing, Pass, Ready, Views as Images};
use super::render::{Renderer, Stages};
use crate::eval::draw::{DrawState, state_of};
use crate::eval::machine::Bindings;
use crate::eval::parameters::ParameterStage;
use crate::eval::raster::Frame;
use crate::scene::mesh::Mesh;
use crate::scene::{Output, Scene};
use crate::time::statistics::{Estimate, Round, drifts, floor, median, ratio, throttles};
use crate::time::{Effort, PipelineStatistics, Timing, TimingWarning};
use crate::{Diagnostic, Result};
use canvas::{Canvas, Prepared, Views};
use clock::{Clock, resolved};
use naga::ScalarKind;
use std::borrow::Cow;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tiles::{Part, Tiles};
use wgpu::{Features, PipelineStatisticsTypes, TextureFormat};

/// How many of the timer's smallest steps a batch takes at least.
const STEPS: f64 = 50.0;
/// How long a submission takes at most, nanoseconds, unless one instance takes longer. Systems give up a device that does not
/// answer for some two seconds.
const MOST: f64 = 2e8;
/// The most instances of a batch: beyond them it is the time of recording that grows.
const MOST_INSTANCES: u32 = 1 << 13;
/// The most submissions of a batch.
const MOST_SUBMISSIONS: u32 = 64;
/// The longest edge of the picture that instances are drawn to, pixels.
const EDGE: u32 = 2048;
/// How many variants share a round: the more, the farther the original is from each.
const TOGETHER: usize = 6;
/// The fewest rounds that an interval is of.
const FEWEST: u32 = 4;
/// How often the cleared picture is timed.
const CLEARED: usize = 9;

/// A shader compiled as an engine has it.
#[derive(Debug)]
pub struct Timed {
    pass: Pass,
    formats: Vec<Option<TextureFormat>>,
    compiled: Duration,
    /// What it reads beside what the scene has, the same in every frame.
    more: Bindings,
    /// What fills its block of parameters.
    filled: Vec<Arc<ParameterStage>>,
    /// The mesh that it is drawn on, where that is not the scene's own.
    mesh: Option<Arc<Mesh>>,
}

impl Timed {
    /// The same on another mesh.
    #[must_use]
    pub(super) fn on(self, mesh: Option<Arc<Mesh>>) -> Self {
        Self { mesh, ..self }
    }

    /// The same with textures that the scene does not have, and with what fills blocks of parameters.
    #[must_use]
    pub(super) fn with(self, more: Bindings, filled: Vec<Arc<ParameterStage>>) -> Self {
        Self {
            more,
            filled,
            ..self
        }
    }
}

/// Where shaders are timed.
#[derive(Clone, Copy, Debug)]
pub struct Place<'a> {
    /// The scene that they were compiled for.
    pub scene: &'a Scene,
    /// The original's stages, by which it is known which pixels are covered.
    pub stages: Stages<'a>,
    /// From the eye to the centre of the object's bounding sphere, world units.
    pub distance: f64,
}

/// A shader that was drawn once.
struct Drawn<'a> {
    formats: &'a [Option<TextureFormat>],
    prepared: Prepared<'a>,
    compile_ms: f64,
    statistics: Option<PipelineStatistics>,
}

/// What is done in every round.
struct Batches<'a> {
    clock: Clock,
    canvas: Canvas,
    views: &'a Views,
    /// Of a batch.
    instances: u32,
    submissions: u32,
    /// The shortest batch that was seen, nanoseconds.
    shortest: f64,
}

impl Renderer<'_> {
    /// Compiles a shader for being timed in a scene.
    ///
    /// # Errors
    /// When the device cannot draw it.
    pub fn timed(&self, stages: Stages<'_>, scene: &Scene) -> Result<Timed> {
        let start = Instant::now();
        self.gpu.guarded("compiling the shader", || {
            let drawing = match &scene.lighting {
                Some(lighting) => self.material(lighting)?,
                None => Drawing {
                    targets: Targets {
                        colours: vec![Colour {
                            location: 0,
                            kind: Some(ScalarKind::Float),
                        }],
                        ..Targets::default()
                    },
                    formats: vec![match scene.output {
                        Output::Display => TextureFormat::Rgba8UnormSrgb,
                        Output::Encoded => TextureFormat::Rgba8Unorm,
                        Output::Linear { .. } => TextureFormat::Rgba16Float,
                    }],
                    ..Drawing::forward()
                },
            };
            let drawing = Drawing {
                bare: Some(states(scene)),
                ..drawing
            };
            let formats = drawing.formats_by_location();
            let pass = Pass::new(self.gpu, stages, drawing)?;
            Ok(Timed {
                pass,
                formats,
                compiled: start.elapsed(),
                more: Bindings::new(),
                filled: Vec::new(),
                mesh: None,
            })
        })
    }

    /// Times variants against the original, over all the scene's views at a distance. What one of them fails at does not
    /// keep the others from being timed.
    ///
    /// # Errors
    /// When the original cannot be drawn, or the device is lost.
    pub fn time(
        &mut self,
        place: &Place<'_>,
        original: &Timed,
        variants: &[&Timed],
        effort: &Effort,
    ) -> Result<Vec<Result<Timing>>> {
        let frames = place.scene.frames(place.distance);
        let programs = Part::programs(place.stages);
        let Some(first) = frames.first() else {
            return Err(Diagnostic::error("the scene has no picture to be timed"));
        };
        let views = Views {
            frame: [first.width, first.height],
            parts: frames
                .iter()
                .map(|frame| Part::of(programs.as_ref(), frame))
                .collect(),
        };
        let original = self.first(original, &views, &frames)?;
        let variants: Vec<Result<Drawn<'_>>> = variants
            .iter()
            .map(|variant| self.first(variant, &views, &frames))
            .collect();
        let good: Vec<&Drawn<'_>> = variants.iter().flatten().collect();
        let mut timings = Vec::new();
        for together in good.chunks(TOGETHER) {
            let timed = self.gpu.guarded("timing", || {
                self.together(&views, (&original, together), effort)
            });
            timings.extend(timed?);
        }
        let mut timings = timings.into_iter();
        variants
            .into_iter()
            .map(|variant| match variant {
                // One for each that is good.
                Ok(_) => Ok(timings
                    .next()
                    .ok_or_else(|| Diagnostic::error("a variant was not timed"))),
                Err(_) if self.gpu.is_lost() => Err(Diagnostic::error("the device was lost")),
                Err(error) => Ok(Err(error)),
            })
            .collect()
    }

    /// Binds what a shader reads and draws it once in every view.
    fn first<'a>(
        &mut self,
        timed: &'a Timed,
        views: &Views,
        frames: &[Frame],
    ) -> Result<Drawn<'a>> {
        let Self { gpu, uploads } = self;
        let start = Instant::now();
        let prepared = gpu.guarded("drawing", || {
            let ready = frames.iter().map(|frame| {
                let uploads = (*gpu, &mut *uploads);
                let mut frame = Cow::Borrowed(frame);
                if !timed.more.is_empty() {
                    frame.to_mut().bindings.extend(timed.more.clone());
                }
                if let Some(mesh) = &timed.mesh {
                    frame.to_mut().mesh = Arc::clone(mesh);
                }
                let draws = frame.mesh.draws().len();
                for stage in &timed.filled {
                    stage.bind(&mut frame.to_mut().bindings, draws);
                }
                timed.pass.ready(uploads, (&frame, None), &Images::new())
            });
            let views: Vec<Ready> = ready.collect::<Result<_>>()?;
            Ok(Prepared {
                pass: &timed.pass,
                views,
            })
        })?;
        let tiles = Tiles::new(&views.parts, 1, EDGE);
        let canvas = Canvas::new(gpu, &timed.formats, tiles);
        gpu.guarded("drawing", || {
            Clock::Wall.times(gpu, 1, |_, encoder, stamps| {
                canvas.record(views, Some(&prepared), 0..1, stamps, encoder);
            })
        })?;
        let compile_ms = (timed.compiled + start.elapsed()).as_secs_f64() * 1e3;
        let counts = gpu.device().features();
        let statistics = counts
            .contains(Features::PIPELINE_STATISTICS_QUERY)
            .then(|| {
                gpu.guarded("counting", || {
                    statistics(gpu, &timed.formats, views, &prepared)
                })
            });
        Ok(Drawn {
            formats: &timed.formats,
            prepared,
            compile_ms,
            statistics: statistics.transpose()?,
        })
    }

    /// Times a few variants in the same rounds.
    fn together(
        &self,
        views: &Views,
        (original, variants): (&Drawn<'_>, &[&Drawn<'_>]),
        effort: &Effort,
    ) -> Result<Vec<Timing>> {
        let gpu = self.gpu;
        let shaders: Vec<&Prepared<'_>> = [original]
            .iter()
            .chain(variants)
            .map(|drawn| &drawn.prepared)
            .collect();
        let batches = Batches::new(gpu, original.formats, views, &shaders)?;
        let cleared = median(&batches.times(gpu, &[None; CLEARED])?);
        let start = Instant::now();
        let budget = effort.budget * variants.len() as u32;
        // To warm up.
        batches.round(gpu, &shaders, 0, cleared)?;
        let mut rounds: Vec<Round> = Vec::new();
        let mut judged = 0;
        let estimates = loop {
            rounds.push(batches.round(gpu, &shaders, rounds.len(), cleared)?);
            let count = rounds.len() as u32;
            let spent = start.elapsed();
            let enough = count >= effort.rounds_at_least;
            let over = spent >= 2 * budget || (enough && spent >= budget);
            let last = count >= FEWEST && (over || count >= effort.rounds_at_most);
            // An estimate takes its time too: it is made again when there is a quarter more to make it of.
            if !last && (!enough || count < FEWEST || 4 * count < 5 * judged) {
                continue;
            }
            judged = count;
            let ratios = (0..variants.len()).map(|variant| ratio(&rounds, variant));
            let estimates: Vec<Estimate> = ratios.collect();
            let narrow = |estimate: &Estimate| estimate.half_width() <= effort.half_width;
            if last || estimates.iter().all(narrow) {
                break estimates;
            }
        };
        let floor = floor(&rounds);
        let count = rounds.len() as u32;
        let own: Vec<f64> = rounds.iter().flat_map(|round| round.originals).collect();
        let ms = |times: &[f64]| median(times) * 1e-6 / f64::from(batches.instances);
        let coarse =
            batches.clock == Clock::Wall || batches.shortest < STEPS * batches.clock.step();
        let timings = (0..).zip(variants).zip(estimates);
        let timings = timings.map(|((number, variant), estimate): ((usize, _), _)| {
            let few = count < effort.rounds_at_least || estimate.half_width() > effort.half_width;
            let warnings = [
                (drifts(&rounds, floor), TimingWarning::ClockDrift),
                (few, TimingWarning::FewSamples),
                (gpu.label().software, TimingWarning::SoftwareAdapter),
                (coarse, TimingWarning::TimerTooCoarse),
                (throttles(&rounds), TimingWarning::Throttled),
            ];
            let warned = warnings.into_iter().filter(|(warned, _)| *warned);
            let times: Vec<f64> = rounds.iter().map(|round| round.variants[number]).collect();
            Timing {
                ms: ms(&times),
                original_ms: ms(&own),
                ratio: estimate.median,
                low: estimate.low,
                high: estimate.high,
                floor,
                rounds: count,
                draws: batches.instances,
                compile_ms: variant.compile_ms,
                warnings: warned.map(|(_, warning)| warning).collect(),
                statistics: variant.statistics,
            }
        });
        Ok(timings.collect())
    }
}

impl<'a> Batches<'a> {
    /// Batches that take long enough for the clock, and no longer than they need to.
    fn new(
        gpu: &Gpu,
        formats: &[Option<TextureFormat>],
        views: &'a Views,
        shaders: &[&Prepared<'_>],
    ) -> Result<Self> {
        let canvas = |instances| {
            let tiles = Tiles::new(&views.parts, instances, EDGE);
            Canvas::new(gpu, formats, tiles)
        };
        let count = views.parts.len() as u32;
        let small = canvas(1);
        let clock = Clock::new(gpu, |encoder, stamps| {
            small.record(views, None, 0..1, stamps, encoder);
        })?;
        // Nothing is known yet of how long one takes.
        let mut batches = Self {
            clock,
            canvas: canvas(count),
            views,
            instances: count,
            submissions: count.min(MOST_SUBMISSIONS),
            shortest: 0.0,
        };
        let all: Vec<Option<&Prepared<'_>>> = shaders.iter().copied().map(Some).collect();
        loop {
            let times = batches.times(gpu, &all)?;
            let [shortest, longest] =
                [f64::min, f64::max].map(|of| times.iter().copied().fold(times[0], of));
            batches.shortest = shortest;
            let wanted = (clock.least() / times[0]).max(STEPS * clock.step() / shortest);
            let instances = f64::from(batches.instances);
            // Short times are not to be trusted.
            let factor = wanted.min(8.0).min((MOST / longest).max(1.0));
            let next = (instances * factor) as u32 / count * count + count;
            let next = next.min(MOST_INSTANCES / count * count).max(count);
            let one = longest / instances;
            batches.submissions =
                ((f64::from(next) * one / MOST).ceil() as u32).clamp(1, MOST_SUBMISSIONS.min(next));
            if factor <= 1.0 || next <= batches.instances {
                return Ok(batches);
            }
            batches.instances = next;
            batches.canvas = canvas(next.div_ceil(batches.submissions));
        }
    }

    /// How long batches of these shaders take that are drawn one after the other, nanoseconds. An instance of the first is
    /// drawn before them that does not count: after a rest, caches and clocks are not what they are later.
    fn times(&self, gpu: &Gpu, shaders: &[Option<&Prepared<'_>>]) -> Result<Vec<f64>> {
        let submissions = self.submissions as usize;
        let each = self.instances.div_ceil(self.submissions);
        let parts = 1 + shaders.len() * submissions;
        let times = self.clock.times(gpu, parts, |part, encoder, stamps| {
            let (shader, instances) = match part.checked_sub(1) {
                None => (shaders[0], 0..1),
                Some(part) => {
                    let start = (part % submissions) as u32 * each;
                    let end = (start + each).min(self.instances);
                    (shaders[part / submissions], start.min(end)..end)
                }
            };
            self.canvas
                .record(self.views, shader, instances, stamps, encoder);
        })?;
        let counted = times[1..].chunks_exact(submissions);
        Ok(counted.map(|batch| batch.iter().sum()).collect())
    }

    /// A round: the original, the variants, in an order that changes from round to round, and the original. `cleared` is
    /// what a batch takes without any draw.
    fn round(
        &self,
        gpu: &Gpu,
        shaders: &[&Prepared<'_>],
        number: usize,
        cleared: f64,
    ) -> Result<Round> {
        let variants = shaders.len() - 1;
        let mut order: Vec<usize> = (0..variants)
            .map(|at| (at + number / 2) % variants)
            .collect();
        if number % 2 == 1 {
            order.reverse();
        }
        let between = order.iter().map(|variant| Some(shaders[1 + variant]));
        let own = Some(shaders[0]);
        let all: Vec<_> = std::iter::once(own).chain(between).chain([own]).collect();
        let times = self.times(gpu, &all)?;
        // What clears takes is in all of them alike; of a draw that takes hardly more, a part is left.
        let net = |time: f64| (time - cleared).max(0.1 * time);
        let mut round = Round {
            originals: [net(times[0]), net(times[variants + 1])],
            variants: vec![0.0; variants],
        };
        for (variant, time) in order.into_iter().zip(&times[1..]) {
            round.variants[variant] = net(*time);
        }
        Ok(round)
    }
}

/// The states that draws of a scene have.
fn states(scene: &Scene) -> Vec<DrawState> {
    let mut states = Vec::new();
    for state in scene
        .states
        .iter()
        .copied()
        .chain([state_of(&scene.states, 0)])
    {
        if !states.contains(&state) {
            states.push(state);
        }
    }
    states
}

/// What the device counts for one instance, the mean of the views.
fn statistics(
    gpu: &Gpu,
    formats: &[Option<TextureFormat>],
    views: &Views,
    shader: &Prepared<'_>,
) -> Result<PipelineStatistics> {
    let count = views.parts.len() as u32;
    let types = PipelineStatisticsTypes::VERTEX_SHADER_INVOCATIONS
        | PipelineStatisticsTypes::CLIPPER_PRIMITIVES_OUT
        | PipelineStatisticsTypes::FRAGMENT_SHADER_INVOCATIONS;
    let set = gpu.device().create_query_set(&wgpu::QuerySetDescriptor {
        label: None,
        ty: wgpu::QueryType::PipelineStatistics(types),
        count,
    });
    let canvas = Canvas::new(gpu, formats, Tiles::new(&views.parts, 1, EDGE));
    let mut encoder = gpu.device().create_command_encoder(&Default::default());
    for view in 0..count {
        let mut pass = canvas.cleared(None, &mut encoder);
        pass.begin_pipeline_statistics_query(&set, view);
        canvas.draw(views, shader, view..view + 1, &mut pass);
        pass.end_pipeline_statistics_query();
    }
    let drawn = encoder.finish();
    let resolve = resolved(gpu, &set, count, 3 * u64::from(count));
    gpu.queue().submit([drawn]);
    let all = resolve()?;
    let mean = |at: usize| {
        let own = all.as_chunks::<3>().0.iter().map(|counts| counts[at]);
        own.sum::<u64>() as f64 / f64::from(count)
    };
    Ok(PipelineStatistics {
        vertex_invocations: mean(0),
        clipper_primitives: mean(1),
        fragment_invocations: mean(2),
    })
}
