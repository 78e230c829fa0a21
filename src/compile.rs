//! The main job: a material shader in; a shader with its levels, their lock and their report out.
//!
//! Nothing here touches the disk but to read; what is to be written comes back as names and contents, for
//! [`crate::emit::write_atomically`].

#[cfg(feature = "search")]
mod calibrate;
#[cfg(feature = "testing")]
mod check;
#[cfg(feature = "search")]
mod clock;
#[cfg(feature = "search")]
mod compare;
#[cfg(feature = "search")]
mod difference;
#[cfg(feature = "search")]
mod directives;
#[cfg(feature = "search")]
mod init;
#[cfg(feature = "mesh")]
mod joint;
#[cfg(feature = "search")]
mod kept;
#[cfg(feature = "mesh")]
mod mesh;
#[cfg(feature = "search")]
mod model_file;
#[cfg(feature = "search")]
mod search;
#[cfg(feature = "mesh")]
mod seen_mesh;
mod snapshot;
#[cfg(feature = "search")]
mod stability;
#[cfg(feature = "mesh")]
mod table2;
pub(crate) mod textures;
#[cfg(feature = "search")]
mod transition;

pub use crate::emit::Files;
#[cfg(feature = "search")]
pub use calibrate::{CalibrateRequest, Calibrated, Calibrating, calibrate};
#[cfg(feature = "testing")]
pub use check::{Check, Difference, check, locks};
#[cfg(feature = "search")]
pub use clock::Timings;
#[cfg(feature = "search")]
pub use compare::{CompareRequest, Compared, DrawnBy, compare};
#[cfg(feature = "search")]
pub use difference::difference;
#[cfg(feature = "search")]
pub use init::{InitRequest, init};
#[cfg(feature = "mesh")]
pub use mesh::{
    Length, MeshError, MeshGoals, MeshLevel, MeshRequest, SimplifiedMesh, Simplifying, mesh,
    mesh_error,
};
#[cfg(feature = "search")]
pub use model_file::ModelFile;
#[cfg(feature = "search")]
pub use search::{Compiled, compile, inspect, trajectory};
#[cfg(feature = "mesh")]
pub use seen_mesh::{
    PictureGoals, PictureLevel, PictureRequest, Seeing, SeenMesh, mesh_by_pictures,
};
pub use snapshot::{Needed, ResourceKind, Snapshot, SnapshotRequest, snapshot};
#[cfg(feature = "search")]
pub use stability::{Stability, StabilityRequest, stability};
#[cfg(feature = "mesh")]
pub use table2::{Row, Table2, table2};

use crate::emit::{self, EmitLevel, Form, Lock, Output, Target, Transition};
use crate::front::{self, Modules, Source, Stages};
use crate::{Diagnostic, Result};
use lodc_passes::autolod::BoundReading;
use lodc_passes::{Goal, Passes, Shader, normalize};
use std::path::{Path, PathBuf};

/// How many expressions the normal form of an entry point may have, so that inlining cannot blow up.
/// The largest shader that was seen has 15,537.
pub const EXPRESSION_LIMIT: usize = 100_000;

/// How the name of a lock ends.
const LOCK_ENDING: &str = ".lod.toml";

/// How levels are searched.
#[cfg(feature = "mesh")]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[non_exhaustive]
pub enum Strategy {
    /// Shaders alone, on the scene's mesh.
    #[default]
    Greedy,
    /// Meshes with shaders: both by themselves, then pairs of them along the boundary of what is within the bound.
    Separate,
    /// The same, and of each distance all pairs.
    Exhaustive,
    /// The same, and for shaders of the frontiers meshes of their own.
    Interleaved,
}

#[cfg(feature = "mesh")]
impl Strategy {
    /// Its name on the command line and in the report.
    pub fn name(self) -> &'static str {
        match self {
            Self::Greedy => "greedy",
            Self::Separate => "separate",
            Self::Exhaustive => "exhaustive",
            Self::Interleaved => "interleaved",
        }
    }
}

/// Where run times come from.
#[cfg(feature = "search")]
#[derive(Clone, Debug, Default)]
pub enum RunTime {
    /// From the cost model: shares of the original's.
    #[default]
    Estimated,
    /// From a device.
    Measured(Measuring),
    /// From recordings of devices, which stand in for them.
    Recorded(Recorded),
}

