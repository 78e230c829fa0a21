//! The parent: starts a child when it needs one, waits for its answer for so long, and ends it when there is none.

use super::{
    Answer, Request, Said, Subject, Task, Variant, Wanted, read_message, read_numbers,
    write_message,
};
use crate::Diagnostic;
use crate::eval::image::Picture;
use crate::stability::Asked;
use crate::time::{Effort, Timing};
use std::io::{BufReader, Read};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::time::Duration;

/// How much of what a driver prints is kept, in bytes: the end.
const SAID: usize = 4096;

/// Why there is no picture.
#[derive(Clone, Debug)]
pub enum Failure {
    /// The device cannot draw it, or the input is bad.
    Refused(Box<Diagnostic>),
    /// There was no answer for so long: a shader that never ends, or a driver that hangs. The child was ended.
    Hung(Duration),
    /// The child ended without an answer: how, and what was printed last.
    Crashed {
        /// As the system says it: `signal: 11 (SIGSEGV)`.
        status: String,
        /// The end of what it printed.
        said: String,
    },
    /// No child could be started.
    NotStarted(String),
}

impl Failure {
    /// The same for a person. `adapter` is the name that was asked for.
    pub fn diagnostic(self, adapter: Option<&str>) -> Box<Diagnostic> {
        let adapter = adapter.map_or(String::new(), |name| format!(" on `{name}`"));
        match self {
            Self::Refused(error) => error,
            Self::Hung(patience) => Diagnostic::error(format!(
                "drawing{adapter} did not end within {} seconds",
                patience.as_secs_f64()
            ))
            .with_reason("the shader never ends there, or the driver hangs")
            .with_note("look for a loop whose end depends on a value that never comes, or draw with another adapter: `--adapter`"),
            Self::Crashed { status, said } => {
                let error = Diagnostic::error(format!("the driver crashed while drawing{adapter}"))
                    .with_reason(status);
                let error = match said.trim() {
                    "" => error,
                    said => error.with_reason(said),
                };
                error.with_note("another adapter may draw it, with `--adapter`; the evaluator needs none")
            }
            Self::NotStarted(why) => {
                Diagnostic::error("the program that draws on the GPU cannot be started")
                    .with_reason(why)
                    .with_note("it is lodc itself: is its file still where it was started from?")
            }
        }
    }
}

/// Draws in a child process, which is started when the first picture is asked for, and again after each that failed.
#[derive(Debug)]
pub struct Worker {
    program: PathBuf,
    adapter: Option<String>,
    patience: Duration,
    running: Option<Running>,
}

/// An answer to something else than was asked.
fn confused() -> Box<Diagnostic> {
    Diagnostic::error("the program that draws on the GPU answered something else")
        .with_note("is it of the same version of lodc?")
}

/// What a child said: an answer with its numbers, or that there will be none.
type Heard = std::io::Result<(Answer, Vec<f32>)>;

#[derive(Debug)]
struct Running {
    child: Child,
    /// `None` once it is closed, which tells the child to end.
    requests: Option<ChildStdin>,
    answers: mpsc::Receiver<Heard>,
    said: Arc<Mutex<Vec<u8>>>,
}

impl Worker {
    /// A worker that has not started. `program` is lodc's own file, `adapter` a part of an adapter's name, and
    /// `patience` how long a picture may take, with reading the scene and compiling the shader before the first.
    pub fn new(program: PathBuf, adapter: Option<String>, patience: Duration) -> Self {
        Self {
            program,
            adapter,
            patience,
            running: None,
        }
    }

    /// The name of the adapter that was asked for.
    pub fn adapter(&self) -> Option<&str> {
        self.adapter.as_deref()
    }

    /// Changes how long a picture may take.
    pub fn set_patience(&mut self, patience: Duration) {
        self.patience = patience;
    }

