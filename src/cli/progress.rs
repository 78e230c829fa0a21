//! A progress bar with the time left, for what takes over a second.

use crate::search::Progress;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// How long something runs before it gets a bar.
const PATIENCE: Duration = Duration::from_secs(1);
/// The bar's units.
const UNITS: u64 = 1000;

/// A bar that appears once the work has gone on for a second. Nothing is drawn where standard error is no terminal.
pub(super) struct Bar {
    bar: ProgressBar,
    began: Instant,
    farthest: Mutex<u64>,
}

impl Bar {
    /// `doing` is what takes the time, in one word.
    pub(super) fn new(doing: &str, quiet: bool) -> Self {
        let target = if quiet {
            ProgressDrawTarget::hidden()
        } else {
            ProgressDrawTarget::stderr()
        };
        let bar = ProgressBar::with_draw_target(Some(UNITS), ProgressDrawTarget::hidden());
        // The template parses; a bar without it would still be a bar.
        if let Ok(style) = ProgressStyle::with_template(&format!(
            "  {doing:<16}{{bar:26}} {{percent:>3}} %   {{msg}}   {{eta}} left",
        )) {
            bar.set_style(style.progress_chars("██▌░"));
        }
        bar.set_draw_target(target);
        Self {
            bar,
            began: Instant::now(),
            farthest: Mutex::new(0),
        }
    }

    /// Shows how far a search is: distances done, and within one the share of the work that is gone.
    pub(super) fn show(&self, progress: Progress) {
        let within = (1.0 - progress.share).clamp(0.0, 1.0);
        let done = (progress.distance as f64 - 1.0 + within) / progress.of.max(1) as f64;
        self.advance(done, || format!("{} variants", progress.variants));
    }

    /// Shows the share of the work that is done, 0 to 1, and a few words.
    pub(super) fn advance(&self, done: f64, message: impl FnOnce() -> String) {
        if self.began.elapsed() < PATIENCE {
            return;
        }
        if let Ok(mut farthest) = self.farthest.lock() {
            *farthest = (*farthest).max((done * UNITS as f64) as u64);
            self.bar.set_position(*farthest);
        }
        self.bar.set_message(message());
    }

    pub(super) fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