/// How variants are timed on a device.
#[cfg(feature = "search")]
#[derive(Clone, Debug, Default)]
pub struct Measuring {
    /// The file of lodc, which draws in a process of its own.
    pub program: PathBuf,
    /// A part of the adapter's name; the best one by default.
    pub adapter: Option<String>,
    /// The folder in which timings are kept from run to run.
    pub cache: Option<PathBuf>,
    /// The file that a recording of all timings goes to.
    pub record: Option<PathBuf>,
    /// How much time a timing may take, and how exact it is to be.
    pub effort: crate::time::Effort,
}

/// Recordings, one for each adapter.
#[cfg(feature = "search")]
#[derive(Clone, Debug, Default)]
pub struct Recorded {
    /// Their files, as `--record` writes them.
    pub files: Vec<PathBuf>,
}

/// What is compiled, and where it goes.
#[derive(Clone, Debug, Default)]
pub struct Request {
    /// The material shader.
    pub shader: PathBuf,
    /// The scene; by default the shader's name with `.toml`, when that is there.
    pub scene: Option<PathBuf>,
    /// How errors are held against the bound; by default as the scene says.
    pub bound: Option<BoundReading>,
    /// What levels are to use less of; by default as the scene says.
    pub goal: Option<Goal>,
    /// The names of the passes that a level may cost error by; all when there are none.
    pub only: Vec<String>,
    /// The passes that a search tries and that a lock may name: by default lodc's own.
    pub passes: Passes,
    /// Whether the host fills the parameter block, beside what the scene says.
    pub parameters: bool,
    /// Whether the host binds textures that are made for levels, beside what the scene says.
    pub textures: bool,
    /// How many MiB those of a level may have together; by default as the scene says, which is without a limit by default.
    pub max_texture_memory: Option<u32>,
    /// The shader to write; by default `<stem>.lod.wgsl` beside the source.
    pub output: Option<PathBuf>,
    /// The folder that outputs go to under their own names, where no output is named; by default that of the source.
    pub folder: Option<PathBuf>,
    /// The lock to replay; by default beside the outputs, and, where there is none, beside the source.
    pub lock: Option<PathBuf>,
    /// The entry points, where there are several.
    pub stages: Stages,
    /// The modules that may be imported.
    pub modules: Modules,
    /// The form to write; by default that of the lock when it is replayed, else [`Form::Override`].
    pub form: Option<Form>,
    /// The language to write; by default that of the lock when it is replayed, else [`Target::Wgsl`].
    pub target: Option<Target>,
    /// What is drawn where a level begins; by default that of the lock when it is replayed, else [`Transition::Pop`].
    pub transition: Option<Transition>,
    /// How wide the band behind a threshold is, in halvings of scale; by default that of the lock when it is replayed, else
    /// [`emit::BAND`].
    pub band: Option<f32>,
    /// Whether each pixel chooses its level, by its texture coordinates.
    pub per_pixel: bool,
    /// How levels are searched.
    #[cfg(feature = "mesh")]
    pub search: Strategy,
    /// Of a joint search, how many meshes there are to choose from at most, with the original; by default 16.
    #[cfg(feature = "mesh")]
    pub meshes: Option<usize>,
    /// The same of shaders; by default 24.
    #[cfg(feature = "mesh")]
    pub shaders: Option<usize>,
    /// From how many sides meshes are seen while they are simplified, at least; by default as
    /// [`crate::mesh::Settings::views`] has it.
    #[cfg(feature = "mesh")]
    pub mesh_views: Option<usize>,
    /// Which shaders are made exact first.
    #[cfg(feature = "search")]
    pub exact: crate::search::Scope,
    /// Where run times come from.
    #[cfg(feature = "search")]
    pub time: RunTime,
    /// The calibration whose model ranks variants before they are timed; by default the estimate does.
    #[cfg(feature = "search")]
    pub model: Option<PathBuf>,
    /// What is never folded, simplified or left out: uniforms, textures, values, functions.
    pub keep: Vec<String>,
    /// Whether levels may fail on inputs that no picture shows and on which the original holds.
    pub unstable: bool,
    /// Whether the search begins with what still applies of the recipes of the lock that is there.
    pub update: bool,
    /// The command that reproduces the result, for the report.
    pub command: String,
}

impl Request {
    /// The name that all outputs begin with, `folder/rock` for `folder/rock.lod.wgsl`.
    fn base(&self) -> PathBuf {
        match &self.output {
            None => {
                let bare = self.shader.with_extension("");
                match (&self.folder, bare.file_name()) {
                    (Some(folder), Some(name)) => folder.join(name),
                    _ => bare,
                }
            }
            Some(output) => {
                let bare = output.with_extension("");
                if bare.extension().is_some_and(|extension| extension == "lod") {
                    bare.with_extension("")
                } else {
                    bare
                }
            }
        }
    }

