//! Inputs that a shader should hold, built from its interface and its scene.
//!
//! Reachable ones are what the scene's pictures show. Declared ones are at the corners of what the interface allows, and
//! beyond what a picture happens to show: vanishing and unnormalised normals, degenerate triangles, attributes extrapolated
//! as multisampling does, an eye or a light in the surface, time after a week. They are quads of fragments on triangles that no mesh has, in groups
//! that share their uniforms. Of what is chosen for each dimension every pair is met, as far as the budget goes.

use crate::eval::machine::{Bindings, Resource};
use crate::eval::raster::{Frame, Spot};
use crate::scene::chance::{child, mix, unit};
use crate::scene::mesh::Mesh;
use crate::scene::{Freedom, Scene, Semantic};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::sync::Arc;

/// Quads in a group: a block of lanes.
pub(crate) const QUADS: usize = 64;

/// A number of a corner: where each attribute begins.
const POSITION: usize = 0;
const NORMAL: usize = 3;
const UV: usize = 6;
const SECOND_UV: usize = 8;
const TANGENT: usize = 10;
const COLOUR: usize = 14;
/// How many there are.
const NUMBERS: usize = 18;

/// What a vertex holds: position, normal, both sets of texture coordinates, tangent, colour.
pub(crate) type Corner = [f32; NUMBERS];

/// A quad of fragments on a triangle of its own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Quad {
    pub(crate) corners: [Corner; 3],
    /// For each of the four fragments, what each corner weighs.
    pub(crate) weights: [[f64; 3]; 4],
}

/// Quads that share their uniforms.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Group {
    /// Which of the scene's pictures at the nearest distance has the other uniforms, matrices above all.
    pub(crate) picture: usize,
    /// Uniforms by their paths, and what they hold.
    pub(crate) values: Vec<(String, Vec<f64>)>,
    pub(crate) quads: Vec<Quad>,
}

impl Quad {
    /// A small one at a place of a triangle: what its second and third corner weigh.
    fn at(corners: [Corner; 3], at: [f64; 2]) -> Self {
        let weights = [0.0, 1.0, 2.0, 3.0].map(|j: f64| {
            let (b, c) = (at[0] + (j % 2.0) * SMALL, at[1] + (j / 2.0).floor() * SMALL);
            [1.0 - b - c, b, c]
        });
        Self { corners, weights }
    }
}

/// A way from the quads of one group to those of another.
pub(crate) struct Way {
    /// Whether its triangles are wider than the mesh's.
    pub(crate) is_wide: bool,
    /// Where it begins and where it ends: the same triangles, with other uniforms or at other places.
    pub(crate) ends: [Group; 2],
}

/// Groups of ways across triangles of the mesh, and as many across wider ones.
const CROSSED: usize = 4;
/// Groups of ways of a uniform, and quads in each: each of their places needs a run of its own.
const TURNED: usize = 8;
const TURNED_QUADS: usize = 4;
/// The extent of a small quad, as a share of its triangle.
const SMALL: f64 = 1e-3;

/// What a shader's declared inputs are made from.
pub(crate) struct Interface<'a> {
    scene: &'a Scene,
    /// The scene's pictures at the nearest distance.
    pub(crate) pictures: Vec<Frame>,
    pub(crate) freedoms: Vec<Freedom>,
    seed: u64,
}

/// What time a shader has run for: a week, in seconds, and some.
const A_WEEK: f64 = 604_800.37;

/// Words in the names of uniforms that are meant to be 0 to 1.
const SHARES: [&str; 14] = [
    "roughness",
    "rough",
    "metallic",
    "metalness",
    "alpha",
    "gloss",
    "opacity",
    "strength",
    "amount",
    "blend",
    "mix",
    "occlusion",
    "smoothness",
    "wetness",
];

impl<'a> Interface<'a> {
    pub(crate) fn new(scene: &'a Scene, seed: u64) -> Self {
        Self {
            scene,
            pictures: scene.frames(scene.nearest),
            freedoms: scene.freedoms(),
            seed,
        }
    }

