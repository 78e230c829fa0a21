//! What an established simplifier makes of a mesh: meshoptimizer's, by the feature `meshopt`.
//!
//! It knows no pictures. What it makes stands beside our own in tables, and among the meshes that are proposed.

use super::Triangles;
use crate::scene::mesh::Mesh;
use meshopt::{SimplifyOptions, VertexDataAdapter, simplify, simplify_with_attributes_and_locks};

/// What a unit of a normal weighs against a unit of position, where positions are in units of the object's extent: what
/// meshoptimizer's author uses.
const NORMALS: f32 = 0.5;

/// The same of texture coordinates.
const UVS: f32 = 1.0;

/// The same of colours.
const COLOURS: f32 = 0.5;

/// Its name for an error that nothing exceeds, relative to the extent.
const ANY_ERROR: f32 = 1.0;

/// So many triangles of a mesh, or as few above that as it finds; by positions alone, or by normals, texture coordinates and
/// colours too. Draws keep their share.
pub fn to_triangles(mesh: &Mesh, count: usize, attributes: bool) -> Triangles {
    let all = mesh.indices.len() / 3;
    Triangles::of_draws(mesh, |draw| {
        let share = draw.triangles.len() as f64 / all.max(1) as f64;
        let wanted = 3 * (count as f64 * share).round() as usize;
        let first = draw.vertices.start;
        let range = 3 * draw.triangles.start..3 * draw.triangles.end;
        let indices: Vec<u32> = mesh.indices[range]
            .iter()
            .map(|vertex| vertex - first as u32)
            .collect();
        let positions = &mesh.positions[draw.vertices.clone()];
        let bytes: Vec<u8> = positions
            .as_flattened()
            .iter()
            .flat_map(|number| number.to_ne_bytes())
            .collect();
        // Three floats for each vertex, as was just written.
        let Ok(vertices) = VertexDataAdapter::new(&bytes, 12, 0) else {
            return Vec::new();
        };
        let options = SimplifyOptions::None;
        let left = match attributes {
            false => simplify(&indices, &vertices, wanted, ANY_ERROR, options, None),
            true => {
                let weights = [
                    NORMALS, NORMALS, NORMALS, UVS, UVS, COLOURS, COLOURS, COLOURS,
                ];
                let own = draw.vertices.clone().flat_map(|vertex| {
                    let channels = lodc_mesh::channels(mesh, vertex as u32);
                    channels.map(|number| number as f32)
                });
                let own: Vec<f32> = own.collect();
                let locks = vec![false; positions.len()];
                let stride = 4 * weights.len();
                simplify_with_attributes_and_locks(
                    &indices, &vertices, &own, &weights, stride, &locks, wanted, ANY_ERROR,
                    options, None,
                )
            }
        };
        left.into_iter()
            .map(|vertex| vertex + first as u32)
            .collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::objects::Object;

    #[test]
    fn draws_keep_their_share_of_triangles() {
        let one = Object::TorusKnot.mesh(1);
        let count = one.positions.len();
        let mut two = one.clone();
        two.indices
            .extend(one.indices.iter().map(|v| v + count as u32));
        two.positions.extend(&one.positions);
        two.normals.extend(&one.normals);
        two.uvs.extend(&one.uvs);
        two.tangents.extend(&one.tangents);
        two.colours.extend(&one.colours);
        let of_one = one.indices.len() / 3;
        two.draws = [0, 1]
            .map(|i| crate::scene::mesh::Draw {
                vertices: i * count..(i + 1) * count,
                triangles: i * of_one..(i + 1) * of_one,
            })
            .to_vec();
        for attributes in [false, true] {
            let left = to_triangles(&two, of_one / 2, attributes);
            assert!(left.count() <= of_one / 2 + 2 && left.count() > of_one / 4);
            let mesh = left.mesh(&two);
            let draws = mesh.draws();
            assert_eq!(draws.len(), 2);
            assert_eq!(draws[0].triangles.len(), draws[1].triangles.len());
            for draw in draws {
                let own = &mesh.indices[3 * draw.triangles.start..3 * draw.triangles.end];
                assert!(own.iter().all(|v| draw.vertices.contains(&(*v as usize))));
            }
        }
    }
}
