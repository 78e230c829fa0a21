//! What a scene draws: a model from a file, or one of the built-in objects, sphere, plane, cube, torus-knot and terrain, about as large as the unit sphere.
//!
//! Each has positions, unit normals, texture coordinates, tangents and colours, and a few thousand triangles.
//! The same bits come out everywhere: trigonometry is libm's, in f64.

use super::camera::Sphere;
use super::chance::finalise;
use super::mesh::Mesh;
use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// What is drawn: a built-in object, or a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Object {
    /// Radius 1; u goes round the y axis, v from pole to pole.
    Sphere,
    /// -1..1 in x and y, facing +z.
    Plane,
    /// -0.75..0.75 along each axis, every face with all of the texture.
    Cube,
    /// A (2, 3) torus knot; u goes along it eight times, v round it once.
    TorusKnot,
    /// Hills over -1..1 in x and z, y up; heights come from the seed.
    Terrain,
    /// Two triangles that have nothing but their vertices' indices, for a vertex stage that reads no more:
    /// one that covers the screen. Scenes cannot name it; it stands in where they name no object.
    Screen,
    /// A model from a file, which scenes name by its path.
    Model,
}

impl Object {
    /// All that scenes can name, with their names.
    pub const ALL: [(&'static str, Self); 5] = [
        ("sphere", Self::Sphere),
        ("plane", Self::Plane),
        ("cube", Self::Cube),
        ("torus-knot", Self::TorusKnot),
        ("terrain", Self::Terrain),
    ];

    /// Its name in a scene.
    pub fn name(self) -> &'static str {
        let mut all = Self::ALL.into_iter();
        all.find(|(_, object)| *object == self).map_or(
            if self == Self::Model {
                "model"
            } else {
                "screen"
            },
            |(name, _)| name,
        )
    }

    /// Its triangles; of a model none, since its file has them. `seed` decides the hills of the terrain and nothing else.
    pub fn mesh(self, seed: u64) -> Mesh {
        match self {
            Self::Sphere => sphere(64, 32),
            Self::Plane => grid(32, |s, t| {
                let p = DVec3::new(2.0 * s - 1.0, 1.0 - 2.0 * t, 0.0);
                Corner::new(p, DVec3::Z, [s, t], DVec3::X)
            }),
            Self::Cube => cube(18),
            Self::TorusKnot => torus_knot(192, 12),
            Self::Terrain => terrain(48, seed),
            Self::Model => Mesh::default(),
            Self::Screen => Mesh {
                positions: vec![[0.0; 3]; 6],
                indices: (0..6).collect(),
                ..Mesh::default()
            },
        }
    }

    /// The part of the sphere of directions from which it is worth looking at: an axis, and the largest
    /// angle from it in radians. A plane has no back, terrain no underside.
    pub(crate) fn visible_from(self) -> (DVec3, f64) {
        match self {
            Self::Plane => (DVec3::Z, 70f64.to_radians()),
            Self::Terrain => (DVec3::Y, 75f64.to_radians()),
            Self::Screen => (DVec3::Z, 0.0),
            Self::Sphere | Self::Cube | Self::TorusKnot | Self::Model => (DVec3::Z, PI),
        }
    }
}

/// The sphere around a mesh: the middle of its box, and the farthest vertex from there.
/// An empty mesh has the unit sphere.
pub fn bounding_sphere(mesh: &Mesh) -> Sphere {
    let points = || {
        mesh.positions
            .iter()
            .map(|p| DVec3::from_array(p.map(f64::from)))
    };
    let (mut low, mut high) = (DVec3::MAX, DVec3::MIN);
    for p in points() {
        (low, high) = (low.min(p), high.max(p));
    }
    let centre = match mesh.positions.is_empty() {
        true => DVec3::ZERO,
        false => (low + high) / 2.0,
    };
    let radius = points().map(|p| p.distance(centre)).fold(0.0, f64::max);
    Sphere {
        centre,
        radius: if radius > 0.0 { radius } else { 1.0 },
    }
}

/// One vertex before it is rounded to f32.
struct Corner {
    position: DVec3,
    normal: DVec3,
    uv: [f64; 2],
    tangent: DVec3,
}

impl Corner {
    /// `along` is any direction of increasing u; the tangent is its part in the surface.
    fn new(position: DVec3, normal: DVec3, uv: [f64; 2], along: DVec3) -> Self {
        let tangent = (along - normal * along.dot(normal)).normalize();
        Self {
            position,
            normal,
            uv,
            tangent,
        }
    }
}

