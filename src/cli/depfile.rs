//! Dependency files: which inputs decide which outputs, as Make and Ninja read it.
//!
//! ```text
//! out/rock.lod.wgsl: \
//!   rock.wgsl \
//!   rock.lod.toml
//! ```

use crate::{Diagnostic, Result};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Outputs, and what decides them.
#[derive(Debug)]
pub(super) struct Rule {
    /// What is written.
    pub(super) outputs: Vec<PathBuf>,
    /// What is read.
    pub(super) inputs: Vec<PathBuf>,
}

/// The rules as a dependency file. What is an output as well is no input: a circle would be refused.
///
/// # Errors
/// When a name cannot be said in one.
pub(super) fn text(rules: &[Rule]) -> Result<String> {
    let mut out = String::new();
    for rule in rules {
        let outputs: Vec<String> = rule
            .outputs
            .iter()
            .map(|path| escaped(path))
            .collect::<Result<_>>()?;
        let _ = write!(out, "{}:", outputs.join(" "));
        for input in &rule.inputs {
            if !rule.outputs.contains(input) {
                let _ = write!(out, " \\\n  {}", escaped(input)?);
            }
        }
        out.push('\n');
    }
    Ok(out)
}

/// A name as GCC writes it, which both read: what is special has a backslash before it, and backslashes before a blank are
/// doubled.
fn escaped(path: &Path) -> Result<String> {
    let refused = |why: &str| {
        let name = path.display();
        Diagnostic::error(format!(
            "`{name}` cannot be named in a dependency file: {why}"
        ))
        .with_note("give it another name, or leave `--depfile` out")
    };
    let name = path.to_str().ok_or_else(|| refused("it is not UTF-8"))?;
    let mut out = String::with_capacity(name.len());
    let mut backslashes = 0;
    for (at, c) in name.char_indices() {
        match c {
            '\n' | '\r' => return Err(refused("it has a line break")),
            ' ' | '\t' => {
                out.extend(std::iter::repeat_n('\\', backslashes + 1));
            }
            '#' => out.push('\\'),
            // That behind a drive's letter is none to them.
            ':' if at != 1 => out.push('\\'),
            '$' => out.push('$'),
            _ => {}
        }
        out.push(c);
        backslashes = if c == '\\' { backslashes + 1 } else { 0 };
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn special_characters_are_escaped() {
        for (name, written) in [
            ("a/b.wgsl", "a/b.wgsl"),
            ("two words", "two\\ words"),
            ("a\\ b", "a\\\\\\ b"),
            ("a\\b", "a\\b"),
            ("cost$5#1", "cost$$5\\#1"),
            ("C:/a:b", "C:/a\\:b"),
        ] {
            assert_eq!(escaped(Path::new(name)).expect(name), written);
        }
        assert!(escaped(Path::new("a\nb")).is_err());
    }

    #[test]
    fn an_output_is_no_input() {
        let paths = |names: &[&str]| names.iter().map(PathBuf::from).collect();
        let rule = Rule {
            outputs: paths(&["a.lod.wgsl", "b.png"]),
            inputs: paths(&["a.wgsl", "b.png", "a.lod.toml"]),
        };
        let text = text(&[rule]).expect("names of letters");
        assert_eq!(text, "a.lod.wgsl b.png: \\\n  a.wgsl \\\n  a.lod.toml\n");
    }
}
