//! A mesh that loses one edge after another: its points, their triangles, its seams and borders.
//!
//! The only thing that happens to it is the half-edge collapse: a point is moved onto a neighbour. No vertex is ever made
//! or changed, so that whatever is known of the vertices of the original mesh stays true.
//!
//! A *point* is a place: all vertices with equal coordinates. The *vertices* of a point differ in normal,
//! texture coordinates and so on, or belong to different draws; those that differ in nothing are one *wedge*. An edge is a *seam* at an end
//! of which its two triangles have different wedges. Triangles go by the points when it is asked what is connected, and by the vertices when it is
//! asked how it looks.

mod collapse;
mod fan;

#[cfg(test)]
mod tests;

pub use collapse::{Collapse, FLATTEST, LARGEST_TURN, Refusal};
pub use fan::Kind;

use std::sync::Arc;

use glam::DVec3;

use crate::{Draw, Mesh};

/// The vertices of a triangle that is gone.
const GONE: [u32; 3] = [u32::MAX; 3];

/// A mesh that loses one edge after another.
#[derive(Clone, Debug)]
pub struct Surface {
    /// The point of each vertex of the original mesh.
    point_of: Arc<[u32]>,
    /// The first vertex of the wedge of each vertex.
    wedge_of: Arc<[u32]>,
    /// Where each point is.
    positions: Arc<[DVec3]>,
    /// The vertices of each triangle of the original mesh, or [`GONE`].
    triangles: Vec<[u32; 3]>,
    /// How many of them live.
    live: usize,
    /// The live triangles at each point, sorted.
    stars: Vec<Vec<u32>>,
    /// The vertices of each point that live triangles have, sorted.
    vertices: Vec<Vec<u32>>,
    /// What may happen to each point.
    kinds: Vec<Kind>,
}

impl Surface {
    /// The surface of a mesh.
    ///
    /// Triangles of which two corners are at the same point are left out, and so are copies of a triangle: those with the same
    /// points in the same orientation, in the same draw. Only the first is kept.
    ///
    /// # Panics
    /// When an index is beyond the positions: what reads meshes from files refuses such a one.
    pub fn new(mesh: &Mesh) -> Surface {
        let (point_of, positions) = points(mesh);
        let mut triangles: Vec<[u32; 3]> = mesh.indices.as_chunks::<3>().0.to_vec();
        leave_out(mesh, &point_of, &mut triangles);

        let mut stars = vec![Vec::new(); positions.len()];
        let mut vertices = vec![Vec::new(); positions.len()];
        let mut live = 0;
        for (t, triangle) in (0u32..).zip(&triangles) {
            if *triangle == GONE {
                continue;
            }
            live += 1;
            for &v in triangle {
                let p = point_of[v as usize] as usize;
                stars[p].push(t);
                vertices[p].push(v);
            }
        }
        for vertices in &mut vertices {
            vertices.sort_unstable();
            vertices.dedup();
        }
        let mut surface = Surface {
            kinds: vec![Kind::Fixed; positions.len()],
            wedge_of: wedges(mesh, &point_of).into(),
            point_of: point_of.into(),
            positions: positions.into(),
            triangles,
            live,
            stars,
            vertices,
        };
        for point in 0..surface.points() as u32 {
            surface.kinds[point as usize] = surface.find_kind(point);
        }
        surface
    }

    /// How many points the original has; ids of points are below it. Points that are gone are counted.
    pub fn points(&self) -> usize {
        self.positions.len()
    }

    /// The point of a vertex of the original mesh.
    pub fn point_of(&self, vertex: u32) -> u32 {
        self.point_of[vertex as usize]
    }

    /// Where a point is.
    pub fn position(&self, point: u32) -> DVec3 {
        self.positions[point as usize]
    }

    /// The vertices of a point that live triangles have, sorted; none when the point is gone.
    pub fn vertices(&self, point: u32) -> &[u32] {
        &self.vertices[point as usize]
    }

