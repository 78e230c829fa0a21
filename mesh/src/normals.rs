//! Normals for meshes whose file has none: smooth ones, by position.

use glam::DVec3;
use std::collections::HashMap;

/// A unit normal for each corner of each triangle: the mean of the normals of all triangles of its group that have a corner in
/// that place, each weighted by its angle there, so that it does not matter how a face is cut into triangles. Where
/// they have none or cancel out it is the triangle's own, and +z for a triangle without area.
///
/// `groups` has a number for each triangle; corners of different groups have nothing to do with each other, and their
/// edge is sharp. Corners have the same place when their positions are equal; -0 is 0.
pub(crate) fn smooth(
    positions: &[[f32; 3]],
    triangles: &[[u32; 3]],
    groups: &[u32],
) -> Vec<[[f32; 3]; 3]> {
    let at = |corner: u32| DVec3::from_array(positions[corner as usize].map(f64::from));
    // Adding 0 makes 0 of -0.
    let key = |corner: u32, group: u32| {
        (
            positions[corner as usize].map(|x| (x + 0.0).to_bits()),
            group,
        )
    };
    // Only looked up, so that its order does not matter: sums are made in the order of triangles.
    let mut sums: HashMap<([u32; 3], u32), DVec3> = HashMap::new();
    let faces = triangles.iter().map(|corners| {
        let [a, b, c] = corners.map(at);
        (b - a).cross(c - a).try_normalize()
    });
    let faces: Vec<Option<DVec3>> = faces.collect();
    for ((corners, group), face) in triangles.iter().zip(groups).zip(&faces) {
        let Some(face) = face else { continue };
        for i in 0..3 {
            let [here, next, last] = [0, 1, 2].map(|step| at(corners[(i + step) % 3]));
            let angle = match ((next - here).try_normalize(), (last - here).try_normalize()) {
                (Some(a), Some(b)) => libm::acos(a.dot(b).clamp(-1.0, 1.0)),
                _ => 0.0,
            };
            *sums.entry(key(corners[i], *group)).or_default() += *face * angle;
        }
    }
    let of = |((corners, group), face): ((&[u32; 3], &u32), &Option<DVec3>)| {
        corners.map(|corner| {
            let sum = sums.get(&key(corner, *group));
            let normal = sum.and_then(|sum| sum.try_normalize());
            let normal = normal.or(*face).unwrap_or(DVec3::Z);
            normal.as_vec3().normalize().to_array()
        })
    };
    triangles.iter().zip(groups).zip(&faces).map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corner_of_a_cube_points_out_of_it() {
        // Three faces at the origin, one of two triangles: it weighs no more for that.
        let positions = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
            [1.0, 1.0, 0.0],
            // The origin once more.
            [-0.0, 0.0, 0.0],
        ];
        let triangles = [[0, 2, 4], [0, 4, 1], [5, 1, 3], [0, 3, 2]];
        let normals = smooth(&positions, &triangles, &[0; 4]);
        let third = -1.0 / 3f32.sqrt();
        for corner in [normals[0][0], normals[1][0], normals[2][0], normals[3][0]] {
            for x in corner {
                assert!((x - third).abs() < 1e-6, "{corner:?}");
            }
        }
        // In groups of their own faces are flat.
        let sharp = smooth(&positions, &triangles, &[0, 0, 1, 2]);
        assert_eq!(sharp[0][0], [0.0, 0.0, -1.0]);
        assert_eq!(sharp[2], [[0.0, -1.0, 0.0]; 3]);
    }

    #[test]
    fn triangles_without_area_have_some_normal() {
        let positions = [[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]];
        let normals = smooth(&positions, &[[0, 1, 2]], &[0]);
        assert_eq!(normals, [[[0.0, 0.0, 1.0]; 3]]);
    }
}
