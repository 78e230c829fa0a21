//! Shapes with as many triangles as are wanted, all with normals, texture coordinates and tangents: what a scanner, a
//! sculptor and a potter make.
//!
//! Where parts of a surface meet, positions and normals are the same to the bit, and only texture coordinates and
//! tangents differ: these are seams, not cracks.

use glam::DVec3;
use lodc::scene::mesh::Mesh;
use std::f64::consts::{FRAC_PI_4, TAU};

/// A shape by its name, with about `count` triangles; at least a few hundred, and at most a few millions.
pub(crate) fn shape(name: &str, count: u32) -> Option<Mesh> {
    let count = f64::from(count.clamp(200, 4_000_000));
    match name {
        "rock" => Some(rock((count / 12.0).sqrt().round() as u32)),
        "knot" => {
            let around = (count / 2.0 / 12.0).sqrt().round() as u32;
            Some(knot(
                ((count / 2.0) / f64::from(around)).round() as u32,
                around,
            ))
        }
        "vase" => {
            let around = (count / 2.0).sqrt().round() as u32;
            Some(vase(
                around,
                ((count / 2.0) / f64::from(around)).round() as u32,
            ))
        }
        _ => None,
    }
}

/// A vertex in f64.
struct Point {
    position: DVec3,
    normal: DVec3,
    uv: [f64; 2],
    /// A direction of growing u, not square to the normal yet.
    along: DVec3,
}

/// A grid over a surface, from the top left of the image.
fn add_grid(mesh: &mut Mesh, across: u32, down: u32, at: impl Fn(u32, u32) -> Point) {
    let first = mesh.positions.len() as u32;
    for j in 0..=down {
        for i in 0..=across {
            let Point {
                position,
                normal,
                uv,
                along,
            } = at(i, j);
            let tangent = (along - normal * along.dot(normal)).normalize();
            mesh.positions.push(position.as_vec3().to_array());
            mesh.normals.push(normal.as_vec3().to_array());
            mesh.uvs.push(uv.map(|x| x as f32));
            mesh.tangents.push(tangent.as_vec3().extend(1.0).to_array());
            mesh.colours.push([1.0; 4]);
        }
    }
    let row = across + 1;
    for j in 0..down {
        for i in 0..across {
            let a = first + j * row + i;
            let [b, c, d] = [a + 1, a + row, a + row + 1];
            mesh.indices.extend([a, c, b, b, c, d]);
        }
    }
}

/// How far the rock reaches in a direction, which is a unit vector: octaves of noise, as many as a grid of `n` squares to a
/// right angle can hold, so that a finer scan shows more.
fn reach(direction: DVec3, n: u32) -> f64 {
    let mut sum = 1.0;
    let (mut scale, mut size) = (1.3, 0.22);
    let mut octave = 0;
    while 5.0 * scale <= f64::from(n).max(10.0) {
        sum += size * noise(octave, direction * scale);
        scale *= 2.1;
        size *= 0.47;
        octave += 1;
    }
    sum
}

/// A ball with bumps of all sizes, cut open along the edges of a cube: each face has all of the image.
fn rock(n: u32) -> Mesh {
    let n = n.max(2);
    // Odd to the bit, so that edges are the same from both sides.
    let warped = |i: u32| {
        let x = f64::from(2 * i as i32 - n as i32) / f64::from(n);
        match x.abs() == 1.0 {
            true => x,
            false => libm::tan(x * FRAC_PI_4),
        }
    };
    // The surface is where this is 0: its gradient depends on the place alone, and not on the face.
    let outside = |p: DVec3| p.length() - reach(p.normalize(), n);
    let mut mesh = Mesh::default();
    for (out, right) in [
        (DVec3::X, DVec3::NEG_Z),
        (DVec3::NEG_X, DVec3::Z),
        (DVec3::Y, DVec3::X),
        (DVec3::NEG_Y, DVec3::X),
        (DVec3::Z, DVec3::X),
        (DVec3::NEG_Z, DVec3::NEG_X),
    ] {
        let up = out.cross(right);
        add_grid(&mut mesh, n, n, |i, j| {
            let direction = (out + right * warped(i) - up * warped(j)).normalize();
            let position = direction * reach(direction, n);
            let slope =
                |axis: DVec3| outside(position + axis * 1e-4) - outside(position - axis * 1e-4);
            Point {
                position,
                normal: DVec3::new(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z)).normalize(),
                uv: [i, j].map(|k| f64::from(k) / f64::from(n)),
                along: right,
            }
        });
    }
    mesh
}

