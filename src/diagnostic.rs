//! Errors and warnings as a person reads them: the message, the place in their own source, the way out.

use codespan_reporting::diagnostic::{Diagnostic as Report, Label};
use codespan_reporting::files::SimpleFile;
use codespan_reporting::term;
use std::fmt;
use std::ops::Range;

/// How much a diagnostic matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    /// The job cannot be done.
    Error,
    /// It was done, and something about it should be known.
    Warning,
}

/// One message. Messages and notes are lower case, without a full stop.
#[derive(Clone, Debug)]
pub struct Diagnostic {
    /// Error or warning.
    pub severity: Severity,
    /// What is wrong, in one line.
    pub message: String,
    /// The file that the labels point into: its name as the user gave it, and its text.
    pub source: Option<(String, String)>,
    /// Places in that file, as byte ranges, each with a remark; the first is the main one.
    pub labels: Vec<(Range<usize>, String)>,
    /// Ways out, or more of the reason.
    pub notes: Vec<String>,
}

/// The result of everything in lodc that can fail because of its input.
pub type Result<T> = std::result::Result<T, Box<Diagnostic>>;

impl Diagnostic {
    /// An error with a message alone.
    pub fn error(message: impl Into<String>) -> Box<Self> {
        Box::new(Self {
            severity: Severity::Error,
            message: message.into(),
            source: None,
            labels: Vec::new(),
            notes: Vec::new(),
        })
    }

    /// A warning with a message alone.
    pub fn warning(message: impl Into<String>) -> Box<Self> {
        Box::new(Self {
            severity: Severity::Warning,
            ..*Self::error(message)
        })
    }

    /// Names the file that labels point into.
    pub fn with_source(
        mut self: Box<Self>,
        name: impl Into<String>,
        text: impl Into<String>,
    ) -> Box<Self> {
        self.source = Some((name.into(), text.into()));
        self
    }

    /// Adds a place.
    pub fn with_label(
        mut self: Box<Self>,
        range: Range<usize>,
        remark: impl Into<String>,
    ) -> Box<Self> {
        self.labels.push((range, remark.into()));
        self
    }

    /// Adds a way out.
    pub fn with_note(mut self: Box<Self>, note: impl Into<String>) -> Box<Self> {
        self.notes.push(note.into());
        self
    }

    /// The whole message as text, with colour codes for a terminal or without.
    pub fn render(&self, colour: bool) -> String {
        let report = match self.severity {
            Severity::Error => Report::error(),
            Severity::Warning => Report::warning(),
        }
        .with_message(&self.message)
        .with_notes(self.notes.iter().map(|n| format!("help: {n}")).collect());
        let (name, text) = self.source.clone().unwrap_or_default();
        let limit = text.len();
        let labels = self
            .labels
            .iter()
            .enumerate()
            .map(|(i, (range, remark))| {
                let range = range.start.min(limit)..range.end.min(limit);
                let label = if i == 0 {
                    Label::primary((), range)
                } else {
                    Label::secondary((), range)
                };
                label.with_message(remark)
            })
            .collect();
        let report = report.with_labels(labels);
        let config = term::Config::default();
        let file = SimpleFile::new(name, text);
        let rendered = if colour {
            let mut out = codespan_reporting::term::termcolor::Ansi::new(Vec::new());
            let done = term::emit_to_write_style(&mut out, &config, &file, &report);
            done.map(|()| String::from_utf8_lossy(&out.into_inner()).into_owned())
        } else {
            term::emit_into_string(&config, &file, &report)
        };
        rendered.unwrap_or_else(|_| format!("{}\n", self.message))
    }
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.render(false))
    }
}

impl std::error::Error for Diagnostic {}
