//! The files of the textures that are made for levels.

use super::{Files, Relocked, Request};
use crate::emit::{GeneratedTexture, Lock, LockedGenerated};
use crate::{Diagnostic, Result, front};
use std::path::PathBuf;

#[cfg(feature = "search")]
use crate::{eval::generated::GeneratedTextures, scene::Scene};

/// A texture that was made for levels, as a file.
pub(crate) struct Made {
    /// What the lock says of it.
    pub(crate) locked: LockedGenerated,
    /// The file's contents.
    pub(crate) bytes: Vec<u8>,
}

impl Request {
    /// The folder of the textures that are made for levels.
    pub(super) fn textures(&self) -> PathBuf {
        self.beside("lod")
    }

    /// The path of one of them by its file's name.
    pub(crate) fn generated(&self, file: &str) -> PathBuf {
        self.textures().join(file)
    }

    /// The files of made textures, in their folder.
    pub(super) fn texture_files(&self, made: Vec<Made>) -> Files {
        let folder = self.textures();
        let files = made.into_iter();
        files
            .map(|made| (folder.join(made.locked.file), made.bytes))
            .collect()
    }
}

/// Makes textures of the images of a scene.
#[cfg(feature = "search")]
pub(super) fn make(scene: &Scene, textures: &[GeneratedTexture]) -> Result<Vec<Made>> {
    let all = GeneratedTextures::new(textures.iter().map(|texture| &texture.generated));
    let all = all.map_err(|_| Diagnostic::error("internal error: a texture cannot be made"))?;
    let baked = all.baked(scene.constant(), &scene.baked);
    let named = textures.iter().zip(baked);
    named
        .map(|(texture, baked)| {
            let (extension, bytes) = baked.file()?;
            let [width, height, _] = baked.texture.size(0);
            let locked = LockedGenerated {
                name: texture.name.clone(),
                file: format!("{}.{extension}", texture.name),
                hash: front::hash(&bytes),
                format: baked.format.name().into(),
                size: [width, height],
                layers: texture.generated.is_array.then(|| baked.texture.layers()),
                levels: baked.texture.level_count(),
            };
            Ok(Made { locked, bytes })
        })
        .collect()
}

/// The textures of a lock: made again where there is an evaluator, else those that are there. They have to be what
/// they were.
///
/// # Errors
/// When they are not, or the scene cannot be read.
pub(super) fn again(
    request: &Request,
    read: &Relocked,
    textures: &[GeneratedTexture],
) -> Result<Vec<Made>> {
    if textures.is_empty() {
        return Ok(Vec::new());
    }
    #[cfg(feature = "search")]
    let made = made_again(request, read, textures)?;
    #[cfg(not(feature = "search"))]
    let made = on_disk(request, &read.lock, textures)?;
    expect_as_locked(&read.lock, &made)?;
    Ok(made)
}

/// The textures of a lock as they are beside it, which have to be what they were.
///
/// # Errors
/// When one cannot be read or has changed.
pub(crate) fn committed(
    request: &Request,
    lock: &Lock,
    textures: &[GeneratedTexture],
) -> Result<Vec<Made>> {
    let made = on_disk(request, lock, textures)?;
    expect_as_locked(lock, &made)?;
    Ok(made)
}

/// Holds textures against what a lock says of them.
fn expect_as_locked(lock: &Lock, made: &[Made]) -> Result<()> {
    match made.iter().find(|made| !is_as_locked(lock, &made.locked)) {
        Some(other) => Err(stale(&other.locked.name)),
        None => Ok(()),
    }
}

/// Whether a texture is the one that a lock has under this name.
pub(super) fn is_as_locked(lock: &Lock, made: &LockedGenerated) -> bool {
    let mut locked = lock.generated.iter();
    let locked = locked.find(|locked| locked.name == made.name);
    locked.is_some_and(|locked| locked.hash == made.hash)
}

/// Says that the lock has another texture under a name.
pub(super) fn stale(name: &str) -> Box<Diagnostic> {
    Diagnostic::stale(format!(
        "the texture `{name}` that was made for levels is not what it was"
    ))
    .with_note("renew it: run lodc without `--locked`, and commit what it writes")
}

/// Makes the textures of a lock again.
#[cfg(feature = "search")]
pub(super) fn made_again(
    request: &Request,
    read: &Relocked,
    textures: &[GeneratedTexture],
) -> Result<Vec<Made>> {
    let lock = request.committed_lock();
    let locked = read.lock.scene.as_ref();
    let locked = locked.map(|scene| lock.with_file_name(&scene.file));
    let scene = request.scene.clone().or(locked);
    make(&Scene::read(&read.source, scene.as_deref())?, textures)
}

/// The files of textures as they are.
fn on_disk(request: &Request, lock: &Lock, textures: &[GeneratedTexture]) -> Result<Vec<Made>> {
    let made = textures.iter().map(|texture| {
        let mut locked = lock.generated.iter();
        let locked = locked.find(|locked| locked.name == texture.name);
        let locked = locked.cloned().unwrap_or_default();
        // `rock.lod` beside `rock.lod.toml`.
        let folder = request.committed_lock().with_extension("");
        let file = folder.join(&locked.file);
        let bytes = std::fs::read(&file).map_err(|error| {
            Diagnostic::error(format!("cannot read `{}`: {error}", file.display())).with_note(
                "it was made for levels, and is committed with the lock: run lodc on the shader to make it again",
            )
        })?;
        let hash = front::hash(&bytes);
        Ok(Made {
            locked: LockedGenerated { hash, ..locked },
            bytes,
        })
    });
    made.collect()
}
