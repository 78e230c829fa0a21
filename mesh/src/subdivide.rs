//! One step of subdivision: each triangle in four, at the middles of its edges. The surface stays where it is; it has more vertices, for
//! what is computed at them.

use std::collections::BTreeMap;

use glam::{Vec3, Vec4};

use crate::{Draw, Mesh};

/// The mesh with every triangle in four. The four are where the one was, the middle one last, and the original's vertices are the first
/// of their draw.
///
/// Attributes are interpolated, normals and tangents brought back to length 1. Edges at the same place have their middles at the same
/// place, so that no seam opens; a mesh without draws has none afterwards.
///
/// # Panics
/// When an index is beyond the vertices: what reads meshes from files refuses such a one.
pub fn subdivide(mesh: &Mesh) -> Mesh {
    let mut fine = Mesh {
        indices: Vec::with_capacity(4 * mesh.indices.len()),
        ..Mesh::default()
    };
    for Draw {
        vertices,
        triangles,
    } in mesh.draws()
    {
        let (first_vertex, first_triangle) = (fine.positions.len(), fine.indices.len() / 3);
        let moved = |v: u32| v - vertices.start as u32 + first_vertex as u32;
        for v in vertices.clone() {
            copy(mesh, v, &mut fine);
        }
        let mut middles: BTreeMap<(u32, u32), u32> = BTreeMap::new();
        for corners in &mesh.indices.as_chunks::<3>().0[triangles] {
            let mut middle = |a: u32, b: u32| {
                *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    add_middle(mesh, a.min(b) as usize, a.max(b) as usize, &mut fine);
                    fine.positions.len() as u32 - 1
                })
            };
            let [a, b, c] = *corners;
            let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
            let [a, b, c] = [a, b, c].map(moved);
            fine.indices
                .extend([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca]);
        }
        if !mesh.draws.is_empty() {
            fine.draws.push(Draw {
                vertices: first_vertex..fine.positions.len(),
                triangles: first_triangle..fine.indices.len() / 3,
            });
        }
    }
    fine
}

fn copy(mesh: &Mesh, v: usize, fine: &mut Mesh) {
    fine.positions.push(mesh.positions[v]);
    fine.normals.extend(mesh.normals.get(v));
    fine.uvs.extend(mesh.uvs.get(v));
    fine.second_uvs.extend(mesh.second_uvs.get(v));
    fine.tangents.extend(mesh.tangents.get(v));
    fine.colours.extend(mesh.colours.get(v));
}

/// Adds the vertex in the middle of two.
fn add_middle(mesh: &Mesh, a: usize, b: usize, fine: &mut Mesh) {
    fn middle<const N: usize>(attribute: &[[f32; N]], a: usize, b: usize) -> Option<[f32; N]> {
        let (a, b) = (attribute.get(a)?, attribute.get(b)?);
        // Halves first, so that the sum cannot be too large.
        Some(std::array::from_fn(|i| 0.5 * a[i] + 0.5 * b[i]))
    }
    fine.positions.extend(middle(&mesh.positions, a, b));
    fine.uvs.extend(middle(&mesh.uvs, a, b));
    fine.second_uvs.extend(middle(&mesh.second_uvs, a, b));
    fine.colours.extend(middle(&mesh.colours, a, b));
    // Two that are opposite have no middle: then it is that of the first.
    let unit = |middle: Vec3, first: Vec3| middle.try_normalize().unwrap_or(first);
    fine.normals.extend(
        middle(&mesh.normals, a, b)
            .map(|m| unit(Vec3::from(m), Vec3::from(mesh.normals[a])).to_array()),
    );
    fine.tangents.extend(middle(&mesh.tangents, a, b).map(|m| {
        let first = Vec4::from(mesh.tangents[a]);
        unit(Vec4::from(m).truncate(), first.truncate())
            .extend(first.w)
            .to_array()
    }));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::distance::Reference;
    use crate::shapes::{in_draws, sphere, torus};
    use crate::{Kind, Surface};

    #[test]
    fn a_triangle_in_four() {
        let mesh = Mesh {
            positions: vec![[0.0; 3], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]],
            normals: vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]],
            uvs: vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
            tangents: vec![[1.0, 0.0, 0.0, -1.0]; 3],
            indices: vec![0, 1, 2],
            ..Mesh::default()
        };
        let fine = subdivide(&mesh);
        assert_eq!(
            fine.positions[3..],
            [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]
        );
        assert_eq!(fine.uvs[4], [0.5, 0.5]);
        assert_eq!(fine.tangents[3..], [[1.0, 0.0, 0.0, -1.0]; 3]);
        let half = std::f32::consts::FRAC_1_SQRT_2;
        assert!(Vec3::from(fine.normals[3]).distance(Vec3::new(half, half, 0.0)) < 1e-6);
        // That of two which are opposite.
        assert_eq!(fine.normals[5], [1.0, 0.0, 0.0]);
        assert_eq!(fine.indices, [0, 3, 5, 3, 1, 4, 5, 4, 2, 3, 4, 5]);
        assert_eq!((fine.second_uvs.len(), fine.draws.len()), (0, 0));
    }

    #[test]
    fn no_seam_opens_and_nothing_moves() {
        let drawn = in_draws(&torus(12, 8), 3, |[x, y, _]| {
            if y > 0.0 { 0 } else { 1 + usize::from(x > 0.0) }
        });
        for mesh in [drawn, sphere(12, 8)] {
            let fine = subdivide(&mesh);
            assert_eq!(fine.draws().len(), mesh.draws().len());
            for (draw, before) in fine.draws().into_iter().zip(mesh.draws()) {
                assert_eq!(draw.triangles.len(), 4 * before.triangles.len());
                let own = &fine.indices[3 * draw.triangles.start..3 * draw.triangles.end];
                assert!(own.iter().all(|v| draw.vertices.contains(&(*v as usize))));
            }
            let surface = Surface::new(&fine);
            assert!((0..surface.points() as u32).all(|p| surface.kind(p) != Kind::Border));
            // The Euler characteristic of a closed surface: a crack would have more points.
            let points = (0..surface.points() as u32)
                .filter(|p| !surface.around(*p).is_empty())
                .count();
            let edges = 3 * surface.triangle_count() / 2;
            let expected = if mesh.draws.is_empty() { 2 } else { 0 };
            assert_eq!(
                points as isize - edges as isize + surface.triangle_count() as isize,
                expected
            );
            assert!(Reference::new(&mesh).to_by_samples(&fine, 5_000).largest() < 1e-6);
        }
    }
}