    /// Ways through the inputs, each from the quads of one group to those of another, in their order.
    ///
    /// First come ways across triangles of the mesh, then across triangles between any three of its vertices, a quarter of
    /// them far from where texture coordinates are small; then, for each uniform that may be several things, ways on which
    /// that changes and nothing else.
    pub(crate) fn ways(&self) -> Vec<Way> {
        let mut ways = Vec::new();
        for number in 0..2 * CROSSED {
            let seed = child(self.seed, 1_000_000 + number as u64);
            let is_wide = number >= CROSSED;
            let mut begin = Group {
                picture: mix(seed) as usize % self.pictures.len().max(1),
                values: Vec::new(),
                quads: Vec::new(),
            };
            let mut end = begin.clone();
            for quad in 0..QUADS as u64 {
                let seed = child(seed, 100 + quad);
                let mut corners = self.corners(seed);
                if is_wide {
                    for (c, corner) in corners.iter_mut().enumerate() {
                        [*corner, ..] = self.corners(child(seed, c as u64));
                        if quad % 4 == 0 {
                            corner[UV] += 1e6;
                            corner[UV + 1] -= 1e6;
                        }
                    }
                }
                begin.quads.push(Quad::at(corners, [0.0, 0.0]));
                end.quads.push(Quad::at(corners, [1.0, 0.0]));
            }
            ways.push(Way {
                is_wide,
                ends: [begin, end],
            });
        }
        for (number, freedom) in self.freedoms.iter().enumerate() {
            let seed = child(self.seed, 2_000_000 + number as u64);
            // The ends of a range, 0 and 1; a light that turns from the eye; a week.
            let [low, high] = match freedom.semantic {
                Some(Semantic::LightDirection) => [1, 3],
                Some(Semantic::Time) | None => [1, 2],
                Some(_) => continue,
            };
            if self.choices(freedom) <= high || ways.len() >= 2 * CROSSED + TURNED {
                continue;
            }
            let picture = mix(seed) as usize % self.pictures.len().max(1);
            let all = (0..TURNED_QUADS as u64).map(|quad| self.corners(child(seed, quad)));
            let all: Vec<[Corner; 3]> = all.collect();
            let third = 1.0 / 3.0;
            let group = |choice: usize| {
                let value = self.value(freedom, choice, picture, all.first()?)?;
                let quads = all.iter().map(|corners| Quad::at(*corners, [third, third]));
                Some(Group {
                    picture,
                    values: vec![(freedom.path().to_owned(), value)],
                    quads: quads.collect(),
                })
            };
            if let (Some(begin), Some(end)) = (group(low), group(high))
                && begin != end
            {
                ways.push(Way {
                    is_wide: false,
                    ends: [begin, end],
                });
            }
        }
        ways
    }

    /// The frame of a group: its picture with its uniforms, and a mesh of its triangles.
    pub(crate) fn frame(&self, group: &Group) -> Frame {
        let picture = &self.pictures[group.picture % self.pictures.len()];
        let mut bindings = picture.bindings.clone();
        for (path, numbers) in &group.values {
            for freedom in self.freedoms.iter().filter(|f| f.path() == path) {
                write(&mut bindings, freedom, numbers);
            }
        }
        self.scene.refill(&mut bindings, 1);
        let corners = group.quads.iter().flat_map(|quad| quad.corners);
        let mut mesh = Mesh::default();
        for corner in corners {
            let two = |at: usize| [corner[at], corner[at + 1]];
            let three = |at: usize| [corner[at], corner[at + 1], corner[at + 2]];
            let four = |at: usize| [corner[at], corner[at + 1], corner[at + 2], corner[at + 3]];
            mesh.positions.push(three(POSITION));
            mesh.normals.push(three(NORMAL));
            mesh.uvs.push(two(UV));
            mesh.second_uvs.push(two(SECOND_UV));
            mesh.tangents.push(four(TANGENT));
            mesh.colours.push(four(COLOUR));
        }
        mesh.indices = (0..mesh.positions.len() as u32).collect();
        Frame {
            mesh: Arc::new(mesh),
            bindings,
            ..picture.clone()
        }
    }

