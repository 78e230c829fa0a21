//! Reads meshes out of the bytes of files that have no scene: OBJ and PLY.
//!
//! ```text
//! bytes --obj, ply--> corners of triangles, a list for each material --build--> Mesh, a draw for each material
//! ```
//!
//! Nothing that a file says about itself is believed before there are bytes for it, so that memory stays within a small
//! multiple of the file. Polygons become fans of triangles. Normals that are missing are smooth.

mod build;
mod mtl;
mod obj;
mod ply;

pub use obj::obj;
pub use ply::ply;

#[cfg(test)]
mod tests;

use crate::Mesh;

/// The most triangles that a model may have.
pub const MOST_TRIANGLES: usize = 2_000_000;

/// What a file held.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// Its triangles, with a draw for each material. There are normals, texture coordinates and colours for each vertex,
    /// and no tangents.
    pub mesh: Mesh,
    /// The material of each draw.
    pub materials: Vec<Material>,
    /// What of the file was left out or made up, as a sentence of which the model's name is the subject.
    pub warnings: Vec<String>,
}

/// What a surface looks like, as far as these files say it, with glTF's meaning.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// What the file calls it; empty where it has no name.
    pub name: String,
    /// Linear, with alpha.
    pub base_colour: [f32; 4],
    /// 0 to 1.
    pub metallic: f32,
    /// 0 to 1.
    pub roughness: f32,
    /// Linear.
    pub emission: [f32; 3],
    /// The image that the base colour is multiplied with, a path from the model's folder.
    pub base_image: Option<String>,
    /// The image that the emission is multiplied with.
    pub emissive_image: Option<String>,
    /// The map of normals.
    pub normal_image: Option<String>,
}

impl Material {
    fn named(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            base_colour: [1.0; 4],
            metallic: 0.0,
            roughness: 1.0,
            emission: [0.0; 3],
            base_image: None,
            emissive_image: None,
            normal_image: None,
        }
    }
}
