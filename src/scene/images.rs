//! Where images come from: the library asks for pixels by name, and need not be given any.
//!
//! This work is based on: Marc Olano, Bob Kuehne, Maryann Simmons, "Automatic Shader Level of Detail", 2003, section 3.1:
//! an application that owns its textures answers a callback with their data, or that they are unknown or dynamic.

use crate::Result;
use crate::eval::texture::Texture;
use std::fmt;
use std::io;
use std::path::Path;

/// What is known of a texture's image.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum ImageAnswer {
    /// Its texels. MIP levels are made where there is the first one alone.
    Pixels(Texture),
    /// It changes while the application runs: it is never averaged, baked or removed.
    Dynamic,
    /// Nothing is known of it. It counts as dynamic, with a warning.
    Unknown,
}

/// Gives images by name. An application that holds its textures in memory or in an archive implements it; [`Files`] is
/// what the command line uses. `examples/images.rs` has one of its own.
pub trait ImageSource: fmt::Debug + Send + Sync {
    /// The image of a texture that the scene file does not name, by the name of its variable in the shader.
    ///
    /// # Errors
    /// When there is an image, and it cannot be had.
    fn texture(&self, name: &str) -> Result<ImageAnswer>;

    /// The bytes of a PNG or JPEG file that the scene file names; its path has the scene file's folder in front.
    ///
    /// # Errors
    /// When it cannot be read: of the kind [`io::ErrorKind::NotFound`] when there is none.
    fn file(&self, path: &Path) -> io::Result<Vec<u8>>;
}

/// Files on the disk, and nothing but what a scene file names.
#[derive(Clone, Copy, Debug, Default)]
pub struct Files;

impl ImageSource for Files {
    fn texture(&self, _: &str) -> Result<ImageAnswer> {
        Ok(ImageAnswer::Unknown)
    }

    fn file(&self, path: &Path) -> io::Result<Vec<u8>> {
        std::fs::read(path)
    }
}
