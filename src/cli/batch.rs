//! Several shaders in one call: as many at a time as was asked for, and what comes of each said in the order of the arguments.

use super::{print, print_diagnostic};
use crate::compile::Request;
use crate::{Diagnostic, Result};
use clap::Args;
use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// The stack of each thread in bytes: that of a main thread.
const STACK: usize = 8 << 20;

/// How many shaders are worked on at a time.
#[derive(Clone, Copy, Debug, Args)]
pub(super) struct Jobs {
    /// How many shaders are worked on at a time
    #[arg(short, long, value_name = "N", default_value = "1")]
    pub(super) jobs: NonZeroUsize,
}

/// What came of one shader, said when its turn comes.
#[derive(Debug, Default)]
pub(super) struct Said {
    /// Warnings, which come first.
    #[allow(clippy::vec_box, reason = "as diagnostics are handed around")]
    pub(super) warnings: Vec<Box<Diagnostic>>,
    /// What goes to standard output.
    pub(super) text: String,
    /// What ended it, if something did.
    pub(super) error: Option<Box<Diagnostic>>,
    /// The exit code that it asks for: 0, 1 when a check failed, 2 for bad input.
    pub(super) code: u8,
}

impl Said {
    /// What has failed, as bad input.
    pub(super) fn failed(error: Box<Diagnostic>) -> Self {
        Self {
            error: Some(error),
            code: 2,
            ..Self::default()
        }
    }

    fn say(&self) {
        self.warnings.iter().for_each(|w| print_diagnostic(w));
        print(&self.text);
        if let Some(error) = &self.error {
            print_diagnostic(error);
        }
    }
}

/// Does the work for each, so many at a time. What one says is said when all before it are done; what fails does not stop the
/// others. Comes back with the largest exit code.
pub(super) fn each<T: Sync>(jobs: Jobs, of: &[T], work: impl Fn(usize, &T) -> Said + Sync) -> u8 {
    /// What is done and waits for its turn, and whose turn it is.
    #[derive(Default)]
    struct Turns {
        waiting: BTreeMap<usize, Said>,
        turn: usize,
        code: u8,
    }
    let next = AtomicUsize::new(0);
    let turns = Mutex::new(Turns::default());
    let run = || {
        loop {
            let at = next.fetch_add(1, Ordering::Relaxed);
            let Some(one) = of.get(at) else { break };
            let said = work(at, one);
            let mut turns = turns.lock().unwrap_or_else(PoisonError::into_inner);
            turns.waiting.insert(at, said);
            while let Some(said) = {
                let turn = turns.turn;
                turns.waiting.remove(&turn)
            } {
                said.say();
                turns.code = turns.code.max(said.code);
                turns.turn += 1;
            }
        }
    };
    let threads = jobs.jobs.get().min(of.len());
    if threads < 2 {
        run();
    } else {
        std::thread::scope(|scope| {
            for _ in 1..threads {
                let thread = std::thread::Builder::new().stack_size(STACK);
                if thread.spawn_scoped(scope, run).is_err() {
                    // The system has no more: those that it gave do the work.
                    break;
                }
            }
            run();
        });
    }
    turns
        .into_inner()
        .unwrap_or_else(PoisonError::into_inner)
        .code
}

/// Where the outputs of several shaders go: that of one is named, those of several are in a folder under their own names.
///
/// # Errors
/// When two would have the same name.
pub(super) fn placed(mut requests: Vec<Request>, output: Option<PathBuf>) -> Result<Vec<Request>> {
    if let [one] = &mut requests[..] {
        if output.is_some() {
            one.output = output;
        }
        return Ok(requests);
    }
    let mut taken: BTreeMap<PathBuf, &Path> = BTreeMap::new();
    if output.is_some() {
        for request in &mut requests {
            request.folder.clone_from(&output);
        }
    }
    for request in &requests {
        if let Some(other) = taken.insert(request.lock(), &request.shader) {
            return Err(Diagnostic::error(format!(
                "`{}` and `{}` would have the same outputs, `{}` and what is beside it",
                other.display(),
                request.shader.display(),
                request.lock().display()
            ))
            .with_note("write them in two calls, with another `-o` each"));
        }
    }
    Ok(requests)
}
