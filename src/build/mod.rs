//! Building from a lock, for `build.rs` and for programs: no search, no GPU, milliseconds.
//!
//! ```text
//! shader + lock --replay--> levels --emit--> shader, textures, meshes
//!                                  --module--> <stem>.rs, for include!
//!                                  --cargo--> rerun-if-changed, warnings
//! ```

mod bindings;
mod cargo;
#[cfg(test)]
#[allow(unreachable_pub, reason = "it is public where it is written into")]
mod host;
mod module;
#[cfg(test)]
mod tests;

use crate::compile::{self, Replayed, Request};
use crate::emit::{self, Emitted, Form, Lock, Output, Target};
use crate::front::Definition;
use crate::{Diagnostic, Result, front};
use std::path::{Path, PathBuf};

/// What is done when the lock is missing, or no longer fits its shader.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Stale {
    /// The build fails, and says what renews the lock.
    #[default]
    Error,
    /// The original is used at every distance, with a warning.
    Original,
    /// Levels are searched, with a warning, and kept beside what is written until the shader changes again. The lock in
    /// the source tree stays what it is.
    #[cfg(feature = "search")]
    Search,
}

/// Builds one material from its lock.
///
/// ```no_run
/// // build.rs
/// fn main() -> lodc::Result<()> {
///     lodc::Compiler::new("shaders/material.wgsl").build()?;
///     Ok(())
/// }
/// ```
///
/// and in the program
///
/// ```ignore
/// mod material {
///     include!(concat!(env!("OUT_DIR"), "/material.rs"));
/// }
/// ```
#[derive(Clone, Debug)]
pub struct Compiler {
    request: Request,
    output: Option<PathBuf>,
    stale: Stale,
    bytemuck: bool,
    watches_scene: bool,
}

/// What was written.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Built {
    /// The Rust module.
    pub module: PathBuf,
    /// The shader: one file, or several where the form or the language has it so.
    pub shaders: Vec<PathBuf>,
    /// Textures and meshes that were made for levels.
    pub assets: Vec<PathBuf>,
    /// The files that were read, and whose change changes any of these.
    pub read: Vec<PathBuf>,
    /// Whether the levels of the lock could not be had, and the original stands in for them.
    pub is_original: bool,
    /// What is worth saying.
    pub warnings: Vec<Box<Diagnostic>>,
}

impl Built {
    /// What a build script prints for cargo; [`Compiler::build`] has printed it where cargo listens.
    pub fn directives(&self) -> String {
        cargo::directives(&self.read, &self.warnings)
    }
}

impl Compiler {
    /// A material shader whose lock lies beside it, `shaders/material.lod.toml` beside `shaders/material.wgsl`. Relative
    /// paths are from the current folder, which is that of the package in a build script.
    pub fn new(shader: impl Into<PathBuf>) -> Self {
        Self {
            request: Request {
                shader: shader.into(),
                ..Request::default()
            },
            output: None,
            stale: Stale::default(),
            bytemuck: false,
            watches_scene: false,
        }
    }

    /// The lock, where it is not beside the shader. What is written is called as the lock is.
    #[must_use]
    pub fn lock(mut self, file: impl Into<PathBuf>) -> Self {
        let file = file.into();
        self.request.lock = Some(file.clone());
        self.request.output = Some(file);
        self
    }

    /// The folder that all files go to, `OUT_DIR` without this. A relative one is in `OUT_DIR`, where that is set.
    #[must_use]
    pub fn output(mut self, folder: impl Into<PathBuf>) -> Self {
        self.output = Some(folder.into());
        self
    }

    /// What is done when the lock is missing or stale.
    #[must_use]
    pub fn stale(mut self, stale: Stale) -> Self {
        self.stale = stale;
        self
    }

    /// Whether the structures of buffers are declared `Pod` and `Zeroable` to the crate `bytemuck`, which the program then
    /// depends on.
    #[must_use]
    pub fn bytemuck(mut self, yes: bool) -> Self {
        self.bytemuck = yes;
        self
    }

    /// Whether a changed scene runs the build script again, which then warns of it.
    #[must_use]
    pub fn watch_scene(mut self, yes: bool) -> Self {
        self.watches_scene = yes;
        self
    }

    /// How a level is chosen, where it is not to be as the lock says.
    #[must_use]
    pub fn form(mut self, form: Form) -> Self {
        self.request.form = Some(form);
        self
    }

