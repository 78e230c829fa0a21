//! The child: reads requests, draws, answers, until there are no more.

use super::{
    Answer, Request, Said, Subject, Task, Variant, Wanted, read_message, write_message,
    write_numbers,
};
use crate::eval::generated;
use crate::eval::machine::{Bindings, Resource};
use crate::front::Source;
use crate::gpu::time::{Place, Timed};
use crate::gpu::{Gpu, Pipeline, Renderer, Stages};
use crate::scene::{Scene, filled};
use crate::stability::Asked;
use crate::time::{Effort, handed_over};
use crate::{Diagnostic, Result};
use std::io::{Read, Write};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;

/// How many pipelines are kept: those of a shader's levels, in turns.
const KEPT: usize = 16;
/// The same of those that are timed: the variants of a search come again at other distances.
const KEPT_TIMED: usize = 128;

/// Answers requests until `from` ends: what `lodc gpu-worker` does.
///
/// # Errors
/// When `to` cannot be written.
pub fn serve(from: impl Read + Send + 'static, mut to: impl Write) -> std::io::Result<()> {
    let requests = requests(from);
    let mut opened: Option<(Option<String>, Gpu)> = None;
    let mut next = requests.receive.recv().ok();
    // One turn for each adapter that is asked for.
    while let Some(request) = next.take() {
        if opened
            .as_ref()
            .is_none_or(|(name, _)| *name != request.adapter)
        {
            opened = None;
            match Gpu::open(request.adapter.as_deref()) {
                Ok(gpu) => opened = Some((request.adapter.clone(), gpu)),
                Err(error) => {
                    refuse(&mut to, *error)?;
                    next = requests.next();
                    continue;
                }
            }
        }
        if let Some((name, gpu)) = &opened {
            next = with_adapter(gpu, name, request, &requests, &mut to)?;
            if gpu.is_lost() {
                opened = None;
            }
        }
    }
    Ok(())
}

/// The requests that arrive, and whether one is being answered.
struct Requests {
    receive: mpsc::Receiver<Request>,
    busy: Arc<AtomicBool>,
}

impl Requests {
    fn next(&self) -> Option<Request> {
        self.busy.store(false, Ordering::SeqCst);
        self.receive.recv().ok()
    }
}

/// Reads requests on a thread of its own. When there are no more while one is being answered, whoever asked has gone
/// away, and nothing else would end a driver that hangs.
fn requests(mut from: impl Read + Send + 'static) -> Requests {
    let (send, receive) = mpsc::channel();
    let busy = Arc::new(AtomicBool::new(false));
    let answering = busy.clone();
    std::thread::spawn(move || {
        while let Ok(request) = read_message::<Request>(&mut from) {
            answering.store(true, Ordering::SeqCst);
            if send.send(request).is_err() {
                return;
            }
        }
        if answering.load(Ordering::SeqCst) {
            std::process::abort();
        }
    });
    Requests { receive, busy }
}

/// Answers requests for one adapter; gives the first that is for another, or that comes after the device was lost.
fn with_adapter(
    gpu: &Gpu,
    name: &Option<String>,
    first: Request,
    requests: &Requests,
    to: &mut impl Write,
) -> std::io::Result<Option<Request>> {
    let mut subject: Option<Loaded<'_>> = None;
    let mut next = Some(first);
    while let Some(request) = next.take() {
        if request.adapter != *name || gpu.is_lost() {
            return Ok(Some(request));
        }
        match answer(gpu, &mut subject, &request) {
            Ok((answer, numbers)) => {
                write_message(to, &answer)?;
                write_numbers(to, &numbers)?;
                to.flush()?;
            }
            Err(error) => refuse(to, *error)?,
        }
        next = requests.next();
    }
    Ok(None)
}

fn refuse(to: &mut impl Write, error: Diagnostic) -> std::io::Result<()> {
    write_message(to, &Answer::Refused(Said::of(error)))?;
    write_numbers(to, &[])?;
    to.flush()
}

/// A scene that was read, with what was compiled for it.
struct Loaded<'g> {
    subject: Subject,
    source: Source,
    scene: Scene,
    renderer: Renderer<'g>,
    /// The last one that was used is the last one here.
    pipelines: Vec<(Variant, Pipeline)>,
    /// The same of those that were timed.
    timed: Vec<(Variant, Timed)>,
}