    /// The places of a group's fragments.
    pub(crate) fn spots(group: &Group) -> Vec<Spot> {
        let quads = group.quads.iter().enumerate();
        quads
            .map(|(i, quad)| Spot {
                triangle: i as u32,
                weights: quad.weights,
            })
            .collect()
    }

    /// Groups that meet, pair by pair, what the interface declares.
    pub(crate) fn declared(&self, count: usize) -> Vec<Group> {
        let choices: Vec<usize> = self.freedoms.iter().map(|f| self.choices(f)).collect();
        let mut uniforms = Pairs::new(choices, child(self.seed, 1));
        let dimensions = Bend::DIMENSIONS.to_vec();
        let mut quads = Pairs::new(dimensions, child(self.seed, 2));
        let all = (0..count).map(|number| {
            let seed = child(self.seed, 3 + number as u64);
            let chosen = uniforms.next();
            let picture = mix(seed) as usize % self.pictures.len().max(1);
            let first = self.corners(child(seed, 9));
            let mut group = Group {
                picture,
                values: Vec::new(),
                quads: Vec::new(),
            };
            for (freedom, choice) in self.freedoms.iter().zip(chosen) {
                if let Some(value) = self.value(freedom, choice, picture, &first) {
                    group.values.push((freedom.path().to_owned(), value));
                }
            }
            // The eye and the lights as they are by now.
            let frame = &self.frame(&group);
            let towards = self.towards(frame);
            for quad in 0..QUADS {
                let corners = match quad {
                    0 => first,
                    _ => self.corners(child(seed, 100 + quad as u64)),
                };
                let bend = Bend(quads.next());
                group.quads.push(bend.quad(corners, &towards));
            }
            group
        });
        all.collect()
    }

    /// How many values are chosen from for a uniform, the scene's own among them.
    fn choices(&self, freedom: &Freedom) -> usize {
        match freedom.semantic {
            Some(Semantic::Time) => 4,
            Some(Semantic::CameraPosition | Semantic::LightPosition) => 5,
            Some(Semantic::LightDirection) => 6,
            Some(_) => 1,
            None if freedom.is_matrix() => 1,
            None if freedom.is_any => 7,
            None => 4,
        }
    }

    /// One of the values of a uniform; nothing for the scene's own.
    fn value(
        &self,
        freedom: &Freedom,
        choice: usize,
        picture: usize,
        triangle: &[Corner; 3],
    ) -> Option<Vec<f64>> {
        let choice = choice.checked_sub(1)?;
        let frame = self.pictures.get(picture)?;
        let centre = [0, 1, 2].map(|c| {
            let corners = triangle
                .iter()
                .map(|corner| f64::from(corner[POSITION + c]));
            corners.sum::<f64>() / 3.0
        });
        let surface = self.scene.model.transform_point3(DVec3::from(centre));
        let eye = self.scene.eye(frame);
        let three = |v: DVec3| {
            let mut numbers = v.to_array().to_vec();
            numbers.resize(freedom.len(), 1.0);
            numbers
        };
        Some(match freedom.semantic {
            Some(Semantic::Time) => vec![[0.0, A_WEEK, 1e-3][choice]],
            Some(Semantic::CameraPosition | Semantic::LightPosition) => three(match choice {
                0 => surface,
                1 => surface + DVec3::splat(1e-6 * self.scene.sphere.radius),
                2 => self.scene.sphere.centre + DVec3::Y * (1e4 * self.scene.sphere.radius),
                _ => self.scene.sphere.centre,
            }),
            Some(Semantic::LightDirection) => {
                let view = (eye - surface).normalize_or_zero();
                let mut numbers = three(match choice {
                    0 => view,
                    1 => -view,
                    2 => view.any_orthonormal_vector(),
                    3 => DVec3::Y,
                    _ => DVec3::NEG_Y,
                });
                numbers.truncate(freedom.len());
                numbers
            }
            Some(_) => return None,
            None if freedom.is_any => {
                let own = freedom.values.first()?;
                let words = crate::front::names::words(freedom.path());
                let is_share = words.iter().any(|word| SHARES.contains(&&**word));
                let of = |number: f64| match (is_share, choice) {
                    (_, 0) => 0.0,
                    (_, 1) => 1.0,
                    (true, 2) => 0.05,
                    (true, 3) => 1e-4,
                    (true, 4) => 0.045,
                    (true, _) => 0.5,
                    (false, 2) => -0.0,
                    (false, 3) => f64::from(f32::MIN_POSITIVE),
                    (false, 4) => 1.0 + f64::from(f32::EPSILON),
                    (false, _) => -number,
                };
                own.iter().map(|number| of(*number)).collect()
            }
            None => {
                let (first, last) = (freedom.values.first()?, freedom.values.last()?);
                match choice {
                    0 => first.clone(),
                    1 => last.clone(),
                    _ => {
                        let pairs = first.iter().zip(last);
                        pairs.map(|(low, high)| low + (high - low) * 0.5).collect()
                    }
                }
            }
        })
    }

