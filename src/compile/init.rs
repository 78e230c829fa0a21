//! Writing a scene file for a shader: where it goes, and what it may not overwrite.

use super::{Files, Request, relative};
use crate::front::{Modules, Source, Stages, Value};
use crate::scene::init::{Initial, initial};
use crate::scene::objects::Object;
use crate::{Diagnostic, Result};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What a scene is written for, and where.
#[derive(Clone, Debug, Default)]
pub struct InitRequest {
    /// The material shader.
    pub shader: PathBuf,
    /// The entry points, where there are several.
    pub stages: Stages,
    /// Where imported modules are found, and the shader defs.
    pub modules: Modules,
    /// The model's file, or the name of a built-in object.
    pub mesh: Option<PathBuf>,
    /// The scene to write; by default the shader's name with `.toml`, which lodc reads by itself.
    pub output: Option<PathBuf>,
    /// Whether a file that is there already may be written over.
    pub force: bool,
}

impl InitRequest {
    /// The path of the scene.
    pub fn scene(&self) -> PathBuf {
        let beside = || self.shader.with_extension("toml");
        self.output.clone().unwrap_or_else(beside)
    }

    /// The tables of the scene that say how the shader is read, where the request does.
    fn reading(&self, folder: &Path) -> String {
        let quoted = |text: String| toml::Value::String(text).to_string();
        let path = |file: &PathBuf| quoted(relative(folder, file));
        let mut text = String::new();
        if let Some(file) = &self.stages.vertex_file {
            text += &format!("\n[shader]\nvertex = {}\n", path(file));
        }
        if !self.modules.folders.is_empty() {
            let folders: Vec<String> = self.modules.folders.iter().map(path).collect();
            text += &format!("\n[modules]\nfolders = [{}]\n", folders.join(", "));
        }
        // Of one name the last counts.
        let definitions = self.modules.definitions.iter();
        let definitions: BTreeMap<&str, Value> =
            definitions.map(|d| (d.name.as_str(), d.value)).collect();
        if !definitions.is_empty() {
            text += "\n[modules.definitions]\n";
        }
        for (name, value) in definitions {
            let value = match value {
                Value::Int(_) => quoted(value.to_string()),
                _ => value.to_string(),
            };
            text += &format!("{} = {value}\n", quoted(name.to_owned()));
        }
        text
    }
}

/// Makes a scene file for a shader.
///
/// # Errors
/// When the shader or the model cannot be read, and when the scene is there already.
pub fn init(request: &InitRequest) -> Result<(Files, Initial)> {
    let path = request.scene();
    if !request.force && path.symlink_metadata().is_ok() {
        return Err(
            Diagnostic::error(format!("`{}` is there already", path.display()))
                .with_note("give another name with `-o`, or `--force` to write over it"),
        );
    }
    let source = Source::read_with(&request.shader, &request.stages, &request.modules)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let object = request.mesh.as_ref().map(|mesh| {
        let named = mesh.to_str().filter(|name| {
            let mut all = Object::ALL.iter();
            all.any(|(known, _)| known == name)
        });
        named.map_or_else(|| relative(folder, mesh), str::to_owned)
    });
    let reading = request.reading(folder);
    let made = initial(&source, &path, object.as_deref(), &reading)?;
    let files = vec![(path, made.text.clone().into_bytes())];
    let mut inputs = vec![request.shader.clone()];
    inputs.extend(request.mesh.clone());
    inputs.extend(request.stages.vertex_file.clone());
    Request::default().spare(&files, &inputs)?;
    Ok((files, made))
}
