//! One primitive: its attributes out of the buffers, moved by its node, and what the file leaves out.

use super::accessor::{Buffers, floats, indices};
use crate::scene::materials::UvPlace;
use glam::{DMat3, DMat4, DVec3};
use gltf::Semantic;
use gltf::mesh::Mode;

/// A primitive in the model's space, every attribute with an entry for each vertex, or none.
#[derive(Debug, Default)]
pub(super) struct Part {
    pub(super) positions: Vec<[f32; 3]>,
    pub(super) normals: Vec<[f32; 3]>,
    /// Those that its textures are read with; zeros when it has none.
    pub(super) uvs: Vec<[f32; 2]>,
    /// The other set; empty when there is none.
    pub(super) second_uvs: Vec<[f32; 2]>,
    /// Empty when the file has none, or some that have no direction.
    pub(super) tangents: Vec<[f32; 4]>,
    pub(super) colours: Vec<[f32; 4]>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// How many normals had no direction.
    pub(super) repaired: usize,
}

/// Reads a primitive; nothing when it is made of points or lines. `place` says which texture coordinates its
/// material's textures are read with.
///
/// # Errors
/// What is wrong, to be put behind the primitive's name.
pub(super) fn read(
    primitive: &gltf::Primitive,
    place: UvPlace,
    transform: DMat4,
    buffers: &Buffers,
) -> Result<Option<Part>, String> {
    let mode = primitive.mode();
    if matches!(
        mode,
        Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip
    ) {
        return Ok(None);
    }
    let Some(positions) = primitive.get(&Semantic::Positions) else {
        return Err("it has no positions".to_owned());
    };
    let named = |what: &str, why: String| format!("its {what} {why}");
    let positions = floats::<3>(&positions, buffers).map_err(|why| named("positions", why))?;
    let count = positions.len();
    let corners = match primitive.indices() {
        Some(accessor) => indices(&accessor, buffers).map_err(|why| named("indices", why))?,
        None => (0..count as u32).collect(),
    };
    if let Some(corner) = corners.iter().find(|corner| **corner as usize >= count) {
        return Err(format!(
            "an index is {corner}, and there are {count} vertices"
        ));
    }
    let mut part = Part {
        triangles: triangles(&corners, mode),
        ..Part::default()
    };
    let vectors = |semantic: Semantic, what: &str| match primitive.get(&semantic) {
        None => Ok(None),
        Some(accessor) => {
            let read = floats::<3>(&accessor, buffers).map_err(|why| named(what, why))?;
            same_count(read, count, what).map(Some)
        }
    };
    let normals = vectors(Semantic::Normals, "normals")?;
    let uvs = |set: u32| match primitive.get(&Semantic::TexCoords(set)) {
        None => Ok(None),
        Some(accessor) => {
            let what = "texture coordinates";
            let read = floats::<2>(&accessor, buffers).map_err(|why| named(what, why))?;
            same_count(read, count, what).map(Some)
        }
    };
    let finite = |[u, v]: [f32; 2]| [u, v].map(|x| if x.is_finite() { x } else { 0.0 });
    part.uvs = match uvs(place.set)? {
        Some(uvs) => uvs.into_iter().map(|uv| finite(place.apply(uv))).collect(),
        None => vec![[0.0; 2]; count],
    };
    if let Some(uvs) = uvs(if place.set == 0 { 1 } else { 0 })? {
        part.second_uvs = uvs.into_iter().map(finite).collect();
    }
    part.colours = match primitive.get(&Semantic::Colors(0)) {
        None => vec![[1.0; 4]; count],
        Some(accessor) => {
            let what = "colours";
            let four = floats::<4>(&accessor, buffers).or_else(|_| {
                let three = floats::<3>(&accessor, buffers)?;
                Ok(three.into_iter().map(|[r, g, b]| [r, g, b, 1.0]).collect())
            });
            same_count(four.map_err(|why: String| named(what, why))?, count, what)?
        }
    };
    let tangents = match primitive.get(&Semantic::Tangents) {
        // Those of a file without normals are for others than these will be.
        Some(accessor) if normals.is_some() => {
            let what = "tangents";
            let read = floats::<4>(&accessor, buffers).map_err(|why| named(what, why))?;
            same_count(read, count, what)?
        }
        _ => Vec::new(),
    };
    place_all(&mut part, &positions, normals, &tangents, transform)?;
    Ok(Some(part))
}

fn same_count<T>(read: Vec<T>, count: usize, what: &str) -> Result<Vec<T>, String> {
    match read.len() == count {
        true => Ok(read),
        false => Err(format!(
            "it has {} {what}, and {count} positions",
            read.len()
        )),
    }
}