    /// A picture of a variant, in fine pixels.
    ///
    /// # Errors
    /// When it cannot be drawn. After a [`Failure`] other than [`Failure::Refused`] the next picture is drawn by
    /// another child.
    pub fn picture(
        &mut self,
        subject: &Subject,
        variant: &Variant,
        wanted: Wanted,
    ) -> Result<Picture, Failure> {
        let task = Task::Draw {
            variant: variant.clone(),
            wanted,
        };
        let (answer, numbers) = self.ask(subject, task, self.patience)?;
        match answer {
            Answer::Refused(said) => Err(Failure::Refused(said.error())),
            Answer::Timed(_) | Answer::Fed(_) | Answer::Name(_) => {
                Err(Failure::Refused(confused()))
            }
            Answer::Picture { width, height } => {
                let count = width as usize * height as usize;
                let (colours, covered) = numbers.split_at(numbers.len().min(4 * count));
                Ok(Picture {
                    width,
                    height,
                    pixels: colours.as_chunks::<4>().0.to_vec(),
                    covered: covered.to_vec(),
                })
            }
        }
    }

    /// What the adapter is called, with its interface and its driver.
    ///
    /// # Errors
    /// When there is no such adapter, or its driver fails.
    pub fn label(&mut self) -> Result<String, Failure> {
        let nothing = Subject::default();
        match self.ask(&nothing, Task::Name, self.patience)?.0 {
            Answer::Name(name) => Ok(name),
            Answer::Refused(said) => Err(Failure::Refused(said.error())),
            _ => Err(Failure::Refused(confused())),
        }
    }

    /// For each variant and each fragment of the inputs, whether what it gives is not finite; nothing where one of them cannot be fed.
    ///
    /// # Errors
    /// As [`Self::picture`].
    pub fn feed(
        &mut self,
        subject: &Subject,
        variants: &[Variant],
        asked: &Asked,
    ) -> Result<Option<Vec<Vec<bool>>>, Failure> {
        let task = Task::Feed {
            variants: variants.to_vec(),
            asked: asked.clone(),
        };
        let patience = self.patience * (variants.len() as u32 + 1);
        let (answer, numbers) = self.ask(subject, task, patience)?;
        match answer {
            Answer::Fed(true) if numbers.len() == variants.len() * asked.count() => {
                let each = numbers.chunks(asked.count().max(1));
                let each = each.map(|numbers| numbers.iter().map(|x| *x != 0.0).collect());
                Ok(Some(each.collect()))
            }
            Answer::Fed(false) => Ok(None),
            Answer::Refused(said) => Err(Failure::Refused(said.error())),
            _ => Err(Failure::Refused(confused())),
        }
    }

    /// Times variants against the original at a distance, all the scene's views taken together: one answer each, in
    /// their order. What one of them fails at, be it that the driver crashes or hangs, does not keep the others from
    /// being timed.
    ///
    /// # Errors
    /// When the original cannot be timed either.
    pub fn time(
        &mut self,
        subject: &Subject,
        variants: &[Variant],
        distance: f64,
        effort: &Effort,
    ) -> Result<Vec<Result<Timing, Failure>>, Failure> {
        if variants.is_empty() {
            return Ok(Vec::new());
        }
        let failure = match self.time_together(subject, variants, distance, effort) {
            Ok(timings) => return Ok(timings),
            Err(failure @ Failure::NotStarted(_)) => return Err(failure),
            Err(failure) => failure,
        };
        // One of them takes the child or the device with it, or the original does.
        let once = Effort {
            rounds_at_least: 1,
            rounds_at_most: 1,
            ..*effort
        };
        self.time_together(subject, &[Variant::default()], distance, &once)?;
        if variants.len() == 1 {
            return Ok(vec![Err(failure)]);
        }
        let mut timings = Vec::new();
        for half in [
            &variants[..variants.len() / 2],
            &variants[variants.len() / 2..],
        ] {
            timings.extend(self.time(subject, half, distance, effort)?);
        }
        Ok(timings)
    }

