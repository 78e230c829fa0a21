//! What a scene file says of how its shader is read: `[shader]` and `[modules]`.
//!
//! It is asked for before there is a shader that the rest of the file could be held against.

use super::file::{Node, Toml};
use crate::Result;
use crate::front::{Definition, Modules, Value, read_text};
use std::path::{Path, PathBuf};
use toml::Spanned;

/// What a scene file says of how its shader is read. Paths are those of the file, led through its folder.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Reading {
    /// The file of the vertex stage.
    pub vertex_file: Option<PathBuf>,
    /// The module folders and shader defs.
    pub modules: Modules,
}

impl Reading {
    /// Reads `[shader]` and `[modules]` of a scene file.
    ///
    /// # Errors
    /// When the file cannot be read, is no scene, or a shader def has no value that one can have.
    pub fn read(path: &Path) -> Result<Self> {
        let text = read_text(path, "scene")?;
        let name = path.display().to_string();
        let toml = Toml {
            name: &name,
            text: &text,
        };
        let file = toml.parse()?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let definitions = file.modules.definitions.0.iter();
        Ok(Self {
            vertex_file: file.shader.vertex.map(|file| folder.join(file.get_ref())),
            modules: Modules {
                folders: file
                    .modules
                    .folders
                    .iter()
                    .map(|f| folder.join(f))
                    .collect(),
                definitions: definitions
                    .map(|(name, value)| definition(toml, name, value))
                    .collect::<Result<_>>()?,
            },
        })
    }
}

fn definition(toml: Toml<'_>, name: &Spanned<String>, value: &Spanned<Node>) -> Result<Definition> {
    let read = match value.get_ref() {
        Node::Bool(value) => Some(Value::Bool(*value)),
        Node::Integer(value) => match u32::try_from(*value) {
            Ok(value) => Some(Value::Uint(value)),
            Err(_) => i32::try_from(*value).ok().map(Value::Int),
        },
        Node::Text(text) => Value::of_text(text),
        _ => None,
    };
    match read {
        Some(value) => Ok(Definition {
            name: name.get_ref().clone(),
            value,
        }),
        None => Err(toml
            .error(
                format!("the shader def `{}` cannot have this value", name.get_ref()),
                value.span(),
                value.get_ref().what(),
            )
            .with_note("a value is true, false, or a whole number of 32 bits")),
    }
}
