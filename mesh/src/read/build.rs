//! Corners of triangles into a mesh: vertices that are alike once, a draw for each list, normals where there are none.

use super::MOST_TRIANGLES;
use crate::normals::smooth;
use crate::{Draw, Mesh};
use std::collections::HashMap;

/// A corner: indices into the numbers that the file has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Corner {
    pub(super) position: u32,
    pub(super) uv: Option<u32>,
    pub(super) normal: Option<u32>,
}

/// A triangle, and its smoothing group: where normals are missing, edges between groups are sharp.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    pub(super) corners: [Corner; 3],
    pub(super) group: u32,
}

/// What a file has. Colours have an entry for each position, or there are none.
#[derive(Clone, Debug, Default)]
pub(super) struct Numbers {
    pub(super) positions: Vec<[f32; 3]>,
    pub(super) colours: Vec<[f32; 4]>,
    /// (0, 0) at the bottom left of the image, as these files have it.
    pub(super) uvs: Vec<[f32; 2]>,
    pub(super) normals: Vec<[f32; 3]>,
}

/// Adds a polygon as a fan.
///
/// # Errors
/// When there are too many triangles; `already` are those of other lists.
pub(super) fn add_polygon(
    triangles: &mut Vec<Triangle>,
    already: usize,
    corners: &[Corner],
    group: u32,
) -> Result<(), String> {
    let Some((first, rest)) = corners.split_first() else {
        return Ok(());
    };
    for pair in rest.windows(2) {
        if already + triangles.len() >= MOST_TRIANGLES {
            return Err(format!("it has more than {MOST_TRIANGLES} triangles"));
        }
        triangles.push(Triangle {
            corners: [*first, pair[0], pair[1]],
            group,
        });
    }
    Ok(())
}

/// The mesh of some lists of triangles, a draw for each list, and how many of the file's normals had no direction: they
/// are made like those that are missing.
pub(super) fn build(numbers: &Numbers, lists: &[Vec<Triangle>]) -> (Mesh, usize) {
    let mut repaired = 0;
    let normals: Vec<Option<[f32; 3]>> = numbers
        .normals
        .iter()
        .map(|normal| {
            let unit = glam::DVec3::from_array(normal.map(f64::from)).try_normalize();
            repaired += usize::from(unit.is_none());
            unit.map(|unit| unit.as_vec3().normalize().to_array())
        })
        .collect();
    let given = |corner: &Corner| normals.get(corner.normal? as usize).copied().flatten();
    let all = || lists.iter().flatten();
    let missing = all().any(|t| t.corners.iter().any(|corner| given(corner).is_none()));
    let made = match missing {
        true => {
            let triangles: Vec<[u32; 3]> = all().map(|t| t.corners.map(|c| c.position)).collect();
            let groups: Vec<u32> = all().map(|t| t.group).collect();
            smooth(&numbers.positions, &triangles, &groups)
        }
        false => Vec::new(),
    };
    let mut made = made.into_iter();
    let mut mesh = Mesh::default();
    for list in lists {
        let (first, start) = (mesh.positions.len(), mesh.indices.len() / 3);
        // Only looked up, so that its order does not matter.
        let mut known: HashMap<(u32, [u32; 2], [u32; 3]), u32> = HashMap::new();
        for triangle in list {
            let made = made.next();
            for (i, corner) in triangle.corners.iter().enumerate() {
                let normal = given(corner).or_else(|| made.map(|made| made[i]));
                let normal = normal.unwrap_or([0.0, 0.0, 1.0]);
                let uv = corner.uv.and_then(|uv| numbers.uvs.get(uv as usize));
                // Rows of images are counted from the top.
                let uv = uv.map_or([0.0; 2], |[u, v]| [*u, 1.0 - v]);
                let bits = (uv.map(f32::to_bits), normal.map(f32::to_bits));
                let key = (corner.position, bits.0, bits.1);
                let vertex = *known.entry(key).or_insert_with(|| {
                    let position = corner.position as usize;
                    mesh.positions.push(numbers.positions[position]);
                    mesh.normals.push(normal);
                    mesh.uvs.push(uv);
                    let colour = numbers.colours.get(position);
                    mesh.colours.push(colour.copied().unwrap_or([1.0; 4]));
                    mesh.positions.len() as u32 - 1
                });
                mesh.indices.push(vertex);
            }
        }
        mesh.draws.push(Draw {
            vertices: first..mesh.positions.len(),
            triangles: start..mesh.indices.len() / 3,
        });
    }
    (mesh, repaired)
}

/// A number of 0 to 1 that is encoded as sRGB, linear.
pub(super) fn linear(encoded: f64) -> f32 {
    let x = encoded.clamp(0.0, 1.0);
    let linear = match x <= 0.04045 {
        true => x / 12.92,
        false => libm::pow((x + 0.055) / 1.055, 2.4),
    };
    linear as f32
}