    /// The same without another try.
    fn time_together(
        &mut self,
        subject: &Subject,
        variants: &[Variant],
        distance: f64,
        effort: &Effort,
    ) -> Result<Vec<Result<Timing, Failure>>, Failure> {
        let task = Task::Time {
            variants: variants.to_vec(),
            distance,
            effort: *effort,
        };
        let count = variants.len() as u32;
        // Each is compiled, as is the original; and rounds may take twice the budget.
        let patience = self.patience * (count + 1) + effort.budget * 3 * count;
        let (answer, _) = self.ask(subject, task, patience)?;
        match answer {
            Answer::Timed(timings) if timings.len() == variants.len() => {
                let failed = |said: Said| Failure::Refused(said.error());
                Ok(timings.into_iter().map(|t| t.map_err(failed)).collect())
            }
            Answer::Refused(said) => Err(Failure::Refused(said.error())),
            _ => Err(Failure::Refused(confused())),
        }
    }

    fn ask(
        &mut self,
        subject: &Subject,
        task: Task,
        patience: Duration,
    ) -> Result<(Answer, Vec<f32>), Failure> {
        let request = Request {
            adapter: self.adapter.clone(),
            subject: subject.clone(),
            task,
        };
        let mut running = match self.running.take() {
            Some(running) => running,
            None => Running::start(&self.program)?,
        };
        let Some(requests) = &mut running.requests else {
            return Err(running.crashed());
        };
        if write_message(requests, &request).is_err() {
            return Err(running.crashed());
        }
        match running.answers.recv_timeout(patience) {
            Ok(Ok(answer)) => {
                self.running = Some(running);
                Ok(answer)
            }
            Err(mpsc::RecvTimeoutError::Timeout) => {
                running.end();
                Err(Failure::Hung(patience))
            }
            Ok(Err(_)) | Err(mpsc::RecvTimeoutError::Disconnected) => Err(running.crashed()),
        }
    }
}

impl Running {
    fn start(program: &PathBuf) -> Result<Self, Failure> {
        let mut child = Command::new(program)
            .arg(super::ARGUMENT)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(|error| Failure::NotStarted(error.to_string()))?;
        let (send, answers) = mpsc::channel();
        if let Some(out) = child.stdout.take() {
            std::thread::spawn(move || {
                let mut out = BufReader::new(out);
                loop {
                    let heard = read_message(&mut out)
                        .and_then(|answer| Ok((answer, read_numbers(&mut out)?)));
                    let last = heard.is_err();
                    if send.send(heard).is_err() || last {
                        return;
                    }
                }
            });
        }
        let said: Arc<Mutex<Vec<u8>>> = Arc::default();
        if let Some(mut printed) = child.stderr.take() {
            let keep = said.clone();
            std::thread::spawn(move || {
                let mut part = [0; 1024];
                while let Ok(count @ 1..) = printed.read(&mut part) {
                    let mut kept = keep.lock().unwrap_or_else(PoisonError::into_inner);
                    kept.extend(&part[..count]);
                    let over = kept.len().saturating_sub(SAID);
                    kept.drain(..over);
                }
            });
        }
        Ok(Self {
            requests: child.stdin.take(),
            child,
            answers,
            said,
        })
    }

    /// Ends the child, whatever it does.
    fn end(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }

    /// How a child ended that has closed its end.
    fn crashed(mut self) -> Failure {
        self.requests = None;
        // It is ending: nobody closes its standard output before. It gets a second for that.
        let mut status = Err("it did not end".to_owned());
        for _ in 0..100 {
            status = match self.child.try_wait() {
                Ok(Some(status)) => Ok(status.to_string()),
                Ok(None) => {
                    std::thread::sleep(Duration::from_millis(10));
                    continue;
                }
                Err(error) => Err(error.to_string()),
            };
            break;
        }
        let status = status.unwrap_or_else(|why| why);
        self.end();
        let said = self.said.lock().unwrap_or_else(PoisonError::into_inner);
        Failure::Crashed {
            status,
            said: String::from_utf8_lossy(&said).into_owned(),
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.requests = None;
        self.end();
    }
}
