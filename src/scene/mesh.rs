//! Triangle meshes as the evaluator draws them.

/// A triangle mesh, one entry per vertex in every attribute that is not empty.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Object-space positions.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates, (0, 0) at the top left of the image.
    pub uvs: Vec<[f32; 2]>,
    /// Unit tangents along increasing u, with the sign of the bitangent in w.
    pub tangents: Vec<[f32; 4]>,
    /// Linear colours.
    pub colours: Vec<[f32; 4]>,
    /// Three vertices a triangle, counter-clockwise seen from outside.
    pub indices: Vec<u32>,
}