    /// The language that is written, where it is not to be the lock's.
    #[must_use]
    pub fn target(mut self, target: Target) -> Self {
        self.request.target = Some(target);
        self
    }

    /// The file of the vertex stage, where it is not as the lock says.
    #[must_use]
    pub fn vertex_file(mut self, file: impl Into<PathBuf>) -> Self {
        self.request.stages.vertex_file = Some(file.into());
        self
    }

    /// A folder of modules that the shader imports, where they are not as the lock says.
    #[must_use]
    pub fn include(mut self, folder: impl Into<PathBuf>) -> Self {
        self.request.modules.folders.push(folder.into());
        self
    }

    /// A shader def, where they are not as the lock says.
    #[must_use]
    pub fn define(mut self, definition: Definition) -> Self {
        self.request.modules.definitions.push(definition);
        self
    }

    /// Writes shader, module, textures and meshes, and tells cargo what they are made from, where cargo listens.
    ///
    /// # Errors
    /// When there is no folder to write to; when the shader or the lock cannot be read; when the lock is missing or stale
    /// and that is an error; when a texture or a mesh is not what it was.
    pub fn build(&self) -> Result<Built> {
        let folder = self.folder()?;
        let (built, files) = self.made(&folder)?;
        emit::write_atomically(&files)?;
        if cargo::listens() {
            print!("{}", built.directives());
        }
        Ok(built)
    }

    /// Where files go.
    fn folder(&self) -> Result<PathBuf> {
        match (cargo::out_dir(), &self.output) {
            (Some(out), Some(folder)) => Ok(out.join(folder)),
            (Some(out), None) => Ok(out),
            (None, Some(folder)) => Ok(folder.clone()),
            (None, None) => Err(Diagnostic::error(
                "there is no folder to write to: `OUT_DIR` is not set",
            )
            .with_note("build in a build script, or name a folder with `output`")),
        }
    }

    /// What is written, with its contents.
    fn made(&self, folder: &Path) -> Result<(Built, emit::Files)> {
        let mut warnings = Vec::new();
        let (request, mut replayed, read) = self.replayed(folder, &mut warnings)?;
        let levels = match replayed.levels.as_mut() {
            Ok((levels, more)) => {
                warnings.append(more);
                std::mem::take(levels)
            }
            Err(why) if self.stale == Stale::Original => {
                let instead = instead(why, "the original is used at every distance");
                warnings.push(instead);
                Vec::new()
            }
            Err(why) => return Err(why.clone()),
        };
        let Replayed {
            lock,
            source,
            base,
            levels: replay,
        } = &replayed;
        let is_original = replay.is_err();
        let locked = lock.as_ref().filter(|_| !is_original);
        let output = request.emission(lock.as_ref().map_or_else(Output::default, |l| l.output));
        let stem = request.stem();
        let emitted = emit::emitted(source, base, &levels, output, &stem)?;
        let textures = emit::generated_textures(source, &levels, output.form)?;

        let mut built = Built {
            module: folder.join(format!("{stem}.rs")),
            shaders: Vec::new(),
            assets: Vec::new(),
            read,
            is_original,
            warnings,
        };
        let mut files = emit::Files::new();
        let made_for_levels = format!("{stem}.lod");
        let asset = |name: &str| folder.join(&made_for_levels).join(name);
        let mut meshes = None;
        if let Some(lock) = locked {
            for made in compile::textures::committed(&request, lock, &textures)? {
                files.push((asset(&made.locked.file), made.bytes));
            }
            if let Some((name, bytes)) = committed_meshes(&request, lock)? {
                files.push((asset(&name), bytes));
                meshes = Some(format!("{made_for_levels}/{name}"));
            }
        }
        built
            .assets
            .extend(files.iter().map(|(file, _)| file.clone()));
        let text = module::written(&module::Of {
            source,
            base,
            lock: locked,
            levels: &levels,
            emitted: &emitted,
            textures: &textures,
            folder: &made_for_levels,
            meshes: meshes.as_deref(),
            form: output.form,
            target: output.target,
            bytemuck: self.bytemuck,
        })?;
        files.push((built.module.clone(), text.into_bytes()));
        let Emitted { files: shaders, .. } = emitted;
        for (name, bytes) in shaders {
            // The module has the parameter stage.
            if name.extension().is_none_or(|extension| extension != "rs") {
                built.shaders.push(folder.join(&name));
                files.push((folder.join(name), bytes));
            }
        }
        request.spare(&files, &built.read)?;
        Ok((built, files))
    }