    /// The corners of one of the mesh's triangles.
    fn corners(&self, seed: u64) -> [Corner; 3] {
        let mesh = &*self.scene.mesh;
        let triangles = mesh.indices.len() / 3;
        let triangle = (unit(seed) * triangles as f64) as usize;
        [0, 1, 2].map(|c| {
            let mut corner = [0.0; NUMBERS];
            let vertex = mesh.indices.get(3 * triangle + c).copied().unwrap_or(0) as usize;
            let mut put = |at: usize, numbers: Option<&[f32]>| {
                let numbers = numbers.unwrap_or_default();
                corner[at..at + numbers.len()].copy_from_slice(numbers);
            };
            put(POSITION, mesh.positions.get(vertex).map(|v| &v[..]));
            put(NORMAL, mesh.normals.get(vertex).map(|v| &v[..]));
            put(UV, mesh.uvs.get(vertex).map(|v| &v[..]));
            let second = mesh.second_uvs.get(vertex).or(mesh.uvs.get(vertex));
            put(SECOND_UV, second.map(|v| &v[..]));
            let tangent = mesh
                .tangents
                .get(vertex)
                .map_or(&[1.0, 0.0, 0.0, 1.0], |v| v);
            put(TANGENT, Some(tangent));
            let colour = mesh.colours.get(vertex).map_or(&[1.0; 4], |v| v);
            put(COLOUR, Some(colour));
            corner
        })
    }

    /// From a place of a frame's surface, in object space, towards the eye, as normals are in object space.
    fn towards(&self, frame: &Frame) -> Towards {
        let at = self.freedoms.iter().find_map(|freedom| {
            (freedom.semantic == Some(Semantic::CameraPosition))
                .then(|| read(&frame.bindings, freedom))
                .flatten()
        });
        let eye = match at.as_deref() {
            Some([x, y, z, ..]) => DVec3::new(*x, *y, *z),
            _ => self.scene.eye(frame),
        };
        Towards {
            eye: self.scene.model.inverse().transform_point3(eye),
            // A normal goes through the inverse transpose.
            back: glam::DMat3::from_mat4(self.scene.model),
        }
    }