impl<'g> Loaded<'g> {
    fn new(gpu: &'g Gpu, subject: &Subject) -> Result<Self> {
        let modules = subject.modules()?;
        let source = Source::read_with(&subject.shader, &subject.stages(), &modules)?;
        Ok(Self {
            scene: Scene::read(&source, subject.scene.as_deref())?,
            subject: subject.clone(),
            source,
            renderer: Renderer::new(gpu),
            pipelines: Vec::new(),
            timed: Vec::new(),
        })
    }

    /// Has the pipeline of a variant as the last one.
    fn compile(&mut self, variant: &Variant) -> Result<()> {
        let known = self.pipelines.iter().position(|(v, _)| v == variant);
        let entry = match known {
            Some(at) => self.pipelines.remove(at),
            None => {
                let pipeline = self.compiled(variant, Renderer::pipeline)?;
                (variant.clone(), pipeline)
            }
        };
        self.pipelines.push(entry);
        if self.pipelines.len() > KEPT {
            self.pipelines.remove(0);
        }
        Ok(())
    }

    /// What is compiled of a variant's stages.
    fn compiled<T>(
        &self,
        variant: &Variant,
        compile: impl FnOnce(&Renderer<'g>, Stages<'_>, &Scene) -> Result<T>,
    ) -> Result<T> {
        let text = match &variant.text {
            Some(text) => Some(Source::parse("variant.wgsl", &**text)?),
            None => None,
        };
        let stages = self.stages(text.as_ref().unwrap_or(&self.source))?;
        let stages = Stages {
            auto_lod: variant.auto_lod,
            ..stages
        };
        compile(&self.renderer, stages, &self.scene)
    }

    /// A variant compiled for being timed, with the textures that were made for it and what fills its parameters.
    fn timed(&self, variant: &Variant) -> Result<Timed> {
        let mut timed = self.compiled(variant, Renderer::timed)?;
        if let Some(file) = &variant.mesh {
            let bytes = read(file, "mesh")?;
            timed = timed.on(Some(Arc::new(handed_over::mesh(&bytes)?)));
        }
        let Some(text) = &variant.text else {
            return Ok(timed);
        };
        let source = Source::parse("variant.wgsl", &**text)?;
        Ok(timed.with(made(&source, variant)?, filled(&source)?))
    }

    fn stages<'a>(&'a self, source: &'a Source) -> Result<Stages<'a>> {
        Stages::of_source(source, &self.scene).ok_or_else(no_vertices)
    }
}

fn no_vertices() -> Box<Diagnostic> {
    Diagnostic::error("a variant has no vertex stage, and the scene supplies none")
        .with_note("give it the vertex entry point of the shader")
}

/// What was handed over in a file.
fn read(file: &Path, what: &str) -> Result<Vec<u8>> {
    std::fs::read(file).map_err(|error| {
        Diagnostic::error(format!("cannot read the {what} `{}`", file.display())).with_reason(error)
    })
}

/// The textures that were made for a variant, where its text binds them.
fn made(source: &Source, variant: &Variant) -> Result<Bindings> {
    let mut more = Bindings::new();
    for (name, file) in &variant.made {
        let mut declared = source.module.global_variables.iter();
        let declared = declared.find(|(_, declared)| declared.name.as_ref() == Some(name));
        let binding = declared.and_then(|(_, declared)| declared.binding);
        let shown = file.display().to_string();
        let bytes = read(file, "texture")?;
        if let Some(at) = binding {
            let texture = Arc::new(generated::read(&shown, &bytes)?);
            more.insert((at.group, at.binding), Resource::Texture(texture));
        }
    }
    Ok(more)
}

fn answer<'g>(
    gpu: &'g Gpu,
    subject: &mut Option<Loaded<'g>>,
    request: &Request,
) -> Result<(Answer, Vec<f32>)> {
    if request.task == Task::Name {
        let label = gpu.label();
        let name = format!("{label}, {}", label.driver);
        return Ok((Answer::Name(name), Vec::new()));
    }
    let mut loaded = match subject.take() {
        Some(loaded) if loaded.subject == request.subject => loaded,
        _ => Loaded::new(gpu, &request.subject)?,
    };
    let answered = match &request.task {
        Task::Draw { variant, wanted } => draw(gpu, &mut loaded, variant, *wanted),
        Task::Time {
            variants,
            distance,
            effort,
        } => time(&mut loaded, variants, *distance, effort).map(|answer| (answer, Vec::new())),
        Task::Feed { variants, asked } => feed(&mut loaded, variants, asked),
        Task::Name => Err(Diagnostic::error("it was answered before")),
    };
    *subject = Some(loaded);
    answered
}