    /// The lock replayed, or another one that a search has made, and the files that decided it.
    #[allow(
        unused_variables,
        unused_mut,
        reason = "without a search there is no other one"
    )]
    #[allow(clippy::vec_box, reason = "as diagnostics are handed around")]
    fn replayed(
        &self,
        folder: &Path,
        warnings: &mut Vec<Box<Diagnostic>>,
    ) -> Result<(Request, Replayed, Vec<PathBuf>)> {
        let request = self.request.clone();
        let replayed = compile::replay(&request)?;
        let mut read = self.read(&request, &replayed);
        #[cfg(feature = "search")]
        if let (Err(why), Stale::Search) = (&replayed.levels, self.stale) {
            warnings.push(instead(why, "levels are searched in the meantime"));
            let request = self.searched(folder)?;
            let replayed = compile::replay(&request)?;
            read.extend(self.read(&request, &replayed));
            // What it wrote itself is no reason to run again.
            read.retain(|file| !file.starts_with(folder));
            return Ok((request, replayed, read));
        }
        Ok((request, replayed, read))
    }

    /// The files whose change changes the result.
    fn read(&self, request: &Request, replayed: &Replayed) -> Vec<PathBuf> {
        let path = request.committed_lock();
        let folder = path.parent().unwrap_or(Path::new(""));
        let source = &replayed.source;
        let mut read = vec![request.shader.clone()];
        read.extend(source.others.iter().filter_map(|other| other.path.clone()));
        read.push(path.clone());
        if let Some(lock) = &replayed.lock {
            read.extend(
                lock.textures
                    .iter()
                    .map(|texture| folder.join(&texture.file)),
            );
            let generated = lock.generated.iter();
            read.extend(generated.map(|texture| request.generated(&texture.file)));
            read.extend(lock.meshes.iter().map(|meshes| folder.join(&meshes.file)));
            let scene = lock.scene.iter().chain(&lock.lighting);
            let scene = scene.filter(|_| self.watches_scene);
            read.extend(scene.map(|scene| folder.join(&scene.file)));
        }
        read.dedup();
        read
    }

    /// Searches levels into a folder, unless that was done before, and returns what reads them from there.
    #[cfg(feature = "search")]
    fn searched(&self, folder: &Path) -> Result<Request> {
        let stem = self.request.stem();
        let request = Request {
            output: Some(folder.join(format!("{stem}.lod.wgsl"))),
            lock: Some(folder.join(format!("{stem}.lod.toml"))),
            ..self.request.clone()
        };
        let is_there = request.lock().exists() && compile::replay(&request)?.levels.is_ok();
        if !is_there {
            let compiled = compile::compile(&request, &|_| {})?;
            emit::write_atomically(&compiled.files)?;
        }
        Ok(request)
    }
}

/// Warns of what is done in the place of an error.
fn instead(why: &Diagnostic, what: &str) -> Box<Diagnostic> {
    let warning = Diagnostic::warning(format!("{}: {what}", why.message));
    let notes = why.notes.iter().cloned();
    notes.fold(warning, Diagnostic::with_note)
}

/// The file of the meshes of a lock, which has to be what it was: its name, and its contents.
fn committed_meshes(request: &Request, lock: &Lock) -> Result<Option<(String, Vec<u8>)>> {
    let Some(meshes) = &lock.meshes else {
        return Ok(None);
    };
    let path = request.committed_lock();
    let file = path.parent().unwrap_or(Path::new("")).join(&meshes.file);
    let shown = file.display();
    let bytes = std::fs::read(&file).map_err(|error| {
        Diagnostic::error(format!("cannot read `{shown}`: {error}")).with_note(
            "it was made for levels, and is committed with the lock: run lodc on the shader to make it again",
        )
    })?;
    if front::hash(&bytes) != meshes.hash {
        return Err(Diagnostic::error(format!(
            "the lock is stale: the file of meshes `{shown}` is not what it was"
        ))
        .with_note("renew it: run lodc without `--locked`, and commit what it writes"));
    }
    let name = file.file_name().unwrap_or_default();
    Ok(Some((name.to_string_lossy().into_owned(), bytes)))
}