fn push(mesh: &mut Mesh, corner: &Corner) -> u32 {
    let at = mesh.positions.len() as u32;
    let p = corner.position.as_vec3();
    mesh.positions.push(p.to_array());
    mesh.normals.push(corner.normal.as_vec3().to_array());
    mesh.uvs.push(corner.uv.map(|x| x as f32));
    // No texture coordinates here are mirrored: the bitangent points to the top of the image.
    let tangent = corner.tangent.as_vec3().extend(1.0).to_array();
    mesh.tangents.push(tangent);
    // Pale colours that vary over the surface, so that a use of them shows.
    let [r, g, b] = p.to_array().map(|x| 0.8 + 0.2 * x.clamp(-1.0, 1.0));
    mesh.colours.push([r, g, b, 1.0]);
    at
}

/// Two triangles of a quad whose corners run along u first: `[top left, top right, bottom left, bottom right]`
/// of its part of the image.
fn quad(mesh: &mut Mesh, [a, b, c, d]: [u32; 4]) {
    mesh.indices.extend([a, c, b, b, c, d]);
}

/// `n` by `n` quads of a surface given over 0..1 from the top left of the image.
fn grid(n: u32, surface: impl Fn(f64, f64) -> Corner) -> Mesh {
    let mut mesh = Mesh::default();
    add_grid(&mut mesh, n, n, surface);
    mesh
}

fn add_grid(mesh: &mut Mesh, across: u32, down: u32, surface: impl Fn(f64, f64) -> Corner) {
    let first = mesh.positions.len() as u32;
    for j in 0..=down {
        for i in 0..=across {
            let corner = surface(
                f64::from(i) / f64::from(across),
                f64::from(j) / f64::from(down),
            );
            push(mesh, &corner);
        }
    }
    let row = across + 1;
    for j in 0..down {
        for i in 0..across {
            let a = first + j * row + i;
            quad(mesh, [a, a + 1, a + row, a + row + 1]);
        }
    }
}

fn sphere(around: u32, down: u32) -> Mesh {
    let at = |u: f64, v: f64| {
        let (turn, fall) = (TAU * u, PI * v);
        let out = DVec3::new(libm::sin(turn), 0.0, libm::cos(turn));
        // The poles and the seam are exact, so that the surface is closed.
        let across = if v == 0.0 || v == 1.0 {
            0.0
        } else {
            libm::sin(fall)
        };
        let out = if u == 1.0 { DVec3::Z } else { out };
        let normal = out * across + DVec3::Y * libm::cos(fall);
        let east = DVec3::new(out.z, 0.0, -out.x);
        Corner::new(normal, normal, [u, v], east)
    };
    let mut mesh = Mesh::default();
    let step = |i: u32| f64::from(i) / f64::from(around);
    // Each triangle at a pole has a pole of its own, in the middle of its u.
    let poles = |mesh: &mut Mesh, v: f64| -> Vec<u32> {
        (0..around)
            .map(|i| push(mesh, &at((step(i) + step(i + 1)) / 2.0, v)))
            .collect()
    };
    let north = poles(&mut mesh, 0.0);
    let first = mesh.positions.len() as u32;
    for j in 1..down {
        for i in 0..=around {
            push(&mut mesh, &at(step(i), f64::from(j) / f64::from(down)));
        }
    }
    let row = around + 1;
    for j in 0..down - 2 {
        for i in 0..around {
            let a = first + j * row + i;
            quad(&mut mesh, [a, a + 1, a + row, a + row + 1]);
        }
    }
    let south = poles(&mut mesh, 1.0);
    let last = first + (down - 2) * row;
    for i in 0..around {
        let [top, bottom] = [north[i as usize], south[i as usize]];
        mesh.indices.extend([top, first + i, first + i + 1]);
        mesh.indices.extend([bottom, last + i + 1, last + i]);
    }
    mesh
}

fn cube(n: u32) -> Mesh {
    const HALF: f64 = 0.75;
    let mut mesh = Mesh::default();
    // The direction of each face, and of increasing u on it.
    let faces = [
        (DVec3::X, DVec3::NEG_Z),
        (DVec3::NEG_X, DVec3::Z),
        (DVec3::Y, DVec3::X),
        (DVec3::NEG_Y, DVec3::X),
        (DVec3::Z, DVec3::X),
        (DVec3::NEG_Z, DVec3::NEG_X),
    ];
    for (normal, right) in faces {
        let up = normal.cross(right);
        add_grid(&mut mesh, n, n, |s, t| {
            let p = normal + right * (2.0 * s - 1.0) + up * (1.0 - 2.0 * t);
            Corner::new(p * HALF, normal, [s, t], right)
        });
    }
    mesh
}