/// A (2, 3) torus knot with a relief like that of a rope; the image is eight times along it.
fn knot(along: u32, around: u32) -> Mesh {
    let (along, around) = (along.max(3), around.max(3));
    // What the grid is too coarse for is left out.
    let fine = if around >= 60 { 0.003 } else { 0.0 };
    let middle = |turn: f64| {
        let r = 0.55 + 0.22 * libm::cos(3.0 * turn);
        DVec3::new(
            r * libm::cos(2.0 * turn),
            r * libm::sin(2.0 * turn),
            0.3 * libm::sin(3.0 * turn),
        )
    };
    let at = |turn: f64, angle: f64| {
        let p = middle(turn);
        let ahead = (middle(turn + 1e-4) - middle(turn - 1e-4)).normalize();
        let out = DVec3::new(p.x, p.y, 0.0).normalize();
        let out = (out - ahead * out.dot(ahead)).normalize();
        let strands = libm::cos(3.0 * angle + 24.0 * turn);
        let fibres = libm::cos(15.0 * angle - 96.0 * turn);
        let thickness = 0.16 + 0.02 * strands + fine * fibres;
        p + (out * libm::cos(angle) + ahead.cross(out) * libm::sin(angle)) * thickness
    };
    let mut mesh = Mesh::default();
    add_grid(&mut mesh, along, around, |i, j| {
        // The ends are the same place to the bit.
        let turn = TAU * f64::from(i % along) / f64::from(along);
        let angle = TAU * f64::from(j % around) / f64::from(around);
        let ahead = at(turn + 1e-5, angle) - at(turn - 1e-5, angle);
        let side = at(turn, angle + 1e-5) - at(turn, angle - 1e-5);
        Point {
            position: at(turn, angle),
            normal: side.cross(ahead).normalize(),
            uv: [
                8.0 * f64::from(i) / f64::from(along),
                f64::from(j) / f64::from(around),
            ],
            along: ahead,
        }
    });
    mesh
}

/// A smooth vase, open at the top and at the foot, with one seam from top to foot.
fn vase(around: u32, down: u32) -> Mesh {
    let (around, down) = (around.max(3), down.max(2));
    // Its radius at a height of 1 at the top to -1 at the foot.
    let radius = |y: f64| 0.45 + 0.22 * libm::sin(2.6 * y - 0.9) * (1.0 - 0.3 * y) + 0.04 * y * y;
    let mut mesh = Mesh::default();
    add_grid(&mut mesh, around, down, |i, j| {
        let turn = TAU * f64::from(i % around) / f64::from(around);
        let y = 1.0 - 2.0 * f64::from(j) / f64::from(down);
        let out = DVec3::new(libm::sin(turn), 0.0, libm::cos(turn));
        let slope = (radius(y + 1e-5) - radius(y - 1e-5)) / 2e-5;
        Point {
            position: out * radius(y) + DVec3::Y * y,
            normal: (out - DVec3::Y * slope).normalize(),
            uv: [
                f64::from(i) / f64::from(around),
                f64::from(j) / f64::from(down),
            ],
            along: DVec3::new(out.z, 0.0, -out.x),
        }
    });
    mesh
}

/// Smooth noise of -1..1 over space, from random values at whole coordinates.
fn noise(octave: u64, at: DVec3) -> f64 {
    let cell = at.floor();
    let f = at - cell;
    // Its second derivative vanishes at the corners, so that normals have no creases.
    let w = f * f * f * (f * (f * 6.0 - DVec3::splat(15.0)) + DVec3::splat(10.0));
    let value = |x: u8, y: u8, z: u8| {
        random(
            octave,
            (cell + DVec3::new(x.into(), y.into(), z.into())).to_array(),
        )
    };
    let mix = |a: f64, b: f64, w: f64| a + (b - a) * w;
    let edge = |y: u8, z: u8| mix(value(0, y, z), value(1, y, z), w.x);
    let face = |z: u8| mix(edge(0, z), edge(1, z), w.y);
    mix(face(0), face(1), w.z)
}

/// A random number of -1..1 for a corner.
fn random(octave: u64, corner: [f64; 3]) -> f64 {
    let mut state = octave;
    for x in corner {
        state ^= (x as i64).cast_unsigned();
        state = state.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        state = (state ^ (state >> 29)).wrapping_mul(0xd1b5_4a32_d192_ed03);
        state ^= state >> 32;
    }
    (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}
