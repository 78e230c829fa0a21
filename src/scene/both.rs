//! One scene for two shaders that are held against each other.
//!
//! Each shader has the scene as it is for that shader: names are looked up in its own buffers and textures, and what it
//! declares elsewhere, or not at all, is its own affair. What is drawn, from where, and in how many pictures is the same.

use super::buffers::{self, Buffer, Draw};
use super::file::{Entries, SceneFile};
use super::{Files, Instead, Scene, attributes, lighting};
use crate::front::{Source, read_text};
use crate::{Diagnostic, Result};
use naga::{Module, TypeInner};
use std::path::Path;

impl Scene {
    /// Reads a scene for two shaders, the original and the other: the file at `path`, or nothing but inferences. A line
    /// of the file must fit one of them; it may name what the other does not have.
    ///
    /// # Errors
    /// As [`Scene::read`], and when the file leaves it to the shaders what is drawn and they want different things.
    pub fn read_both(
        original: &Source,
        other: &Source,
        path: Option<&Path>,
    ) -> Result<(Self, Self)> {
        let text = path.map(|path| read_text(path, "scene")).transpose()?;
        let file = path.zip(text.as_deref());
        let beside = |other| Instead {
            other: Some(other),
            ..Instead::default()
        };
        let mut a = Self::resolve_instead(original, file, beside(other), &Files)?;
        let mut b = Self::resolve_instead(other, file, beside(original), &Files)?;
        if a.object != b.object {
            return Err(Diagnostic::error(format!(
                "`{}` and `{}` are drawn on different objects: one reads a mesh, the other only the vertices' indices",
                original.name, other.name
            ))
            .with_note("compare shaders whose vertex stages take the same, or name one vertex stage for both with `--vertex-file`"));
        }
        let samples = a.samples.max(b.samples);
        (a.samples, b.samples) = (samples, samples);
        Ok((a, b))
    }

    /// Whether a uniform stands for the level of detail.
    pub(crate) fn has_auto_lod(&self) -> bool {
        self.buffers.iter().any(Buffer::has_auto_lod)
    }

    /// Hands a level of detail to the uniforms that stand for it, if the shader has one.
    pub fn set_auto_lod(&mut self, auto_lod: f64) {
        let pose = self.pose(glam::DVec3::Z, self.nearest);
        for buffer in &mut self.buffers {
            if !buffer.has_auto_lod() {
                continue;
            }
            buffer.set_auto_lod(auto_lod);
            if buffer.is_constant() {
                let resource = buffer.resource(&pose, &self.sphere, Draw::Listed(0));
                self.constant.insert(buffer.slot(), resource);
            }
        }
    }
}

/// Takes out of a scene file what names something of the other shader that this one does not have.
pub(super) fn pass_over(file: &mut SceneFile, source: &Source, other: &Source) {
    let SceneFile {
        uniforms,
        storage,
        textures,
        samplers,
        attributes,
        targets,
        ..
    } = file;
    let keep = |entries: &mut Entries, has: &dyn Fn(&Source, &toml::Spanned<String>) -> bool| {
        let entries = &mut entries.0;
        entries.retain(|(key, _)| has(source, key) || !has(other, key));
    };
    keep(uniforms, &|source, key| {
        buffers::has(source, "uniforms", key)
    });
    keep(storage, &|source, key| buffers::has(source, "storage", key));
    let image = |ty: &TypeInner| matches!(ty, TypeInner::Image { .. });
    keep(textures, &|source, key| {
        declares(&source.module, key.get_ref(), image)
    });
    let sampler = |ty: &TypeInner| matches!(ty, TypeInner::Sampler { .. });
    keep(samplers, &|source, key| {
        declares(&source.module, key.get_ref(), sampler)
    });
    keep(attributes, &|source, key| {
        attributes::has(source, key.get_ref())
    });
    keep(targets, &|source, key| {
        lighting::returns(source, key.get_ref())
    });
}

/// Whether a module has a variable of this name and of such a type.
fn declares(module: &Module, name: &str, is: impl Fn(&TypeInner) -> bool) -> bool {
    module.global_variables.iter().any(|(_, variable)| {
        variable.name.as_deref() == Some(name) && is(&module.types[variable.ty].inner)
    })
}