/// Corners as triangles, those of strips all wound the same way; without area as the file has them.
fn triangles(corners: &[u32], mode: Mode) -> Vec<[u32; 3]> {
    match mode {
        Mode::TriangleStrip => corners
            .windows(3)
            .enumerate()
            .map(|(i, c)| match i % 2 {
                0 => [c[0], c[1], c[2]],
                _ => [c[0], c[2], c[1]],
            })
            .collect(),
        Mode::TriangleFan => match corners.split_first() {
            Some((hub, rim)) => rim.windows(2).map(|c| [*hub, c[0], c[1]]).collect(),
            None => Vec::new(),
        },
        _ => corners
            .chunks_exact(3)
            .map(|c| [c[0], c[1], c[2]])
            .collect(),
    }
}

/// Moves a primitive to its place: positions, normals, tangents, and the winding where the node mirrors. Without
/// normals each triangle gets its own, and vertices of its own for them.
fn place_all(
    part: &mut Part,
    positions: &[[f32; 3]],
    normals: Option<Vec<[f32; 3]>>,
    tangents: &[[f32; 4]],
    transform: DMat4,
) -> Result<(), String> {
    let linear = DMat3::from_mat4(transform);
    let determinant = linear.determinant();
    let mirrors = determinant < 0.0;
    let normal_matrix = match determinant {
        0.0 => linear,
        _ => linear.inverse().transpose(),
    };
    let vector = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
    for (i, position) in positions.iter().enumerate() {
        let placed = transform.transform_point3(vector(*position)).as_vec3();
        if !placed.is_finite() {
            return Err(format!("the position of vertex {i} is no finite number"));
        }
        part.positions.push(placed.to_array());
    }
    if mirrors {
        for triangle in &mut part.triangles {
            triangle.swap(1, 2);
        }
    }
    let face = |positions: &[[f32; 3]], triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|corner| vector(positions[corner as usize]));
        (b - a).cross(c - a)
    };
    let Some(normals) = normals else {
        flatten(part, face);
        return Ok(());
    };
    let mut faces: Option<Vec<DVec3>> = None;
    for (i, normal) in normals.iter().enumerate() {
        let normal = (normal_matrix * vector(*normal)).try_normalize();
        let normal = match normal.filter(|n| n.is_finite()) {
            Some(normal) => normal,
            None => {
                part.repaired += 1;
                let faces = faces.get_or_insert_with(|| {
                    let mut sums = vec![DVec3::ZERO; part.positions.len()];
                    for triangle in &part.triangles {
                        for corner in triangle {
                            sums[*corner as usize] += face(&part.positions, triangle);
                        }
                    }
                    sums
                });
                faces[i].try_normalize().unwrap_or(DVec3::Z)
            }
        };
        part.normals.push(normal.as_vec3().to_array());
    }
    for [x, y, z, sign] in tangents {
        let tangent = (linear * vector([*x, *y, *z])).try_normalize();
        let Some(tangent) = tangent.filter(|t| t.is_finite()) else {
            // Some would be missing: all are made again.
            part.tangents.clear();
            return Ok(());
        };
        let sign = if (*sign < 0.0) == mirrors { 1.0 } else { -1.0 };
        let tangent = tangent.as_vec3();
        part.tangents.push([tangent.x, tangent.y, tangent.z, sign]);
    }
    Ok(())
}

/// Gives each triangle vertices of its own, with its own normal.
fn flatten(part: &mut Part, face: impl Fn(&[[f32; 3]], &[u32; 3]) -> DVec3) {
    let corners: Vec<usize> = part
        .triangles
        .as_flattened()
        .iter()
        .map(|c| *c as usize)
        .collect();
    let normals = part.triangles.iter().flat_map(|triangle| {
        let normal = face(&part.positions, triangle).try_normalize();
        [normal.unwrap_or(DVec3::Z).as_vec3().to_array(); 3]
    });
    part.normals = normals.collect();
    fn pick<T: Copy>(all: &[T], corners: &[usize]) -> Vec<T> {
        corners
            .iter()
            .filter_map(|c| all.get(*c))
            .copied()
            .collect()
    }
    part.positions = pick(&part.positions, &corners);
    part.uvs = pick(&part.uvs, &corners);
    part.second_uvs = pick(&part.second_uvs, &corners);
    part.colours = pick(&part.colours, &corners);
    let count = part.triangles.len() as u32;
    part.triangles = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
}
