//! Meshes for the tests: a hilly field, spheres, tori, soups of triangles; and a generator of random numbers.

use crate::{Draw, Mesh};

/// SplitMix64.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number below `end`.
    pub(crate) fn below(&mut self, end: usize) -> usize {
        (self.next() % end as u64) as usize
    }

    /// A number from 0 to 1.
    pub(crate) fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Vertices in rows, two triangles for each four of them.
fn rows(columns: usize, rows: usize, place: impl Fn(f64, f64) -> [f64; 3]) -> Mesh {
    let mut mesh = Mesh::default();
    for r in 0..=rows {
        for c in 0..=columns {
            let (u, v) = (c as f64 / columns as f64, r as f64 / rows as f64);
            mesh.positions.push(place(u, v).map(|c| c as f32));
            mesh.uvs.push([u as f32, v as f32]);
        }
    }
    let at = |c: usize, r: usize| (r * (columns + 1) + c) as u32;
    for r in 0..rows {
        for c in 0..columns {
            let [a, b, d, e] = [at(c, r), at(c + 1, r), at(c, r + 1), at(c + 1, r + 1)];
            mesh.indices.extend([a, d, b, b, d, e]);
        }
    }
    mesh
}

/// A square from (0, 0) to (1, 1) with random hills of this height: one border, no seam.
pub(crate) fn field(size: usize, height: f64, random: &mut Random) -> Mesh {
    let mut mesh = rows(size, size, |u, v| [u, 0.0, v]);
    for position in &mut mesh.positions {
        position[1] = (height * random.unit()) as f32;
    }
    mesh
}

/// A sphere of radius 1, each meridian and the two poles made of copies of vertices as texture coordinates ask for it: one seam
/// from pole to pole.
pub(crate) fn sphere(columns: usize, rows_of_it: usize) -> Mesh {
    let tau = std::f64::consts::TAU;
    let mut mesh = rows(columns, rows_of_it, |u, v| {
        // The last column is where the first one is, to the bit.
        let (around, down) = (tau * (u % 1.0), 0.5 * tau * v);
        let out = if v == 0.0 || v == 1.0 {
            0.0
        } else {
            down.sin()
        };
        [out * around.cos(), down.cos(), -out * around.sin()]
    });
    mesh.normals = mesh.positions.clone();
    mesh
}

/// A torus without any seam.
pub(crate) fn torus(columns: usize, rows_of_it: usize) -> Mesh {
    let tau = std::f64::consts::TAU;
    let mut mesh = rows(columns, rows_of_it, |u, v| {
        let (around, across) = (tau * (u % 1.0), tau * (v % 1.0));
        let out = 1.0 + 0.4 * across.cos();
        [out * around.cos(), 0.4 * across.sin(), out * around.sin()]
    });
    for index in &mut mesh.indices {
        let (c, r) = (
            *index as usize % (columns + 1) % columns,
            *index as usize / (columns + 1) % rows_of_it,
        );
        *index = (r * (columns + 1) + c) as u32;
    }
    mesh
}

/// The mesh in several draws: each triangle is in the one that `of` names for its middle, with vertices of its own.
pub(crate) fn in_draws(mesh: &Mesh, count: usize, of: impl Fn([f32; 3]) -> usize) -> Mesh {
    let mut parts = Mesh::default();
    for number in 0..count {
        let (vertices, triangles) = (parts.positions.len(), parts.indices.len() / 3);
        let mut renamed = vec![None; mesh.positions.len()];
        for corners in mesh.indices.as_chunks::<3>().0 {
            let middle = [0, 1, 2].map(|i| {
                corners
                    .iter()
                    .map(|&v| mesh.positions[v as usize][i] / 3.0)
                    .sum()
            });
            if of(middle) != number {
                continue;
            }
            for &v in corners {
                let name = *renamed[v as usize].get_or_insert_with(|| {
                    parts.positions.push(mesh.positions[v as usize]);
                    parts.uvs.push(mesh.uvs[v as usize]);
                    parts.positions.len() as u32 - 1
                });
                parts.indices.push(name);
            }
        }
        parts.draws.push(Draw {
            vertices: vertices..parts.positions.len(),
            triangles: triangles..parts.indices.len() / 3,
        });
    }
    parts
}

/// Triangles between random points of a small lattice: every way in which a mesh can be broken.
pub(crate) fn soup(triangles: usize, random: &mut Random) -> Mesh {
    let mut mesh = Mesh::default();
    for _ in 0..triangles * 2 {
        mesh.positions
            .push([0; 3].map(|_| random.below(4) as f32 - 1.5));
        mesh.uvs.push([random.below(2) as f32, 0.0]);
    }
    for _ in 0..3 * triangles {
        mesh.indices.push(random.below(mesh.positions.len()) as u32);
    }
    mesh
}