    /// Another group near a quad of one: its uniforms and its quads each off by a little or by much.
    pub(crate) fn near(&self, group: &Group, quad: &Quad, seed: u64) -> Group {
        let mut near = Group {
            quads: Vec::with_capacity(QUADS),
            ..group.clone()
        };
        let number = |place: u64| unit(child(seed, place));
        if !self.freedoms.is_empty() && number(0) < 0.5 {
            let which = (number(1) * self.freedoms.len() as f64) as usize;
            let freedom = &self.freedoms[which];
            let frame = self.frame(group);
            let own = read(&frame.bindings, freedom).unwrap_or_default();
            if self.choices(freedom) > 1 {
                let moved = own.iter().enumerate();
                let moved = moved.map(|(i, x)| step(*x, child(seed, 10 + i as u64)));
                let moved = self.within(freedom, moved.collect());
                near.values.retain(|(path, _)| path != freedom.path());
                near.values.push((freedom.path().to_owned(), moved));
            }
        }
        for i in 0..QUADS as u64 {
            let seed = child(seed, 1000 + i);
            let mut quad = quad.clone();
            // The first stays, so that uniforms alone are moved too.
            if i > 0 {
                let attribute = (unit(child(seed, 0)) * 7.0) as usize;
                let range = match attribute {
                    0 => POSITION..NORMAL,
                    1 | 2 => NORMAL..UV,
                    3 => UV..TANGENT,
                    4 => TANGENT..COLOUR,
                    5 => COLOUR..NUMBERS,
                    _ => 0..0,
                };
                let together = unit(child(seed, 1)) < 0.5;
                for (c, corner) in quad.corners.iter_mut().enumerate() {
                    for at in range.clone() {
                        let own = if together { 0 } else { c as u64 };
                        let moved = step(corner[at].into(), child(seed, 2 + at as u64 + 50 * own));
                        corner[at] = moved as f32;
                    }
                }
                if range.is_empty() {
                    let by = [0, 1].map(|c| step(0.0, child(seed, 300 + c)));
                    for weights in &mut quad.weights {
                        weights[1] += by[0];
                        weights[2] += by[1];
                        weights[0] = 1.0 - weights[1] - weights[2];
                    }
                }
                if attribute == 5 {
                    for corner in &mut quad.corners {
                        for number in &mut corner[COLOUR..NUMBERS] {
                            *number = number.clamp(0.0, 1.0);
                        }
                    }
                }
            }
            near.quads.push(quad);
        }
        near
    }

    /// Numbers within what a uniform declares.
    fn within(&self, freedom: &Freedom, mut numbers: Vec<f64>) -> Vec<f64> {
        if let (false, None, Some(first), Some(last)) = (
            freedom.is_any,
            freedom.semantic,
            freedom.values.first(),
            freedom.values.last(),
        ) {
            for ((number, a), b) in numbers.iter_mut().zip(first).zip(last) {
                *number = number.clamp(a.min(*b), a.max(*b));
            }
        }
        if freedom.semantic == Some(Semantic::LightDirection)
            && let [x, y, z, ..] = &mut numbers[..]
        {
            let unit = DVec3::new(*x, *y, *z).normalize_or(DVec3::Y);
            [*x, *y, *z] = unit.to_array();
        }
        if freedom.semantic == Some(Semantic::Time) {
            numbers
                .iter_mut()
                .for_each(|t| *t = t.clamp(0.0, 2.0 * A_WEEK));
        }
        let words = crate::front::names::words(freedom.path());
        if freedom.is_any && words.iter().any(|word| SHARES.contains(&&**word)) {
            numbers.iter_mut().for_each(|x| *x = x.clamp(0.0, 1.0));
        }
        numbers
    }
}

/// A number off by a little or by much: anything between a rounding and itself, or its opposite, or 0.
fn step(number: f64, seed: u64) -> f64 {
    let size = 10_f64.powf(-7.0 + 7.5 * unit(child(seed, 0)));
    let sign = if unit(child(seed, 1)) < 0.5 {
        -1.0
    } else {
        1.0
    };
    match (unit(child(seed, 2)) * 10.0) as u32 {
        0 => -number,
        1 => 0.0,
        2..=5 => number * (1.0 + sign * size),
        6 | 7 => number + sign * size,
        _ => number,
    }
}

fn bytes_of(resource: &Resource) -> Option<&Arc<Vec<u8>>> {
    match resource.of_draw(0) {
        Some(Resource::Buffer(bytes)) => Some(bytes),
        _ => None,
    }
}