fn torus_knot(along: u32, around: u32) -> Mesh {
    const THICKNESS: f64 = 0.18;
    let middle = |turn: f64| {
        let r = 0.55 + 0.22 * libm::cos(3.0 * turn);
        DVec3::new(
            r * libm::cos(2.0 * turn),
            r * libm::sin(2.0 * turn),
            0.3 * libm::sin(3.0 * turn),
        )
    };
    let mut mesh = Mesh::default();
    add_grid(&mut mesh, along, around, |s, t| {
        // The ends of both ranges are the same place to the bit.
        let turn = if s == 1.0 { 0.0 } else { TAU * s };
        let angle = if t == 1.0 { 0.0 } else { TAU * t };
        let p = middle(turn);
        let step = 1e-4;
        let ahead = (middle(turn + step) - middle(turn - step)).normalize();
        // Away from the axis of the knot, made square to the curve: a frame without a twist at the seam.
        let out = DVec3::new(p.x, p.y, 0.0).normalize();
        let out = (out - ahead * out.dot(ahead)).normalize();
        let side = ahead.cross(out);
        let normal = out * libm::cos(angle) + side * libm::sin(angle);
        Corner::new(p + normal * THICKNESS, normal, [8.0 * s, t], ahead)
    });
    mesh
}

fn terrain(n: u32, seed: u64) -> Mesh {
    let height = |x: f64, z: f64| hills(seed, DVec2::new(x, z));
    grid(n, |s, t| {
        let (x, z) = (2.0 * s - 1.0, 2.0 * t - 1.0);
        let step = 1e-3;
        let slope_x = (height(x + step, z) - height(x - step, z)) / (2.0 * step);
        let slope_z = (height(x, z + step) - height(x, z - step)) / (2.0 * step);
        let normal = DVec3::new(-slope_x, 1.0, -slope_z).normalize();
        let along = DVec3::new(1.0, slope_x, 0.0);
        Corner::new(DVec3::new(x, height(x, z), z), normal, [s, t], along)
    })
}

/// Octaves of the hills: the finest still has four quads to a hump.
const OCTAVES: u64 = 3;

/// Heights of about -0.3..0.3: smooth noise at three scales.
fn hills(seed: u64, at: DVec2) -> f64 {
    let mut sum = 0.0;
    let (mut scale, mut size) = (1.5, 0.3);
    for octave in 0..OCTAVES {
        sum += size * noise(seed.wrapping_add(octave), at * scale);
        scale *= 2.0;
        size *= 0.45;
    }
    sum
}

/// Smooth noise of -1..1 over the plane, from random values at whole coordinates.
fn noise(seed: u64, at: DVec2) -> f64 {
    let cell = at.floor();
    let f = at - cell;
    // The second derivative vanishes at the corners, so that normals have no creases.
    let w = f * f * f * (f * (f * 6.0 - DVec2::splat(15.0)) + DVec2::splat(10.0));
    let value = |dx: i64, dy: i64| random(seed, cell.x as i64 + dx, cell.y as i64 + dy);
    let top = value(0, 0) + (value(1, 0) - value(0, 0)) * w.x;
    let bottom = value(0, 1) + (value(1, 1) - value(0, 1)) * w.x;
    top + (bottom - top) * w.y
}

