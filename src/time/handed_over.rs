//! A mesh as bytes, from a search to the process that times it.

#[cfg(feature = "gpu")]
use crate::{Diagnostic, Result};
use lodc_mesh::{Draw, Mesh};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// A mesh as data.
#[derive(Serialize, Deserialize)]
struct Data<'m> {
    positions: Cow<'m, [[f32; 3]]>,
    normals: Cow<'m, [[f32; 3]]>,
    uvs: Cow<'m, [[f32; 2]]>,
    second_uvs: Cow<'m, [[f32; 2]]>,
    tangents: Cow<'m, [[f32; 4]]>,
    colours: Cow<'m, [[f32; 4]]>,
    indices: Cow<'m, [u32]>,
    /// Where the vertices of each draw begin and end, and its triangles.
    draws: Vec<[usize; 4]>,
}

/// A mesh as bytes, all its numbers to the bit.
pub(crate) fn bytes(mesh: &Mesh) -> Vec<u8> {
    let draws = mesh.draws.iter().map(|draw| {
        let Draw {
            vertices,
            triangles,
        } = draw;
        [vertices.start, vertices.end, triangles.start, triangles.end]
    });
    let data = Data {
        positions: Cow::Borrowed(&mesh.positions),
        normals: Cow::Borrowed(&mesh.normals),
        uvs: Cow::Borrowed(&mesh.uvs),
        second_uvs: Cow::Borrowed(&mesh.second_uvs),
        tangents: Cow::Borrowed(&mesh.tangents),
        colours: Cow::Borrowed(&mesh.colours),
        indices: Cow::Borrowed(&mesh.indices),
        draws: draws.collect(),
    };
    // Numbers in lists: nothing of that cannot be written.
    serde_json::to_vec(&data).unwrap_or_default()
}

/// The mesh of such bytes.
///
/// # Errors
/// When they are none, or an index is beyond the vertices.
#[cfg(feature = "gpu")]
pub(crate) fn mesh(bytes: &[u8]) -> Result<Mesh> {
    let wrong = || Diagnostic::error("what was handed over is no mesh");
    let data: Data<'_> =
        serde_json::from_slice(bytes).map_err(|error| wrong().with_reason(error))?;
    let count = data.positions.len();
    if data.indices.iter().any(|index| *index as usize >= count) {
        return Err(wrong().with_reason("an index is beyond its vertices"));
    }
    let draws = data.draws.into_iter();
    Ok(Mesh {
        positions: data.positions.into_owned(),
        normals: data.normals.into_owned(),
        uvs: data.uvs.into_owned(),
        second_uvs: data.second_uvs.into_owned(),
        tangents: data.tangents.into_owned(),
        colours: data.colours.into_owned(),
        indices: data.indices.into_owned(),
        draws: draws
            .map(|[a, b, c, d]| Draw {
                vertices: a..b,
                triangles: c..d,
            })
            .collect(),
    })
}

#[cfg(all(test, feature = "gpu"))]
mod tests {
    use super::*;

    #[test]
    fn a_mesh_arrives_to_the_bit() {
        let own = Mesh {
            positions: vec![[0.1, -0.0, f32::MIN_POSITIVE], [1.0; 3], [2.0, 1e30, 3.0]],
            normals: vec![[0.0, 0.0, 1.0]; 3],
            colours: vec![[0.2; 4]; 3],
            indices: vec![0, 1, 2],
            draws: vec![Draw {
                vertices: 0..3,
                triangles: 0..1,
            }],
            ..Mesh::default()
        };
        let there = mesh(&bytes(&own)).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(bytes(&there), bytes(&own));
        let bits = |mesh: &Mesh| {
            mesh.positions
                .as_flattened()
                .iter()
                .map(|x| x.to_bits())
                .collect::<Vec<_>>()
        };
        assert_eq!(bits(&there), bits(&own));
        let beyond = Mesh {
            indices: vec![0, 1, 3],
            ..own
        };
        assert!(mesh(&bytes(&beyond)).is_err() && mesh(b"[").is_err());
    }
}