    /// The vertices of a triangle of the original mesh as it is now; `None` when it is gone.
    pub fn triangle(&self, triangle: u32) -> Option<[u32; 3]> {
        let corners = self.triangles[triangle as usize];
        (corners != GONE).then_some(corners)
    }

    /// The live triangles and their vertices, in the original's order.
    pub fn triangles(&self) -> impl Iterator<Item = (u32, [u32; 3])> {
        (0u32..)
            .zip(&self.triangles)
            .filter(|(_, corners)| **corners != GONE)
            .map(|(t, corners)| (t, *corners))
    }

    /// How many triangles the original has; ids of triangles are below it.
    pub fn triangle_ids(&self) -> usize {
        self.triangles.len()
    }

    /// How many triangles live.
    pub fn triangle_count(&self) -> usize {
        self.live
    }

    /// The live triangles at a point, sorted.
    pub fn around(&self, point: u32) -> &[u32] {
        &self.stars[point as usize]
    }

    /// The points that share an edge with a point, sorted.
    pub fn neighbours(&self, point: u32) -> Vec<u32> {
        let mut found = Vec::with_capacity(2 * self.stars[point as usize].len());
        for &t in &self.stars[point as usize] {
            found.extend(
                self.corners(t)
                    .into_iter()
                    .filter(|corner| *corner != point),
            );
        }
        found.sort_unstable();
        found.dedup();
        found
    }

    /// What may happen to a point.
    pub fn kind(&self, point: u32) -> Kind {
        self.kinds[point as usize]
    }

    /// The live triangles as a mesh, in the original's order, with the vertices that they have, in the original's order.
    /// `original` is the mesh that the surface was made of. A draw that has lost all its triangles stays, empty.
    pub fn mesh(&self, original: &Mesh) -> Mesh {
        const UNUSED: u32 = u32::MAX;
        let mut renamed = vec![UNUSED; original.positions.len()];
        for (_, corners) in self.triangles() {
            for v in corners {
                renamed[v as usize] = 0;
            }
        }
        let kept: Vec<u32> = (0u32..)
            .zip(&renamed)
            .filter(|(_, name)| **name != UNUSED)
            .map(|(v, _)| v)
            .collect();
        for (name, &v) in (0u32..).zip(&kept) {
            renamed[v as usize] = name;
        }
        fn pick<T: Copy>(attribute: &[T], kept: &[u32]) -> Vec<T> {
            if attribute.is_empty() {
                return Vec::new();
            }
            kept.iter().map(|&v| attribute[v as usize]).collect()
        }

        let mut draws = Vec::with_capacity(original.draws.len());
        let (mut vertices, mut triangles) = (0, 0);
        for draw in &original.draws {
            let last_vertex = kept.partition_point(|&v| (v as usize) < draw.vertices.end);
            let alive = self.triangles[draw.triangles.clone()]
                .iter()
                .filter(|corners| **corners != GONE)
                .count();
            draws.push(Draw {
                vertices: vertices..last_vertex.max(vertices),
                triangles: triangles..triangles + alive,
            });
            vertices = last_vertex.max(vertices);
            triangles += alive;
        }
        Mesh {
            positions: pick(&original.positions, &kept),
            normals: pick(&original.normals, &kept),
            uvs: pick(&original.uvs, &kept),
            second_uvs: pick(&original.second_uvs, &kept),
            tangents: pick(&original.tangents, &kept),
            colours: pick(&original.colours, &kept),
            indices: self
                .triangles()
                .flat_map(|(_, corners)| corners.map(|v| renamed[v as usize]))
                .collect(),
            draws,
        }
    }

    /// Whether the edge between two vertices of a live triangle has no triangle on its other side with the same two wedges: a border,
    /// or a seam.
    pub(crate) fn is_open(&self, triangle: u32, from: u32, to: u32) -> bool {
        !self.stars[self.point_of(from) as usize]
            .iter()
            .any(|&other| {
                let corners = self.triangles[other as usize];
                other != triangle && corners.contains(&from) && corners.contains(&to)
            })
    }