    /// The same without its folder.
    pub(crate) fn stem(&self) -> String {
        let base = self.base();
        let name = base.file_name().unwrap_or_default();
        name.to_string_lossy().into_owned()
    }

    /// The path of an output with this ending, such as `lod.toml`.
    fn beside(&self, ending: &str) -> PathBuf {
        let mut name = self.base().into_os_string();
        name.push(".");
        name.push(ending);
        name.into()
    }

    /// The path of the lock that a search writes.
    pub fn lock(&self) -> PathBuf {
        self.beside("lod.toml")
    }

    /// The path of the lock that is replayed.
    pub fn committed_lock(&self) -> PathBuf {
        if let Some(lock) = &self.lock {
            return lock.clone();
        }
        let beside_source = self.shader.with_extension("lod.toml");
        let lock = self.lock();
        match !lock.exists() && beside_source.exists() {
            true => beside_source,
            false => lock,
        }
    }

    /// What is written: what was asked for, else what `otherwise` says.
    pub(crate) fn emission(&self, otherwise: Output) -> Output {
        let transition = self.transition.unwrap_or(otherwise.transition);
        // A band wants a value that changes from draw to draw.
        let form = match transition {
            Transition::Pop => otherwise.form,
            _ if otherwise.per_pixel.is_some() => otherwise.form,
            Transition::Blend | Transition::Dither => Form::Uniform,
        };
        Output {
            form: self.form.unwrap_or(form),
            target: self.target.unwrap_or(otherwise.target),
            transition,
            band: self.band.unwrap_or(otherwise.band),
            per_pixel: otherwise.per_pixel,
        }
    }

    /// Emits under the name that all outputs begin with, and puts the files in their place.
    #[cfg(feature = "search")]
    fn emitted(
        &self,
        (source, shader): (&Source, &Shader),
        levels: &[EmitLevel],
        emission: Output,
    ) -> Result<Files> {
        let stem = self.stem();
        let files = emit::emit_as(source, shader, levels, emission, &stem)?;
        Ok(self.placed(files, &stem))
    }

    /// Emits what a lock makes, which the text names.
    fn emitted_again(&self, read: &Relocked, emission: Output) -> Result<Files> {
        let lock = self.committed_lock();
        let lock = lock.file_name().unwrap_or_default().to_string_lossy();
        let stem = lock.strip_suffix(LOCK_ENDING);
        let stem = stem.map_or_else(|| self.stem(), str::to_owned);
        let files = emit::emit_as(&read.source, &read.base, &read.levels, emission, &stem)?;
        Ok(self.placed(files, &stem))
    }

    /// Puts files whose names begin with `stem` in their place. A single shader gets the very name that was asked for.
    fn placed(&self, files: Files, stem: &str) -> Files {
        let is_shader = |name: &Path| name.extension().is_none_or(|extension| extension != "rs");
        let shaders = files.iter().filter(|(name, _)| is_shader(name));
        let single = shaders.count() == 1;
        let placed = files.into_iter().map(|(name, contents)| {
            let is_single = single && is_shader(&name);
            let name = name.to_string_lossy();
            let ending = name.strip_prefix(stem).unwrap_or(&name);
            let place = match &self.output {
                Some(output) if is_single => output.clone(),
                _ => self.beside(ending.trim_start_matches('.')),
            };
            (place, contents)
        });
        placed.collect()
    }

    /// Refuses to write over what was read.
    pub(crate) fn spare(&self, files: &Files, inputs: &[PathBuf]) -> Result<()> {
        for (file, _) in files {
            let Ok(place) = file.canonicalize() else {
                continue;
            };
            if let Some(input) = inputs
                .iter()
                .find(|input| input.canonicalize().ok().as_ref() == Some(&place))
            {
                return Err(Diagnostic::error(format!(
                    "the output `{}` would overwrite the input `{}`",
                    file.display(),
                    input.display()
                ))
                .with_note("give another name with `-o`"));
            }
        }
        Ok(())
    }
}

/// The source's normal form.
///
/// # Errors
/// At its place, when inlining makes it larger than [`EXPRESSION_LIMIT`].
pub fn normal_form(source: &Source) -> Result<Shader> {
    normalize::normalize(
        &source.module,
        source.vertex.as_deref(),
        &source.fragment,
        EXPRESSION_LIMIT,
    )
    .map_err(|error| {
        let too_large = error.message.contains("grows beyond");
        let located = source.error(error.message, error.span, "here");
        match too_large {
            true => located.with_note(
                "calls are copied into their callers: call it in fewer places, or in a loop",
            ),
            false => located,
        }
    })
}

