//! A model's file, and the files that levels of its mesh are written to.

use super::Files;
use crate::scene::Model;
use crate::{Diagnostic, Result};
use lodc_mesh::Mesh;
use lodc_mesh::write::{Level, Looks, Sight, glb, table};
use std::path::{Path, PathBuf};

/// A model without a scene: its mesh, and what its surfaces look like.
#[derive(Clone, Debug)]
pub struct ModelFile {
    /// Its triangles, a draw for each material. Tangents are those of the file: zeros in draws that have none.
    pub mesh: Mesh,
    /// What should be known.
    pub warnings: Vec<Diagnostic>,
    model: Model,
}

impl ModelFile {
    /// Reads a glTF, GLB, OBJ or PLY file.
    ///
    /// # Errors
    /// When it cannot be read or is damaged.
    pub fn read(path: &Path) -> Result<Self> {
        let mut model = Model::read(&path.to_string_lossy(), Path::new(""))?;
        Ok(Self {
            mesh: std::mem::take(&mut model.mesh),
            warnings: model.warnings.clone(),
            model,
        })
    }

    /// Its materials, as files of levels have them, with all images.
    ///
    /// # Errors
    /// When an image cannot be read.
    pub fn looks(&self) -> Result<Looks> {
        self.model.looks()
    }

    /// The files of some levels of its mesh: `output`, a GLB of all of them, or with `apart` one of each level,
    /// `rock.lod0.glb` and so on for `rock.glb`; and the table of their distances, `rock.meshes.toml`.
    ///
    /// # Errors
    /// When an image cannot be read, or a level cannot be written.
    pub fn files(
        &self,
        levels: &[Level],
        sight: &Sight,
        output: &Path,
        apart: bool,
    ) -> Result<Files> {
        let looks = self.looks()?;
        let write = |levels: &[Level]| {
            glb(levels, sight, &looks).map_err(|why| {
                Diagnostic::error(format!("cannot write `{}`: {why}", output.display()))
                    .with_note("write fewer levels")
            })
        };
        let mut files = Files::new();
        let mut names = Vec::new();
        if apart {
            for (i, level) in levels.iter().enumerate() {
                let path = output.with_extension(format!("lod{i}.glb"));
                names.push(name(&path));
                files.push((path, write(std::slice::from_ref(level))?));
            }
        } else {
            files.push((output.to_owned(), write(levels)?));
        }
        let table = table(levels, sight, &name(output), &names);
        files.push((table_path(output), table.into_bytes()));
        Ok(files)
    }
}

/// Where the table of distances stands.
fn table_path(output: &Path) -> PathBuf {
    output.with_extension("meshes.toml")
}

fn name(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    name.to_string_lossy().into_owned()
}