    /// The points of a live triangle.
    pub(crate) fn corners(&self, triangle: u32) -> [u32; 3] {
        self.triangles[triangle as usize].map(|v| self.point_of[v as usize])
    }
}

/// The point of each vertex, and the position of each point. Points are numbered as their first vertices are.
fn points(mesh: &Mesh) -> (Vec<u32>, Vec<DVec3>) {
    // Adding 0 makes the two zeros one.
    let key = |v: u32| mesh.positions[v as usize].map(|c| (c + 0.0).to_bits());
    let mut order: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    order.sort_unstable_by_key(|&v| (key(v), v));

    let mut first: Vec<u32> = vec![0; order.len()];
    for same in order.chunk_by(|&a, &b| key(a) == key(b)) {
        for &v in same {
            first[v as usize] = same[0];
        }
    }
    let mut point_of = vec![0; order.len()];
    let mut positions = Vec::new();
    for v in 0..order.len() {
        point_of[v] = if first[v] as usize == v {
            positions.push(glam::Vec3::from(mesh.positions[v]).as_dvec3());
            positions.len() as u32 - 1
        } else {
            point_of[first[v] as usize]
        };
    }
    (point_of, positions)
}

/// The first vertex that each vertex is alike with: at the same point, in the same draw, with the same attributes. Tangents may differ but in
/// their handedness: some exporters give each triangle its own where nothing else differs, and nothing is torn there.
fn wedges(mesh: &Mesh, point_of: &[u32]) -> Vec<u32> {
    fn bits<const N: usize>(attribute: &[[f32; N]], v: u32) -> [u32; N] {
        attribute
            .get(v as usize)
            .map_or([0; N], |value| value.map(|c| (c + 0.0).to_bits()))
    }
    let mut draw_of = vec![0usize; point_of.len()];
    for (number, draw) in mesh.draws().into_iter().enumerate() {
        draw_of[draw.vertices].fill(number);
    }
    let place = |v: u32| (point_of[v as usize], draw_of[v as usize]);
    let looks = |v: u32| {
        let handedness = mesh
            .tangents
            .get(v as usize)
            .is_some_and(|tangent| tangent[3] < 0.0);
        (
            bits(&mesh.normals, v),
            bits(&mesh.uvs, v),
            bits(&mesh.second_uvs, v),
            bits(&mesh.colours, v),
            handedness,
        )
    };
    let mut order: Vec<u32> = (0..point_of.len() as u32).collect();
    order.sort_unstable_by(|&a, &b| {
        place(a)
            .cmp(&place(b))
            .then_with(|| looks(a).cmp(&looks(b)))
            .then(a.cmp(&b))
    });
    let mut wedge_of = vec![0; order.len()];
    for alike in order.chunk_by(|&a, &b| place(a) == place(b) && looks(a) == looks(b)) {
        for &v in alike {
            wedge_of[v as usize] = alike[0];
        }
    }
    wedge_of
}

/// Marks as gone the triangles that have two corners at the same point, and all but the first of those with the same points,
/// orientation and draw.
fn leave_out(mesh: &Mesh, point_of: &[u32], triangles: &mut [[u32; 3]]) {
    let mut seen = Vec::with_capacity(triangles.len());
    for (number, draw) in mesh.draws().into_iter().enumerate() {
        for t in draw.triangles {
            let [a, b, c] = triangles[t].map(|v| point_of[v as usize]);
            if a == b || b == c || c == a {
                triangles[t] = GONE;
                continue;
            }
            let from_smallest = match a.min(b).min(c) {
                first if first == a => [a, b, c],
                first if first == b => [b, c, a],
                _ => [c, a, b],
            };
            seen.push((from_smallest, number, t));
        }
    }
    seen.sort_unstable();
    for same in seen.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        for (.., t) in &same[1..] {
            triangles[*t] = GONE;
        }
    }
}