/// What a lock makes.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Remade {
    /// The files.
    pub files: Files,
    /// Every file that decides what they are: the sources with all that they import, the lock, and the textures whose texels went
    /// into it.
    pub inputs: Vec<PathBuf>,
    /// What is worth saying: a scene that has changed since.
    pub warnings: Vec<Box<Diagnostic>>,
}

/// Emits from the lock, without a search: what `--locked` and a build script do.
///
/// # Errors
/// When the source or the lock cannot be read, or the lock is stale.
pub fn remade(request: &Request) -> Result<Remade> {
    let read = read_lock(request)?;
    let emission = request.emission(read.lock.output);
    let mut files = request.emitted_again(&read, emission)?;
    let textures = emit::generated_textures(&read.source, &read.levels, emission.form)?;
    files.extend(request.texture_files(textures::again(request, &read, &textures)?));
    request.spare(&files, std::slice::from_ref(&request.shader))?;
    let inputs = read.inputs(request, !textures.is_empty());
    Ok(Remade {
        files,
        inputs,
        warnings: read.warnings,
    })
}

/// As [`remade`], but for the inputs.
///
/// # Errors
/// As [`remade`].
pub fn locked(request: &Request) -> Result<(Files, Vec<Box<Diagnostic>>)> {
    let made = remade(request)?;
    Ok((made.files, made.warnings))
}

/// A lock with what it was made from, and its levels made again.
struct Relocked {
    lock: Lock,
    source: Source,
    /// Its normal form.
    base: Shader,
    levels: Vec<EmitLevel>,
    /// What has changed since, and does not matter for what is written.
    #[allow(clippy::vec_box, reason = "as diagnostics are handed around")]
    warnings: Vec<Box<Diagnostic>>,
}

/// A shader, and what became of its lock.
pub(crate) struct Replayed {
    /// The lock, when there is one.
    pub(crate) lock: Option<Lock>,
    pub(crate) source: Source,
    /// Its normal form.
    pub(crate) base: Shader,
    /// The levels made again, with what is worth saying; or why they cannot be: the lock is missing or stale.
    #[allow(clippy::vec_box, reason = "as diagnostics are handed around")]
    pub(crate) levels: Result<(Vec<EmitLevel>, Vec<Box<Diagnostic>>)>,
}

impl Relocked {
    /// The files that decide what is emitted; with the scene where textures are made again.
    fn inputs(&self, request: &Request, bakes: bool) -> Vec<PathBuf> {
        let lock = request.committed_lock();
        let beside = |file: &String| lock.with_file_name(file);
        let others = self.source.others.iter();
        let textures = self.lock.textures.iter();
        let mut inputs = vec![request.shader.clone()];
        inputs.extend(others.filter_map(|other| other.path.clone()));
        inputs.push(lock.clone());
        inputs.extend(textures.map(|texture| beside(&texture.file)));
        if bakes {
            let locked = self.lock.scene.as_ref().map(|scene| beside(&scene.file));
            inputs.extend(request.scene.clone().or(locked));
        }
        let mut known = std::collections::BTreeSet::new();
        inputs.retain(|input| known.insert(input.clone()));
        inputs
    }
}

/// Reads the lock of a request and replays it.
fn read_lock(request: &Request) -> Result<Relocked> {
    // Without a lock the shader does not matter.
    if !request.committed_lock().exists() {
        return Err(Lock::missing(&request.committed_lock()));
    }
    let Replayed {
        lock,
        source,
        base,
        levels,
    } = replay(request)?;
    let (levels, warnings) = levels?;
    let lock = lock.ok_or_else(|| Lock::missing(&request.committed_lock()))?;
    Ok(Relocked {
        lock,
        source,
        base,
        levels,
        warnings,
    })
}

/// Reads a shader as its lock says, and replays that.
///
/// # Errors
/// When the shader or the lock cannot be read. That the lock is missing or stale is none.
pub(crate) fn replay(request: &Request) -> Result<Replayed> {
    let path = request.committed_lock();
    let read = match path.exists() {
        true => Some(Lock::read(&path)?),
        false => None,
    };
    let folder = path.parent().unwrap_or(Path::new(""));
    let locked = read.as_ref().map(|(lock, _)| lock);
    let source = read_source(request, locked, folder)?;
    let base = normal_form(&source)?.with_passes(request.passes.clone());
    let levels = match &read {
        None => Err(Lock::missing(&path)),
        Some((lock, text)) => {
            let levels = lock.replay(&base, &path.display().to_string(), text);
            levels.and_then(|levels| Ok((levels, since(lock, folder)?)))
        }
    };
    Ok(Replayed {
        lock: read.map(|(lock, _)| lock),
        source,
        base,
        levels,
    })
}