fn write(bindings: &mut Bindings, freedom: &Freedom, numbers: &[f64]) {
    let Some(bytes) = bindings.get(&freedom.at).and_then(bytes_of) else {
        return;
    };
    let mut bytes = bytes.to_vec();
    freedom.write(numbers, &mut bytes);
    bindings.insert(freedom.at, Resource::Buffer(Arc::new(bytes)));
}

/// What a uniform holds in a frame.
pub(crate) fn read(bindings: &Bindings, freedom: &Freedom) -> Option<Vec<f64>> {
    let bytes = bindings.get(&freedom.at).and_then(bytes_of)?;
    Some(freedom.read(bytes))
}

/// Where the eye is.
struct Towards {
    /// In object space.
    eye: DVec3,
    /// What turns a normal in world space into one in object space.
    back: glam::DMat3,
}

/// What is done to a triangle and where on it a quad is: a choice for each dimension, 0 for none.
struct Bend(Vec<usize>);

impl Bend {
    /// Positions, normals, texture coordinates, tangents, colours, place, extent.
    const DIMENSIONS: [usize; 7] = [4, 12, 7, 5, 4, 7, 4];

    fn quad(&self, mut corners: [Corner; 3], towards: &Towards) -> Quad {
        let [position, normal, uv, tangent, colour, place, extent] =
            std::array::from_fn(|i| self.0.get(i).copied().unwrap_or(0));
        let set = |corner: &mut Corner, at: usize, v: DVec3| {
            for (number, x) in corner[at..at + 3].iter_mut().zip(v.to_array()) {
                *number = x as f32;
            }
        };
        let get = |corner: &Corner, at: usize| {
            DVec3::new(
                corner[at].into(),
                corner[at + 1].into(),
                corner[at + 2].into(),
            )
        };
        let first = corners[0];
        for (c, corner) in corners.iter_mut().enumerate() {
            let own = get(&first, POSITION);
            match position {
                1 => set(corner, POSITION, own),
                2 => set(corner, POSITION, own + DVec3::X * (c as f64) * 1e-3),
                3 => set(corner, POSITION, DVec3::ZERO),
                _ => {}
            }
            let n = get(corner, NORMAL);
            let at = get(corner, POSITION);
            let view = (towards.eye - at).normalize_or(DVec3::Z);
            let across = view.any_orthonormal_vector();
            let turned = |v: DVec3| towards.back.transpose() * v;
            let opposite = if c == 0 { 1.0 } else { -1.0 };
            match normal {
                1 => set(corner, NORMAL, n * 1e-3),
                2 => set(corner, NORMAL, n * 1e3),
                3 => set(corner, NORMAL, DVec3::ZERO),
                // They cancel half-way along an edge.
                4 => set(corner, NORMAL, get(&first, NORMAL) * opposite),
                // They cancel in the middle.
                5 => {
                    let turn = std::f64::consts::TAU / 3.0 * c as f64;
                    let (sine, cosine) = (libm::sin(turn), libm::cos(turn));
                    set(corner, NORMAL, across * cosine + view.cross(across) * sine);
                }
                6 => set(corner, NORMAL, n * (1.0 + 2.0 * f64::from(f32::EPSILON))),
                7 => set(corner, NORMAL, turned(across)),
                8 => set(corner, NORMAL, turned(across - view * 1e-6)),
                9 => set(corner, NORMAL, turned(view)),
                10 => set(corner, NORMAL, turned(-view)),
                11 => set(corner, NORMAL, n * 1e-20),
                _ => {}
            }
            let uvs = match uv {
                1 => Some([0.0, 0.0]),
                2 => Some([1.0, 1.0]),
                3 => Some([1e6 + 0.3, -1e6 + 0.7]),
                4 => Some([1e3 * c as f32, -1e3 * (c as f32)]),
                5 => Some([first[UV], first[UV + 1]]),
                6 => Some([-0.25, 2.0]),
                _ => None,
            };
            if let Some(uvs) = uvs {
                corner[UV..UV + 2].copy_from_slice(&uvs);
                corner[SECOND_UV..SECOND_UV + 2].copy_from_slice(&uvs);
            }
            let t = get(&first, TANGENT);
            let n = get(corner, NORMAL);
            match tangent {
                1 => set(corner, TANGENT, n),
                2 => set(corner, TANGENT, DVec3::ZERO),
                3 => set(corner, TANGENT, t * opposite),
                4 => set(corner, TANGENT, t * 1e-3),
                _ => {}
            }
            let colours = match colour {
                1 => Some([0.0; 4]),
                2 => Some([1.0; 4]),
                3 => Some([0.0, 1.0, 0.5, 0.0]),
                _ => None,
            };
            if let Some(colours) = colours {
                corner[COLOUR..NUMBERS].copy_from_slice(&colours);
            }
        }
        let third = 1.0 / 3.0;
        let at = match place {
            0 => [third, third],
            1 => [0.0, 0.0],
            2 => [0.5, 0.0],
            3 => [0.5, 0.5],
            // As far beyond an edge as a sample of a pixel is from its centre, on a triangle of a few pixels.
            4 => [-0.2, 0.6],
            5 => [1.2, -0.1],
            _ => [0.1, 0.85],
        };
        let size = [1e-3, 0.0, 0.1, 0.5][extent.min(3)];
        let weights = [0.0, 1.0, 2.0, 3.0].map(|j: f64| {
            let (x, y) = ((j % 2.0) * size, (j / 2.0).floor() * size);
            let (b, c) = (at[0] + x, at[1] + y);
            [1.0 - b - c, b, c]
        });
        Quad { corners, weights }
    }
}

