//! Tangents for draws whose file has none, after Mikkelsen's method, which tools that bake normal maps use too.
//!
//! A vertex whose triangles disagree about its tangent becomes several.
//! This work is based on: Mikkelsen, Simulation of wrinkled surfaces revisited, 2008, as `bevy_mikktspace` has it.

use crate::scene::mesh::{Draw, Mesh};
use bevy_mikktspace::{Geometry, Ops, TangentSpace};
use glam::Vec3;
use std::collections::BTreeMap;

/// Software arithmetic, so that tangents have the same bits on every machine.
struct Software;

impl Ops for Software {
    fn sqrt(x: f32) -> f32 {
        libm::sqrtf(x)
    }

    fn acos(x: f32) -> f32 {
        libm::acosf(x)
    }
}

/// The triangles of one draw, and the tangents of their corners.
struct Corners<'m> {
    mesh: &'m Mesh,
    triangles: &'m [u32],
    tangents: Vec<Option<[f32; 4]>>,
}

impl Corners<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.triangles[3 * face + corner] as usize
    }
}

impl Geometry<Software> for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.triangles.len() / 3
    }

    fn num_vertices_of_face(&self, _: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.mesh.positions[self.vertex(face, corner)]
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        self.mesh.normals[self.vertex(face, corner)]
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        // The method wants v to go up the image.
        let [u, v] = self.mesh.uvs[self.vertex(face, corner)];
        [u, 1.0 - v]
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, corner: usize) {
        self.tangents[3 * face + corner] = space.map(|space| space.tangent_encoded());
    }
}

/// The mesh with tangents in some of its draws, which have normals and texture coordinates.
pub(in crate::scene) fn generate(mesh: &Mesh, bare: &[usize]) -> Mesh {
    let mut made = Mesh::default();
    for (index, draw) in mesh.draws().into_iter().enumerate() {
        let triangles = &mesh.indices[3 * draw.triangles.start..3 * draw.triangles.end];
        let first = made.positions.len();
        if !bare.contains(&index) {
            for vertex in draw.vertices.clone() {
                push(&mut made, mesh, vertex, mesh.tangents[vertex]);
            }
            let moved = |corner: &u32| *corner - draw.vertices.start as u32 + first as u32;
            made.indices.extend(triangles.iter().map(moved));
        } else {
            let mut corners = Corners {
                mesh,
                triangles,
                tangents: vec![None; triangles.len()],
            };
            // It fails where there is nothing to be done: then every corner gets any tangent.
            let _ = bevy_mikktspace::generate_tangents(&mut corners);
            let mut known: BTreeMap<(u32, [u32; 4]), u32> = BTreeMap::new();
            for (corner, tangent) in triangles.iter().zip(&corners.tangents) {
                let vertex = *corner as usize;
                let tangent = tangent
                    .filter(|t| Vec3::from_slice(t).is_normalized())
                    .unwrap_or_else(|| any(mesh.normals[vertex]));
                let next = made.positions.len() as u32;
                let place = *known
                    .entry((*corner, tangent.map(f32::to_bits)))
                    .or_insert(next);
                if place == next {
                    push(&mut made, mesh, vertex, tangent);
                }
                made.indices.push(place);
            }
        }
        made.draws.push(Draw {
            vertices: first..made.positions.len(),
            triangles: draw.triangles,
        });
    }
    made
}

fn push(made: &mut Mesh, mesh: &Mesh, vertex: usize, tangent: [f32; 4]) {
    made.positions.push(mesh.positions[vertex]);
    made.normals.push(mesh.normals[vertex]);
    made.uvs.push(mesh.uvs[vertex]);
    made.second_uvs.extend(mesh.second_uvs.get(vertex));
    made.colours.push(mesh.colours[vertex]);
    made.tangents.push(tangent);
}

/// A unit tangent where texture coordinates do not say one.
fn any(normal: [f32; 3]) -> [f32; 4] {
    let tangent = Vec3::from(normal).any_orthonormal_vector();
    [tangent.x, tangent.y, tangent.z, 1.0]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles over -1..1 in x and y that face +z; u goes to the right, or to the left, v down.
    fn square(mirrored: bool) -> Mesh {
        let places = [[-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0], [1.0, 1.0]];
        let u = |x: f32| match mirrored {
            true => 0.5 - 0.5 * x,
            false => 0.5 + 0.5 * x,
        };
        Mesh {
            positions: places.map(|[x, y]| [x, y, 0.0]).to_vec(),
            normals: vec![[0.0, 0.0, 1.0]; 4],
            uvs: places.map(|[x, y]| [u(x), 0.5 - 0.5 * y]).to_vec(),
            colours: vec![[1.0; 4]; 4],
            tangents: vec![[0.0; 4]; 4],
            indices: vec![0, 1, 2, 0, 2, 3],
            ..Mesh::default()
        }
    }

    #[test]
    fn a_square_has_one_tangent_along_u() {
        let made = generate(&square(false), &[0]);
        // The bitangent, normal times tangent, points to the top of the image.
        assert_eq!(made.tangents, vec![[1.0, 0.0, 0.0, 1.0]; 4]);
        assert_eq!(made.indices, [0, 1, 2, 0, 2, 3]);
        let made = generate(&square(true), &[0]);
        assert_eq!(made.tangents, vec![[-1.0, 0.0, 0.0, -1.0]; 4]);
    }

    #[test]
    fn a_vertex_between_mirrored_halves_becomes_two() {
        // The second triangle's image is mirrored: its corners on the diagonal are shared no longer.
        let mut mesh = square(false);
        mesh.uvs[3] = [0.0, 1.0];
        let made = generate(&mesh, &[0]);
        assert_eq!(made.positions.len(), 6);
        let signs: Vec<f32> = made
            .indices
            .iter()
            .map(|i| made.tangents[*i as usize][3])
            .collect();
        assert_eq!(signs[..3], [1.0; 3]);
        assert_eq!(signs[3..], [-1.0; 3]);
        assert_eq!(made.draws[0].vertices, 0..6);
    }

    #[test]
    fn without_coordinates_a_tangent_is_some_unit_vector() {
        let mut mesh = square(false);
        mesh.uvs = vec![[0.0; 2]; 4];
        for [x, y, z, sign] in generate(&mesh, &[0]).tangents {
            assert!(z == 0.0 && (x * x + y * y - 1.0).abs() < 1e-6 && sign.abs() == 1.0);
        }
    }
}