/// A random number of -1..1 for a seed and a cell.
fn random(seed: u64, x: i64, y: i64) -> f64 {
    let z = seed
        .wrapping_mul(0x9e37_79b9_7f4a_7c15)
        .wrapping_add(x.cast_unsigned().wrapping_mul(0xd1b5_4a32_d192_ed03))
        .wrapping_add(y.cast_unsigned().wrapping_mul(0x8cb9_2ba7_2f3d_8dd7));
    (finalise(z) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    fn v(a: [f32; 3]) -> DVec3 {
        DVec3::from_array(a.map(f64::from))
    }

    fn triangles(mesh: &Mesh) -> impl Iterator<Item = [usize; 3]> + '_ {
        let corners = mesh.indices.chunks_exact(3);
        corners.map(|t| [t[0] as usize, t[1] as usize, t[2] as usize])
    }

    fn face_normal(mesh: &Mesh, t: [usize; 3]) -> DVec3 {
        let [a, b, c] = t.map(|i| v(mesh.positions[i]));
        (b - a).cross(c - a)
    }

    #[test]
    fn every_object_is_complete() {
        for (name, object) in Object::ALL {
            let mesh = object.mesh(1);
            let n = mesh.positions.len();
            assert_eq!(object.name(), name);
            assert!(
                [
                    mesh.normals.len(),
                    mesh.uvs.len(),
                    mesh.tangents.len(),
                    mesh.colours.len()
                ]
                .iter()
                .all(|&l| l == n),
                "{name}"
            );
            let count = mesh.indices.len() / 3;
            assert!(
                (1000..8000).contains(&count),
                "{name} has {count} triangles"
            );
            assert!(mesh.indices.iter().all(|&i| (i as usize) < n));
            let sphere = bounding_sphere(&mesh);
            assert!((0.8..1.7).contains(&sphere.radius), "{name}: {sphere:?}");
            assert!(
                mesh.positions
                    .iter()
                    .all(|p| v(*p).distance(sphere.centre) <= sphere.radius + 1e-9)
            );
        }
    }

    #[test]
    fn normals_are_unit_and_tangents_orthogonal_to_them() {
        for (name, object) in Object::ALL {
            let mesh = object.mesh(3);
            for (normal, tangent) in mesh.normals.iter().zip(&mesh.tangents) {
                let t = v([tangent[0], tangent[1], tangent[2]]);
                assert!(
                    (v(*normal).length() - 1.0).abs() < 1e-6,
                    "{name} {normal:?}"
                );
                assert!((t.length() - 1.0).abs() < 1e-6, "{name} {tangent:?}");
                assert!(v(*normal).dot(t).abs() < 1e-6, "{name}");
                assert_eq!(tangent[3], 1.0);
            }
        }
    }

    #[test]
    fn triangles_are_counter_clockwise_and_agree_with_their_normals() {
        for (name, object) in Object::ALL {
            let mesh = object.mesh(1);
            for t in triangles(&mesh) {
                let face = face_normal(&mesh, t);
                assert!(face.length() > 1e-9, "{name}: a triangle without area");
                let mean: DVec3 = t.iter().map(|&i| v(mesh.normals[i])).sum();
                assert!(face.normalize().dot(mean.normalize()) > 0.8, "{name} {t:?}");
            }
        }
    }

    #[test]
    fn tangents_follow_u_and_the_bitangent_points_to_the_top_of_the_image() {
        for (name, object) in Object::ALL {
            let mesh = object.mesh(1);
            for t in triangles(&mesh) {
                let [a, b, c] = t.map(|i| v(mesh.positions[i]));
                let [ua, ub, uc] = t.map(|i| DVec2::from_array(mesh.uvs[i].map(f64::from)));
                let (e1, e2, d1, d2) = (b - a, c - a, ub - ua, uc - ua);
                let area = d1.x * d2.y - d2.x * d1.y;
                assert!(
                    area.abs() > 1e-12,
                    "{name}: texture coordinates without area"
                );
                let along_u = ((e1 * d2.y - e2 * d1.y) / area).normalize();
                let along_v = ((e2 * d1.x - e1 * d2.x) / area).normalize();
                // The map of a slope is skewed, the frame is not.
                for i in t {
                    let tangent = mesh.tangents[i];
                    let tv = v([tangent[0], tangent[1], tangent[2]]);
                    let bitangent = v(mesh.normals[i]).cross(tv) * f64::from(tangent[3]);
                    assert!(tv.dot(along_u) > 0.6, "{name} {t:?}: {}", tv.dot(along_u));
                    assert!(bitangent.dot(along_v) < -0.5, "{name} {t:?}");
                }
            }
        }
    }

    #[test]
    fn closed_objects_are_closed() {
        for object in [Object::Sphere, Object::Cube, Object::TorusKnot] {
            let mesh = object.mesh(1);
            // Each edge between two places is walked once in each direction.
            let place = |i: usize| mesh.positions[i].map(|x| (f64::from(x) * 1e5).round() as i64);
            let mut edges: BTreeMap<_, i32> = BTreeMap::new();
            for [a, b, c] in triangles(&mesh) {
                for (from, to) in [(a, b), (b, c), (c, a)] {
                    let (from, to) = (place(from), place(to));
                    *edges.entry((from.min(to), from.max(to))).or_default() +=
                        if from < to { 1 } else { -1 };
                }
            }
            assert!(edges.values().all(|&sum| sum == 0), "{}", object.name());
        }
    }

    #[test]
    fn the_seed_decides_the_hills_and_only_them() {
        assert_eq!(Object::Terrain.mesh(1), Object::Terrain.mesh(1));
        assert_ne!(Object::Terrain.mesh(1), Object::Terrain.mesh(2));
        assert_eq!(Object::Sphere.mesh(1), Object::Sphere.mesh(2));
        let heights = Object::Terrain.mesh(1).positions.into_iter().map(|p| p[1]);
        let (low, high) = heights.fold((0f32, 0f32), |(l, h), y| (l.min(y), h.max(y)));
        assert!(
            low < -0.05 && high > 0.05 && low > -0.6 && high < 0.6,
            "{low} {high}"
        );
    }

    #[test]
    fn an_empty_mesh_has_a_sphere_too() {
        assert_eq!(bounding_sphere(&Mesh::default()).radius, 1.0);
        assert_eq!(bounding_sphere(&Object::Screen.mesh(1)).radius, 1.0);
    }
}