fn draw(
    gpu: &Gpu,
    loaded: &mut Loaded<'_>,
    variant: &Variant,
    wanted: Wanted,
) -> Result<(Answer, Vec<f32>)> {
    loaded.compile(variant)?;
    let mut frames = loaded.scene.frames(wanted.distance).into_iter();
    let Some(mut frame) = frames.nth(wanted.frame) else {
        return Err(Diagnostic::error(format!(
            "the scene has no picture {} at a distance of {}",
            wanted.frame, wanted.distance
        )));
    };
    frame.offset = wanted.offset;
    frame.grid = wanted.grid;
    let Some((_, pipeline)) = loaded.pipelines.last() else {
        return Err(Diagnostic::error("nothing was compiled"));
    };
    let drawn = loaded.renderer.draw(pipeline, &loaded.scene, &frame)?;
    let picture = drawn.picture(gpu)?;
    let mut numbers = picture.pixels.as_flattened().to_vec();
    numbers.extend(&picture.covered);
    let answer = Answer::Picture {
        width: picture.width,
        height: picture.height,
    };
    Ok((answer, numbers))
}

/// Gives variants single inputs.
fn feed(
    loaded: &mut Loaded<'_>,
    variants: &[Variant],
    asked: &Asked,
) -> Result<(Answer, Vec<f32>)> {
    let mut numbers = Vec::new();
    for variant in variants {
        let text = match &variant.text {
            Some(text) => Some(Source::parse("variant.wgsl", &**text)?),
            None => None,
        };
        let source = text.as_ref().unwrap_or(&loaded.source);
        // What fills parameters is drawn with, not fed.
        let bad = match text.is_some() && !source.filled().is_empty() {
            true => None,
            false => {
                let own = Stages::of_source(source, &loaded.scene).ok_or_else(no_vertices)?;
                let more = made(source, variant)?;
                let scene = (&loaded.scene, &more);
                loaded.renderer.bad(own, scene, asked)?
            }
        };
        match bad {
            Some(bad) => numbers.extend(bad.into_iter().map(|bad| f32::from(u8::from(bad)))),
            None => return Ok((Answer::Fed(false), Vec::new())),
        }
    }
    Ok((Answer::Fed(true), numbers))
}

/// Times variants. They are compiled once, as long as they fit into what is kept.
fn time(
    loaded: &mut Loaded<'_>,
    variants: &[Variant],
    distance: f64,
    effort: &Effort,
) -> Result<Answer> {
    let original = Variant::default();
    let mut failed: Vec<Option<Said>> = Vec::new();
    let mut kept = std::mem::take(&mut loaded.timed);
    for variant in std::iter::once(&original).chain(variants) {
        let known = kept.iter().position(|(v, _)| v == variant);
        let compiled = match known {
            Some(at) => Ok(kept.remove(at).1),
            None => loaded.timed(variant),
        };
        failed.push(match compiled {
            Ok(timed) => {
                kept.push((variant.clone(), timed));
                None
            }
            Err(error) => Some(Said::of(*error)),
        });
    }
    let over = kept
        .len()
        .saturating_sub(KEPT_TIMED.max(variants.len() + 1));
    kept.drain(..over);
    let find = |variant: &Variant| {
        let found = kept.iter().find(|(v, _)| v == variant);
        found.map(|(_, timed)| timed)
    };
    let mut failed = failed.into_iter();
    let timings = match (failed.next().flatten(), find(&original)) {
        (None, Some(original)) => {
            let good: Vec<&Timed> = variants.iter().filter_map(find).collect();
            let Loaded {
                source,
                scene,
                renderer,
                ..
            } = loaded;
            let stages = Stages::of_source(source, scene);
            let stages = stages.ok_or_else(|| Diagnostic::error("nothing was compiled"));
            stages.and_then(|stages| {
                let place = Place {
                    scene,
                    stages,
                    distance,
                };
                renderer.time(&place, original, &good, effort)
            })
        }
        (said, _) => {
            Err(said.map_or_else(|| Diagnostic::error("nothing was compiled"), Said::error))
        }
    };
    loaded.timed = kept;
    let mut timings = timings?.into_iter();
    let answers = failed.map(|said| match said {
        Some(said) => Err(said),
        // One for each that was compiled.
        None => match timings.next() {
            Some(timing) => timing.map_err(|error| Said::of(*error)),
            None => Err(Said::of(*Diagnostic::error("a variant was not timed"))),
        },
    });
    Ok(Answer::Timed(answers.collect()))
}