/// Reads a shader as it was asked for, else as its lock says. `folder` is the lock's.
fn read_source(request: &Request, lock: Option<&Lock>, folder: &Path) -> Result<Source> {
    let of_lock = lock.map(|lock| (&lock.source, &lock.modules));
    let mut stages = request.stages.clone();
    if let Some((source, _)) = of_lock {
        stages.vertex = stages.vertex.or_else(|| source.vertex.clone());
        stages.fragment = stages.fragment.or_else(|| Some(source.fragment.clone()));
        let vertex_file = source.vertex_file.as_ref().map(|file| folder.join(file));
        stages.vertex_file = stages.vertex_file.or(vertex_file);
    }
    let modules = match of_lock {
        Some((_, modules)) if request.modules == Modules::default() => Modules {
            folders: modules.folders.iter().map(|f| folder.join(f)).collect(),
            definitions: modules.definitions.clone(),
        },
        _ => request.modules.clone(),
    };
    Source::read_with(&request.shader, &stages, &modules)
}

/// Whether a file that a lock names is gone, or no longer what it was.
fn has_changed(folder: &Path, file: &str, hash: &str) -> bool {
    let Ok(bytes) = std::fs::read(folder.join(file)) else {
        return true;
    };
    // A byte order mark is no part of a text that was read.
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes);
    front::hash(text) != hash
}

/// What has changed since a lock was made and does not matter for what is written.
///
/// # Errors
/// When a texture has changed that does.
#[allow(clippy::vec_box, reason = "as diagnostics are handed around")]
fn since(lock: &Lock, folder: &Path) -> Result<Vec<Box<Diagnostic>>> {
    for texture in &lock.textures {
        if has_changed(folder, &texture.file, &texture.hash) {
            return Err(Diagnostic::stale(format!(
                "the texture `{}` has changed since its mean was taken or it went into another one, or is gone",
                texture.file
            ))
            .with_note("renew it: run lodc without `--locked`, and commit what it writes"));
        }
    }
    let mut warnings = Vec::new();
    for (what, file) in [
        ("scene", &lock.scene),
        ("lighting shader", &lock.lighting),
        ("file of meshes", &lock.meshes),
    ] {
        if let Some(file) = file
            && has_changed(folder, &file.file, &file.hash)
        {
            warnings.push(
                Diagnostic::warning(format!(
                    "the {what} `{}` has changed since the lock was made",
                    file.file
                ))
                .with_note(format!(
                    "the levels are those of the old {what}; run lodc without `--locked` to renew them"
                )),
            );
        }
    }
    Ok(warnings)
}

/// The way from a folder to a file, with forward slashes; the file's own path when there is none.
#[cfg(feature = "search")]
fn relative(folder: &Path, file: &Path) -> String {
    let absolute = |path: &Path| {
        // The folder of a bare file name is empty, and means the current one.
        let empty = path.as_os_str().is_empty();
        let path = if empty { Path::new(".") } else { path };
        std::path::absolute(path).unwrap_or_else(|_| path.to_owned())
    };
    let (from, to) = (absolute(folder), absolute(file));
    let shared = from
        .components()
        .zip(to.components())
        .take_while(|(a, b)| a == b)
        .count();
    let mut parts = vec!["..".to_owned(); from.components().count() - shared];
    parts.extend(
        to.components()
            .skip(shared)
            .map(|part| part.as_os_str().to_string_lossy().into_owned()),
    );
    parts.join("/")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(output: Option<&str>) -> Request {
        Request {
            shader: "shaders/rock.wgsl".into(),
            output: output.map(PathBuf::from),
            ..Request::default()
        }
    }

    #[test]
    fn outputs_share_the_name_that_was_asked_for() {
        assert_eq!(request(None).lock(), Path::new("shaders/rock.lod.toml"));
        assert_eq!(
            request(Some("out/a.lod.wgsl")).lock(),
            Path::new("out/a.lod.toml")
        );
        assert_eq!(
            request(Some("out/a.wgsl")).lock(),
            Path::new("out/a.lod.toml")
        );
    }

    #[cfg(feature = "search")]
    #[test]
    fn relative_paths_climb_and_descend() {
        assert_eq!(
            relative(Path::new("a/b"), Path::new("a/c/d.png")),
            "../c/d.png"
        );
        assert_eq!(relative(Path::new("a"), Path::new("a/d.png")), "d.png");
        assert_eq!(relative(Path::new(""), Path::new("a/d.png")), "a/d.png");
    }
}
