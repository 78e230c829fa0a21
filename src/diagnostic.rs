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
#[derive(Clone)]
pub struct Diagnostic {
    /// Error or warning.
    pub severity: Severity,
    /// What is wrong, in one line.
    pub message: String,
    /// The file that the labels point into: its name as the user gave it, and its text.
    pub source: Option<(String, String)>,
    /// Places in that file, as byte ranges, each with a remark; the first is the main one.
    pub labels: Vec<(Range<usize>, String)>,
    /// Ways out, printed after `help:`, and more of the reason, which begin with `note: `.
    pub notes: Vec<String>,
    /// Whether it is about a lock that no longer fits what it was made from: nothing is wrong but that it is old.
    pub is_stale: bool,
}

/// What a note that is more of the reason begins with.
const REASON: &str = "note: ";

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
            is_stale: false,
        })
    }

    /// An error about a lock that no longer fits what it was made from.
    pub fn stale(message: impl fmt::Display) -> Box<Self> {
        Box::new(Self {
            is_stale: true,
            ..*Self::error(format!("the lock is stale: {message}"))
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

    /// Adds more of the reason.
    pub fn with_reason(mut self: Box<Self>, reason: impl fmt::Display) -> Box<Self> {
        self.notes.push(format!("{REASON}{reason}"));
        self
    }

    /// The whole message as text, with colour codes for a terminal, which take the feature `cli`, or without.
    #[cfg_attr(
        not(feature = "cli"),
        allow(unused_variables, reason = "there is no terminal")
    )]
    pub fn render(&self, colour: bool) -> String {
        let report = match self.severity {
            Severity::Error => Report::error(),
            Severity::Warning => Report::warning(),
        }
        .with_message(&self.message)
        .with_notes(self.notes.iter().map(|n| note(n)).collect());
        let (name, text) = self.source.clone().unwrap_or_default();
        let report = match self.labels.is_empty() && !name.is_empty() {
            // Without a place the file would not be named at all.
            true => report.with_note(format!("{REASON}in {name}")),
            false => report,
        };
        let text = printable(&text);
        let labels = self
            .labels
            .iter()
            .enumerate()
            .map(|(i, (range, remark))| {
                let start = boundary(&text, range.start);
                let range = start..boundary(&text, range.end).max(start);
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
        #[cfg(feature = "cli")]
        if colour {
            let mut out = codespan_reporting::term::termcolor::Ansi::new(Vec::new());
            if term::emit_to_write_style(&mut out, &config, &file, &report).is_ok() {
                return String::from_utf8_lossy(&out.into_inner()).into_owned();
            }
        }
        let rendered = term::emit_into_string(&config, &file, &report);
        rendered.unwrap_or_else(|_| format!("{}\n", self.message))
    }
}

/// A note as it is printed.
fn note(text: &str) -> String {
    match text.starts_with(REASON) {
        true => text.to_owned(),
        false => format!("help: {text}"),
    }
}

/// The text with control characters replaced by as many bytes, so that a file cannot steer the terminal
/// and offsets stay right.
fn printable(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c.is_control() && !matches!(c, '\n' | '\r' | '\t') {
            true => out.extend(std::iter::repeat_n('?', c.len_utf8())),
            false => out.push(c),
        }
    }
    out
}

/// The nearest offset at or before `at` that does not split a character.
fn boundary(text: &str, at: usize) -> usize {
    let mut at = at.min(text.len());
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    at
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.render(false))
    }
}

/// As it is shown, but for the word in front: a `main` that returns it prints `Error: ` and this.
impl fmt::Debug for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let shown = self.render(false);
        f.write_str(shown.strip_prefix("error: ").unwrap_or(&shown))
    }
}

impl std::error::Error for Diagnostic {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_notes_and_reasons_are_shown() {
        let text = Diagnostic::error("no such thing")
            .with_source("a.wgsl", "let x = y;\n")
            .with_label(8..9, "here")
            .with_reason("there is none")
            .with_note("declare it")
            .to_string();
        assert!(text.starts_with("error: no such thing\n"), "{text}");
        assert!(text.contains("a.wgsl:1:9"), "{text}");
        assert!(text.contains("= note: there is none"), "{text}");
        assert!(text.contains("= help: declare it"), "{text}");
    }

    #[test]
    fn a_main_that_fails_says_it_in_full() {
        let error = Diagnostic::error("no such thing").with_note("declare it");
        let shown = format!("Error: {error:?}");
        assert_eq!(
            shown.trim_end(),
            "Error: no such thing\n = help: declare it"
        );
    }

    #[test]
    fn a_file_is_named_without_a_place_too() {
        let text = Diagnostic::error("bad")
            .with_source("a.wgsl", "")
            .to_string();
        assert!(text.contains("= note: in a.wgsl"), "{text}");
    }

    #[test]
    fn odd_places_and_bytes_do_no_harm() {
        let render = |range| {
            Diagnostic::warning("w")
                .with_source("a", "ü\u{1b}[2J\u{85}ü")
                .with_label(range, "")
                .render(true)
        };
        for range in [0..1, 1..2, 0..99, 50..60, 0..0, Range { start: 3, end: 1 }] {
            assert!(!render(range).contains("\u{1b}[2J"));
        }
        assert_eq!(printable("ü\u{85}\n").len(), "ü\u{85}\n".len());
    }
}