/// Chooses one of several for each of some dimensions, again and again, so that soon each pair of choices was met.
struct Pairs {
    counts: Vec<usize>,
    met: BTreeSet<[usize; 4]>,
    seed: u64,
}

/// How many are thought of for each that is chosen.
const THOUGHT_OF: u64 = 8;

impl Pairs {
    fn new(counts: Vec<usize>, seed: u64) -> Self {
        Self {
            counts,
            met: BTreeSet::new(),
            seed,
        }
    }

    fn next(&mut self) -> Vec<usize> {
        let pairs = |chosen: &[usize]| -> Vec<[usize; 4]> {
            let all = 0..chosen.len();
            let both = all.flat_map(|i| (i + 1..chosen.len()).map(move |j| (i, j)));
            both.map(|(i, j)| [i, chosen[i], j, chosen[j]]).collect()
        };
        let mut best: Option<(usize, Vec<usize>)> = None;
        for _ in 0..THOUGHT_OF {
            self.seed = mix(self.seed);
            let counts = self.counts.iter().enumerate();
            let chosen: Vec<usize> = counts
                .map(|(i, count)| {
                    // What is as usual leaves others to be seen.
                    let share = unit(child(self.seed, i as u64));
                    match unit(child(self.seed, 1000 + i as u64)) < 0.35 {
                        true => 0,
                        false => (share * *count as f64) as usize,
                    }
                })
                .collect();
            let new = pairs(&chosen);
            let new = new.iter().filter(|pair| !self.met.contains(*pair)).count();
            if best.as_ref().is_none_or(|(most, _)| new > *most) {
                best = Some((new, chosen));
            }
        }
        let (_, chosen) = best.unwrap_or_default();
        self.met.extend(pairs(&chosen));
        chosen
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pair_of_choices_is_met_soon() {
        let mut pairs = Pairs::new(Bend::DIMENSIONS.to_vec(), 5);
        for _ in 0..12 * QUADS {
            pairs.next();
        }
        let all: usize = (0..7)
            .flat_map(|i| (i + 1..7).map(move |j| (i, j)))
            .map(|(i, j)| Bend::DIMENSIONS[i] * Bend::DIMENSIONS[j])
            .sum();
        assert_eq!(pairs.met.len(), all);
    }
}
