//! Emits again from the lock, and compares with what is committed: text line by line, textures texel by texel.
//!
//! ```text
//! lock + source --locked--> files in memory --compare--> [Difference]
//! ```

use super::{Files, LOCK_ENDING, Relocked, Request, read_lock, textures};
use crate::emit::{self, Form, GeneratedTexture, Lock, Target};
#[cfg(feature = "search")]
use crate::eval::texture::Texture;
use crate::{Diagnostic, Result, front};
use similar::TextDiff;
use std::path::{Path, PathBuf};

/// Outputs of a lock beside those that are committed.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Check {
    /// Every file that the lock makes, in the order in which they are written.
    pub files: Vec<PathBuf>,
    /// Those that are committed otherwise, or not at all.
    pub differences: Vec<Difference>,
    /// What is worth saying: a scene that has changed since.
    pub warnings: Vec<Box<Diagnostic>>,
}

/// A file that is not what the lock makes.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Difference {
    /// The file.
    pub path: PathBuf,
    /// How it differs, for people: a unified diff of what is committed to what the lock makes, or a line that says what is wrong.
    pub what: String,
    /// What the lock makes of it; `None` where the lock does not say, as of a mesh.
    pub bytes: Option<Vec<u8>>,
}

impl Check {
    /// Whether all is as it is committed.
    pub fn is_same(&self) -> bool {
        self.differences.is_empty()
    }

    /// The files that are to be written so that all is as the lock has it.
    pub fn blessed(&self) -> Files {
        let differences = self.differences.iter();
        differences
            .filter_map(|difference| Some((difference.path.clone(), difference.bytes.clone()?)))
            .collect()
    }

    /// All differences, as a terminal shows them; empty where there are none.
    pub fn diff(&self) -> String {
        let what = self.differences.iter().map(|found| found.what.as_str());
        what.collect()
    }
}

/// Emits from the lock of a request as [`super::locked`] does, and compares with the files that are there. Of a texture the texels
/// are compared, where there is an evaluator to make them again, else the hash that the lock has.
///
/// # Errors
/// As [`super::locked`].
pub fn check(request: &Request) -> Result<Check> {
    let read = read_lock(request)?;
    let emission = request.emission(read.lock.output);
    let emitted = request.emitted_again(&read, emission)?;
    let mut check = Check {
        files: Vec::new(),
        differences: Vec::new(),
        warnings: Vec::new(),
    };
    for (path, bytes) in emitted {
        let what = of_file(&path, &bytes)?;
        check.take(path, what, Some(bytes));
    }
    let textures = emit::generated_textures(&read.source, &read.levels, emission.form)?;
    if !textures.is_empty() {
        of_textures(request, &read, &textures, &mut check)?;
    }
    if let Some(meshes) = &read.lock.meshes {
        let path = request.committed_lock().with_file_name(&meshes.file);
        let what = of_hash(&path, &meshes.hash)?;
        check.take(path, what, None);
    }
    let left = left_over(&request.textures(), &|_| true)?;
    let left = left.into_iter().chain(match emission.form {
        Form::Files => request.of_gone_levels(&check.files)?,
        Form::Override | Form::Uniform => Vec::new(),
    });
    for path in left {
        let is_made = |made: &PathBuf| is_same(made, &path);
        if !check.files.iter().any(is_made) {
            let what = says(
                &path,
                "is left over: no level of the lock has it, delete it",
            );
            check.differences.push(Difference {
                path,
                what,
                bytes: None,
            });
        }
    }
    check.warnings = read.warnings;
    Ok(check)
}

/// Whether two paths lead to one file.
fn is_same(one: &Path, other: &Path) -> bool {
    let place = |path: &Path| path.canonicalize().ok();
    one == other || place(one).is_some_and(|one| place(other) == Some(one))
}

