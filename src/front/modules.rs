//! What composing a source of modules takes: folders with modules, and shader defs.

use crate::{Diagnostic, Result};
use std::fmt;
use std::path::PathBuf;

/// Where imported modules are found, and what is defined while they are read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Modules {
    /// Folders (`-I`), searched with all that is in them for `.wgsl` files with `#define_import_path`. Without
    /// any, the shader's own folder is searched.
    pub folders: Vec<PathBuf>,
    /// Shader defs (`-D`), in order; of one name the last counts.
    pub definitions: Vec<Definition>,
}

/// A shader def: what `#ifdef`, `#if` and `#{NAME}` ask for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Definition {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: Value,
}

/// The value of a shader def.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Value {
    /// `true` or `false`; both count as defined.
    Bool(bool),
    /// A whole number that may be negative: `-1`, `1i`.
    Int(i32),
    /// A whole number: `8`, `8u`.
    Uint(u32),
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bool(value) => write!(f, "{value}"),
            Self::Int(value) if *value >= 0 => write!(f, "{value}i"),
            Self::Int(value) => write!(f, "{value}"),
            Self::Uint(value) => write!(f, "{value}"),
        }
    }
}

impl Value {
    /// A value as it is written on the command line: `true`, `8`, `8u`, `-1`, `1i`.
    pub fn of_text(text: &str) -> Option<Self> {
        match text {
            "true" => return Some(Self::Bool(true)),
            "false" => return Some(Self::Bool(false)),
            _ => {}
        }
        if let Some(number) = text.strip_suffix('i') {
            return number.parse().ok().map(Self::Int);
        }
        if text.starts_with('-') {
            return text.parse().ok().map(Self::Int);
        }
        let number = text.strip_suffix('u').unwrap_or(text);
        number.parse().ok().map(Self::Uint)
    }
}

impl Definition {
    /// A shader def from `NAME` or `NAME=VALUE`.
    ///
    /// # Errors
    /// When the name is no word, or the value neither a boolean nor a whole number of 32 bits.
    pub fn of_text(text: &str) -> Result<Self> {
        let (name, value) = text.split_once('=').unwrap_or((text, "true"));
        let is_word = |c: char| c.is_alphanumeric() || c == '_';
        if name.is_empty() || !name.chars().all(is_word) {
            return Err(
                Diagnostic::error(format!("`{name}` is no name of a shader def"))
                    .with_note("write `-D NAME` or `-D NAME=8`"),
            );
        }
        let Some(value) = Value::of_text(value) else {
            return Err(Diagnostic::error(format!(
                "the shader def `{name}` cannot have the value `{value}`"
            ))
            .with_note("a value is `true`, `false`, or a whole number such as `8` or `-1`"));
        };
        Ok(Self {
            name: name.to_owned(),
            value,
        })
    }
}

impl fmt::Display for Definition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.value {
            Value::Bool(true) => f.write_str(&self.name),
            value => write!(f, "{}={value}", self.name),
        }
    }
}

/// The first line of a text that is a directive of naga_oil's preprocessor, as its bytes and its word:
/// `import`, `ifdef`.
pub(super) fn directive(text: &str) -> Option<(std::ops::Range<usize>, &str)> {
    let words = [
        "import",
        "define_import_path",
        "define",
        "ifdef",
        "ifndef",
        "if",
        "else",
        "endif",
    ];
    let mut offset = 0;
    for line in text.split_inclusive('\n') {
        let start = offset + line.len() - line.trim_start().len();
        offset += line.len();
        let line = line.trim();
        let Some(rest) = line.strip_prefix('#') else {
            continue;
        };
        let word = rest.split_whitespace().next().unwrap_or("");
        if words.contains(&word) {
            return Some((start..start + line.len(), word));
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn definitions_read_as_they_print() {
        for (text, value) in [
            ("A", Value::Bool(true)),
            ("A=false", Value::Bool(false)),
            ("A=8", Value::Uint(8)),
            ("A=4294967295", Value::Uint(u32::MAX)),
            ("A=-2", Value::Int(-2)),
            ("A=2i", Value::Int(2)),
        ] {
            let definition = Definition::of_text(text).unwrap();
            assert_eq!(definition.value, value, "{text}");
            assert_eq!(definition.to_string(), text);
        }
        assert_eq!(Definition::of_text("A=8u").unwrap().value, Value::Uint(8));
        for wrong in [
            "",
            "=1",
            "A B",
            "A=",
            "A=x",
            "A=1.5",
            "A=99999999999",
            "A=8 ",
        ] {
            assert!(Definition::of_text(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn only_known_directives_count() {
        let word = |text| directive(text).map(|(_, word)| word);
        assert_eq!(word("fn f() {}\n  # ifdef X\n"), Some("ifdef"));
        assert_eq!(word("#import a::b\n"), Some("import"));
        assert_eq!(word("#version 450\n"), None);
        assert_eq!(word("// #import a\n"), None);
        let text = "let a;\r\n  #if X == 1 \r\n";
        assert_eq!(&text[directive(text).unwrap().0], "#if X == 1");
    }
}
