//! The files that a source is made of, and where a span lies in them.
//!
//! Spans of a [`Source`]'s module count through all its texts: those of the main file come first, as they
//! are, and each other file starts behind the one before it.

use super::Source;
use naga::Span;
use std::ops::Range;
use std::path::PathBuf;

/// A file that a source is made of beside its main one: that of another stage, or an imported module.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OtherFile {
    /// Its name as messages call it.
    pub name: String,
    /// Where it was read from.
    pub path: Option<PathBuf>,
    /// Its text.
    pub text: String,
    /// The offset at which spans into it begin.
    pub(crate) start: usize,
}

/// A file of a source.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct File<'a> {
    /// Its name as messages call it.
    pub name: &'a str,
    /// Its text.
    pub text: &'a str,
    /// The offset at which spans into it begin: 0 for the main file.
    pub(crate) start: usize,
}

/// A place in a file of a source.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place<'a> {
    /// The file.
    pub file: File<'a>,
    /// The bytes of its text.
    pub range: Range<usize>,
}

impl File<'_> {
    /// A range of its bytes as a span of the source's module.
    pub(crate) fn span(&self, range: Range<usize>) -> Span {
        Span::from(range.start + self.start..range.end + self.start)
    }
}

impl Place<'_> {
    /// The line of its first byte, from 1.
    pub fn line(&self) -> u32 {
        let before = self.file.text.as_bytes();
        let before = &before[..self.range.start.min(before.len())];
        1 + before.iter().filter(|byte| **byte == b'\n').count() as u32
    }

    /// Whether it is in the file that the source is called after.
    pub fn is_in_main(&self) -> bool {
        self.file.start == 0
    }
}

impl Source {
    /// The files that the source is made of, the main one first.
    pub fn files(&self) -> impl Iterator<Item = File<'_>> {
        let main = File {
            name: &self.name,
            text: &self.text,
            start: 0,
        };
        let others = self.others.iter().map(|other| File {
            name: &other.name,
            text: &other.text,
            start: other.start,
        });
        std::iter::once(main).chain(others)
    }

    /// Where a span of the module lies; `None` when it is undefined or in no file.
    pub fn place(&self, span: Span) -> Option<Place<'_>> {
        let range = span.to_range()?;
        let within = |file: &File<'_>| range.start >= file.start;
        let file = self.files().filter(within).last()?;
        let range = range.start - file.start..range.end.saturating_sub(file.start);
        (range.end <= file.text.len()).then_some(Place { file, range })
    }

    /// The offset at which spans into one more file would begin.
    pub(super) fn end(&self) -> usize {
        self.files()
            .last()
            .map_or(0, |f| f.start + f.text.len() + 1)
    }
}
