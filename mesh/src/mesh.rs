//! Triangle meshes as they are drawn: in one draw, or in several with bindings of their own.

use std::ops::Range;

/// A triangle mesh, one entry per vertex in every attribute that is not empty.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Object-space positions.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates, (0, 0) at the top left of the image.
    pub uvs: Vec<[f32; 2]>,
    /// A second set of texture coordinates; where it is empty, the first is read instead.
    pub second_uvs: Vec<[f32; 2]>,
    /// Unit tangents along increasing u, with the sign of the bitangent in w.
    pub tangents: Vec<[f32; 4]>,
    /// Linear colours.
    pub colours: Vec<[f32; 4]>,
    /// Three vertices a triangle, counter-clockwise seen from outside.
    pub indices: Vec<u32>,
    /// The draws that it is made in, one after another: together they have every vertex and every triangle.
    /// Empty when there is only one.
    pub draws: Vec<Draw>,
}

/// A part of a mesh that is drawn by itself: its shader sees resources of its own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Draw {
    /// Its vertices.
    pub vertices: Range<usize>,
    /// Its triangles; their corners are among its vertices.
    pub triangles: Range<usize>,
}

impl Mesh {
    /// Its draws, at least one.
    pub fn draws(&self) -> Vec<Draw> {
        if self.draws.is_empty() {
            return vec![Draw {
                vertices: 0..self.positions.len(),
                triangles: 0..self.indices.len() / 3,
            }];
        }
        self.draws.clone()
    }
}
