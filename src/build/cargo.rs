//! What a build script tells cargo: which files matter, and what is worth a warning.

use crate::Diagnostic;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// The folder that cargo gives a build script.
pub(super) fn out_dir() -> Option<PathBuf> {
    let folder = std::env::var_os("OUT_DIR");
    folder.filter(|folder| !folder.is_empty()).map(Into::into)
}

/// Whether cargo is listening: whether this is a build script that runs.
pub(super) fn listens() -> bool {
    // What is compiled has `OUT_DIR` too; these only a build script has.
    let has = |name| std::env::var_os(name).is_some();
    has("OUT_DIR") && has("TARGET") && has("HOST")
}

/// Lines for cargo: the files that matter, then the warnings.
pub(super) fn directives(files: &[PathBuf], warnings: &[Box<Diagnostic>]) -> String {
    let mut out = String::new();
    for file in files {
        writeln!(out, "cargo::rerun-if-changed={}", one_line(&said(file))).ok();
    }
    for warning in warnings {
        writeln!(out, "cargo::warning={}", line_of(warning)).ok();
    }
    out
}

fn said(file: &Path) -> String {
    file.display().to_string()
}

/// A diagnostic as one line: cargo shows each line of a warning by itself.
fn line_of(diagnostic: &Diagnostic) -> String {
    let mut text = diagnostic.message.clone();
    for note in &diagnostic.notes {
        write!(text, "; {}", note.strip_prefix("note: ").unwrap_or(note)).ok();
    }
    one_line(&text)
}

fn one_line(text: &str) -> String {
    text.replace(['\n', '\r'], " ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_warning_is_one_line() {
        let warning = Diagnostic::warning("a\nb")
            .with_reason("c\nd")
            .with_note("e");
        let lines = directives(&["x.wgsl".into(), "y\n.toml".into()], &[warning]);
        assert_eq!(
            lines,
            "cargo::rerun-if-changed=x.wgsl\ncargo::rerun-if-changed=y .toml\ncargo::warning=a b; c d; e\n"
        );
    }
}