/// The files of a folder whose names are meant, sorted; none when there is no folder.
fn left_over(folder: &Path, is_meant: &dyn Fn(&str) -> bool) -> Result<Vec<PathBuf>> {
    let failed = |error: std::io::Error| {
        Diagnostic::error(format!(
            "cannot read the folder `{}`: {error}",
            folder.display()
        ))
    };
    // The folder of a bare file name is empty, and means the current one.
    let here = match folder.as_os_str().is_empty() {
        true => Path::new("."),
        false => folder,
    };
    let entries = match std::fs::read_dir(here) {
        Ok(entries) => entries,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => return Err(failed(error)),
    };
    let mut found = Vec::new();
    for entry in entries {
        let name = entry.map_err(failed)?.file_name();
        let path = folder.join(&name);
        let name = name.to_string_lossy();
        if !name.starts_with('.') && is_meant(&name) && path.is_file() {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

impl Request {
    /// The files beside the outputs that are called as those of single levels are, `rock.lod3.wgsl`, and end as one of these.
    fn of_gone_levels(&self, made: &[PathBuf]) -> Result<Vec<PathBuf>> {
        let lock = self.lock();
        let start = format!("{}.lod", self.stem());
        left_over(lock.parent().unwrap_or(Path::new("")), &|name| {
            let behind = name.strip_prefix(&start).unwrap_or_default();
            let number = behind.find('.').map_or("", |dot| &behind[..dot]);
            let extension = Path::new(name).extension();
            !number.is_empty()
                && number.bytes().all(|digit| digit.is_ascii_digit())
                && made.iter().any(|made| made.extension() == extension)
        })
    }
}

impl Check {
    /// Notes an output, and how it differs.
    fn take(&mut self, path: PathBuf, what: Option<String>, bytes: Option<Vec<u8>>) {
        self.files.push(path.clone());
        if let Some(what) = what {
            self.differences.push(Difference { path, what, bytes });
        }
    }
}

/// The committed contents of an output; `None` when there is no such file.
fn committed(path: &Path) -> Result<Option<Vec<u8>>> {
    match std::fs::read(path) {
        Ok(bytes) => Ok(Some(bytes)),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(Diagnostic::error(format!(
            "cannot read the output `{}`: {error}",
            path.display()
        ))),
    }
}

/// A line about a file.
fn says(path: &Path, what: &str) -> String {
    format!("{}: {what}\n", path.display())
}

/// How a file differs from what the lock makes of it.
fn of_file(path: &Path, made: &[u8]) -> Result<Option<String>> {
    let Some(have) = committed(path)? else {
        return Ok(Some(says(path, "is missing")));
    };
    if have == made {
        return Ok(None);
    }
    let texts = (std::str::from_utf8(&have), std::str::from_utf8(made));
    Ok(Some(match texts {
        (Ok(have), Ok(made)) => {
            let name = path.display().to_string();
            let diff = TextDiff::from_lines(have, made);
            diff.unified_diff().header(&name, &name).to_string()
        }
        _ => {
            let what = format!(
                "has {} bytes, and others than the {} that the lock makes",
                have.len(),
                made.len()
            );
            says(path, &what)
        }
    }))
}

/// How a file differs that the lock knows by its hash alone.
fn of_hash(path: &Path, hash: &str) -> Result<Option<String>> {
    Ok(match committed(path)? {
        None => Some(says(path, "is missing, and made by a search alone")),
        Some(have) if front::hash(&have) == hash => None,
        Some(_) => Some(says(path, "is not the file that the lock was made with")),
    })
}

/// Compares the textures that were made for levels, texel by texel with what is made now.
#[cfg(feature = "search")]
fn of_textures(
    request: &Request,
    read: &Relocked,
    textures: &[GeneratedTexture],
    check: &mut Check,
) -> Result<()> {
    for made in textures::made_again(request, read, textures)? {
        let path = request.textures().join(&made.locked.file);
        let what = of_texels(&path, &made.bytes)?;
        if what.is_some() && !textures::is_as_locked(&read.lock, &made.locked) {
            return Err(textures::stale(&made.locked.name));
        }
        check.take(path, what, Some(made.bytes));
    }
    Ok(())
}

/// How the texels of a committed texture differ from those that are made now.
#[cfg(feature = "search")]
fn of_texels(path: &Path, made: &[u8]) -> Result<Option<String>> {
    use crate::eval::generated;
    let Some(have) = committed(path)? else {
        return Ok(Some(says(path, "is missing")));
    };
    if have == made {
        return Ok(None);
    }
    let name = path.display().to_string();
    let have = match generated::read(&name, &have) {
        Ok(have) => have,
        Err(error) => return Ok(Some(says(path, &error.message))),
    };
    let made = generated::read(&name, made)?;
    if have == made {
        return Ok(None);
    }
    let shape = |texture: &Texture| {
        let [width, height, _] = texture.size(0);
        let (layers, levels) = (texture.layers(), texture.level_count());
        format!("{width} x {height} texels, {layers} of layers, {levels} of MIP levels")
    };
    let shapes = [shape(&have), shape(&made)];
    if have.dimension() != made.dimension() || shapes[0] != shapes[1] {
        let what = format!("has {}, and {} from the lock", shapes[0], shapes[1]);
        return Ok(Some(says(path, &what)));
    }
    let texels = |texture: &Texture| -> Vec<[f32; 4]> {
        let levels = texture.levels().iter();
        levels
            .flat_map(|level| level.texels.iter().copied())
            .collect()
    };
    let (have, made) = (texels(&have), texels(&made));
    let apart = have.iter().zip(&made);
    let apart = apart.map(|(a, b)| [0, 1, 2, 3].map(|i| (a[i] - b[i]).abs()));
    let most: Vec<f32> = apart
        .map(|each| each.into_iter().fold(0.0, f32::max))
        .collect();
    let what = format!(
        "{} of {} texels, those of MIP levels included, are not what the lock makes, by {:.4} at most",
        most.iter().filter(|most| **most > 0.0).count(),
        most.len(),
        most.iter().copied().fold(0.0, f32::max)
    );
    Ok(Some(says(path, &what)))
}

/// Compares the textures that were made for levels by their hashes: without an evaluator they cannot be made again.
#[cfg(not(feature = "search"))]
fn of_textures(
    request: &Request,
    read: &Relocked,
    textures: &[GeneratedTexture],
    check: &mut Check,
) -> Result<()> {
    for texture in textures {
        let mut locked = read.lock.generated.iter();
        let Some(locked) = locked.find(|locked| locked.name == texture.name) else {
            return Err(textures::stale(&texture.name));
        };
        let path = request.textures().join(&locked.file);
        let what = of_hash(&path, &locked.hash)?;
        check.take(path, what, None);
    }
    Ok(())
}

impl Request {
    /// Whether a file is called as a lock is.
    pub fn is_lock(path: &Path) -> bool {
        let name = path.file_name().unwrap_or_default();
        name.to_string_lossy().ends_with(LOCK_ENDING)
    }

    /// The request that a lock belongs to: its source, with outputs that are called as the lock is.
    ///
    /// # Errors
    /// When the file is no lock, by its name or by what it says.
    pub fn of_lock(path: &Path) -> Result<Self> {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let Some(stem) = name.strip_suffix(LOCK_ENDING) else {
            return Err(Diagnostic::error(format!(
                "`{}` is not called as a lock is",
                path.display()
            ))
            .with_note("the lock of `rock.wgsl` is `rock.lod.toml`"));
        };
        let (lock, _) = Lock::read(path)?;
        let shader = path.with_file_name(&lock.source.file);
        let is_beside = Path::new(&lock.source.file).with_extension("") == Path::new(stem);
        let ending = match lock.output.target {
            Target::Wgsl => "wgsl",
            Target::Spirv => "spv",
            Target::Glsl => "glsl",
            Target::Hlsl => "hlsl",
            Target::Msl => "metal",
        };
        let output = path.with_file_name(format!("{stem}.lod.{ending}"));
        Ok(Self {
            shader,
            output: (!is_beside).then_some(output),
            ..Self::default()
        })
    }
}

/// Every lock in a folder and the folders in it, in the order of their names. What begins with a dot is left out, and
/// links to folders.
///
/// # Errors
/// When a folder cannot be read, or there is none.
pub fn locks(folder: &Path) -> Result<Vec<PathBuf>> {
    let failed = |path: &Path, error: std::io::Error| {
        Diagnostic::error(format!(
            "cannot read the folder `{}`: {error}",
            path.display()
        ))
    };
    let (mut found, mut waiting) = (Vec::new(), vec![folder.to_owned()]);
    while let Some(here) = waiting.pop() {
        for entry in std::fs::read_dir(&here).map_err(|error| failed(&here, error))? {
            let entry = entry.map_err(|error| failed(&here, error))?;
            let name = entry.file_name();
            let name = name.to_string_lossy();
            let ty = entry.file_type().map_err(|error| failed(&here, error))?;
            match ty.is_dir() {
                _ if name.starts_with('.') => {}
                true => waiting.push(entry.path()),
                false if name.ends_with(LOCK_ENDING) => found.push(entry.path()),
                false => {}
            }
        }
    }
    if found.is_empty() {
        return Err(
            Diagnostic::error(format!("there is no lock in `{}`", folder.display()))
                .with_note("a lock is called `rock.lod.toml`: run lodc on a shader to make it"),
        );
    }
    found.sort();
    Ok(found)
}
