//! Reads textures for blocks of lanes: sample, gather, compare, load.
//!
//! Follows the Vulkan specification's chapter on image operations, isotropic: the level of detail is
//! the log2 of the longer of the two gradients, in texels of the finest level. Where it leaves room:
//! - Weights are not quantised. Interpolation is `a + (b - a) * t`, so a constant image gives exactly its constant.
//! - Array layers are clamped, and so are the texel, layer and level of a load.
//! - A coordinate that is NaN or infinite reads a texel at the edge; a NaN level of detail is the finest level.
//! - Cube maps filter across edges; at a corner, the missing fourth texel is one of the other three.
//! - Implicit gradients are the differences of a quad's lanes 1 and 2 from lane 0, the same for all four.

use super::{Comparison, Dimension, Level, Sampler, Texture, Wrap};
use crate::eval::lane::{LANES, Mask};

/// One float a lane.
pub type Floats = [f32; LANES];

/// One integer a lane. An unsigned value above `i32::MAX` is given as `i32::MAX`.
pub type Integers = [i32; LANES];

/// How the MIP level is chosen.
#[derive(Clone, Copy, Debug)]
pub enum Detail<'a> {
    /// From the differences of the coordinates within each quad (`textureSample`), shifted by
    /// the bias of each lane (`textureSampleBias`). All four lanes of an active quad need coordinates.
    Implicit {
        /// Added to the level of detail.
        bias: Option<&'a Floats>,
    },
    /// From each lane's own gradients, one array per coordinate (`textureSampleGrad`).
    Gradients {
        /// Change of the coordinates along x.
        ddx: &'a [&'a Floats],
        /// Change of the coordinates along y.
        ddy: &'a [&'a Floats],
    },
    /// The level of detail itself (`textureSampleLevel`).
    Exact(&'a Floats),
    /// The finest level (`textureSampleBaseClampToEdge`, a comparison at level 0, gathers).
    Zero,
}

/// A block's sample operation.
#[derive(Clone, Copy, Debug)]
pub struct Request<'a> {
    /// One array per coordinate: 1 to 3, a direction for a cube.
    pub coordinates: &'a [&'a Floats],
    /// The array layer, for arrays.
    pub layer: Option<&'a Integers>,
    /// Added to the texel coordinates, 0 where there is none.
    pub offset: [i32; 3],
    /// How the MIP level is chosen. Gathers read the finest level whatever it says.
    pub detail: Detail<'a>,
    /// The component that a gather collects: the result is, of the four texels that a bilinear
    /// sample would read, the ones at (left, bottom), (right, bottom), (right, top), (left, top).
    pub gather: Option<usize>,
    /// The depth reference, for comparisons. The result is then in the first component
    /// (in all four for a gather): the share of the texels that the comparison holds for.
    pub reference: Option<&'a Floats>,
    /// Keeps coordinates half a texel from the edge (`textureSampleBaseClampToEdge`).
    pub clamp_to_edge: bool,
}

impl<'a> Request<'a> {
    /// A plain sample with implicit level of detail (`textureSample`).
    pub fn implicit(coordinates: &'a [&'a Floats]) -> Self {
        Self {
            coordinates,
            layer: None,
            offset: [0; 3],
            detail: Detail::Implicit { bias: None },
            gather: None,
            reference: None,
            clamp_to_edge: false,
        }
    }
}

impl Comparison {
    /// 1 when it holds, else 0. NaN compares as in IEEE 754.
    fn holds(self, reference: f32, texel: f32) -> f32 {
        let holds = match self {
            Comparison::Never => false,
            Comparison::Less => reference < texel,
            Comparison::Equal => reference == texel,
            Comparison::LessEqual => reference <= texel,
            Comparison::Greater => reference > texel,
            Comparison::NotEqual => reference != texel,
            Comparison::GreaterEqual => reference >= texel,
            Comparison::Always => true,
        };
        f32::from(u8::from(holds))
    }
}

impl Texture {
    /// Samples for the lanes of `mask`; the other lanes of `out` stay as they are.
    pub fn sample(&self, sampler: &Sampler, request: &Request, mask: Mask, out: &mut [Floats; 4]) {
        for quad in 0..LANES / 4 {
            let bits = mask.0[quad / 16] >> (quad % 16 * 4) & 15;
            if bits == 0 {
                continue;
            }
            let gradients = match request.detail {
                Detail::Implicit { .. } => quad_gradients(request.coordinates, quad),
                _ => Gradients::default(),
            };
            // Cubes project gradients on each lane's own face, so nothing is shared there.
            let shared = match request.detail {
                Detail::Implicit { bias } if self.dimension != Dimension::Cube => {
                    Some(self.detail(&gradients, bias.is_some()))
                }
                _ => None,
            };
            for i in (0..4).filter(|i| bits >> i & 1 == 1) {
                let lane = quad * 4 + i;
                let place = self.place(request, lane);
                let value = match request.gather {
                    Some(component) => self.gather(sampler, request, &place, component, lane),
                    None => {
                        let lambda = self.lambda(request, &place, &gradients, shared, lane);
                        match request.reference {
                            None => self.filter(sampler, &place, lambda, request.offset, |t| t),
                            Some(reference) => {
                                let compare = |texel: [f32; 4]| {
                                    let holds = sampler.comparison.holds(reference[lane], texel[0]);
                                    [holds, 0.0, 0.0, 0.0]
                                };
                                self.filter(sampler, &place, lambda, request.offset, compare)
                            }
                        }
                    }
                };
                for (out, value) in out.iter_mut().zip(value) {
                    out[lane] = value;
                }
            }
        }
    }

    /// Reads texels for the lanes of `mask` (`textureLoad`); the other lanes of `out` stay as they are.
    /// `at` has one array per texel coordinate; without a level it is the finest. What is outside is clamped.
    pub fn load(
        &self,
        at: &[&Integers],
        layer: Option<&Integers>,
        level: Option<&Integers>,
        mask: Mask,
        out: &mut [Floats; 4],
    ) {
        let clamp = |value: i32, count: usize| (value.max(0) as usize).min(count - 1);
        for lane in (0..LANES).filter(|lane| mask.0[lane / 64] >> (lane % 64) & 1 == 1) {
            let level = level.map_or(0, |level| clamp(level[lane], self.levels.len()));
            let level = &self.levels[level];
            let axis = |axis: usize, count: u32| {
                at.get(axis).map_or(0, |at| clamp(at[lane], count as usize))
            };
            let (x, y) = (axis(0, level.width), axis(1, level.height));
            let plane = match (self.dimension, layer) {
                (Dimension::D3, _) => axis(2, level.layers),
                (_, Some(layer)) => clamp(layer[lane], level.layers as usize),
                (_, None) => 0,
            };
            let texel = level.texel(plane, x, y);
            for (out, value) in out.iter_mut().zip(texel) {
                out[lane] = value;
            }
        }
    }

    /// Where a lane samples: which plane, and where on it.
    fn place(&self, request: &Request, lane: usize) -> Place {
        let base = &self.levels[0];
        let get = |i: usize| request.coordinates.get(i).map(|c| c[lane]);
        let layer = |count: u32| {
            request
                .layer
                .map_or(0, |l| l[lane].max(0).min(count as i32 - 1) as usize)
        };
        let mut place = match self.dimension {
            Dimension::D2 => Place {
                plane: layer(base.layers),
                at: [get(0).unwrap_or(0.5), get(1).unwrap_or(0.5), 0.5],
                projected: [0.0; 3],
            },
            Dimension::D3 => Place {
                plane: 0,
                at: [0, 1, 2].map(|i| get(i).unwrap_or(0.5)),
                projected: [0.0; 3],
            },
            Dimension::Cube => {
                let direction = [0, 1, 2].map(|i| get(i).unwrap_or(0.0));
                let (face, s, t) = cube_face(direction);
                Place {
                    plane: layer(base.layers / 6) * 6 + face,
                    at: [s, t, 0.5],
                    projected: project(face, direction),
                }
            }
        };
        if request.clamp_to_edge {
            for (at, size) in place.at.iter_mut().zip(self.size(0)) {
                let half = 0.5 / size as f32;
                *at = at.max(half).min(1.0 - half);
            }
        }
        place
    }

    /// The level of detail of a lane. Only its sign counts when there is one level.
    fn lambda(
        &self,
        request: &Request,
        place: &Place,
        quad: &Gradients,
        shared: Option<f32>,
        lane: usize,
    ) -> f32 {
        let cube = self.dimension == Dimension::Cube;
        match request.detail {
            Detail::Zero => 0.0,
            Detail::Exact(level) => level[lane],
            Detail::Implicit { bias } => {
                let lambda =
                    shared.unwrap_or_else(|| self.detail(&quad.on_face(place), bias.is_some()));
                bias.map_or(lambda, |bias| lambda + bias[lane])
            }
            Detail::Gradients { ddx, ddy } => {
                let get = |d: &[&Floats]| [0, 1, 2].map(|i| d.get(i).map_or(0.0, |d| d[lane]));
                let own = Gradients {
                    x: get(ddx),
                    y: get(ddy),
                };
                self.detail(&if cube { own.on_face(place) } else { own }, false)
            }
        }
    }

    /// The level of detail for gradients. Unless it must be exact because a bias is to be added,
    /// anything up to 0 is 0, and with one level anything above is 1.
    fn detail(&self, gradients: &Gradients, exact: bool) -> f32 {
        let size = self.size(0).map(|n| n as f32);
        let squared = |d: &[f32; 3]| {
            let texels = [d[0] * size[0], d[1] * size[1], d[2] * size[2]];
            texels[0] * texels[0] + texels[1] * texels[1] + texels[2] * texels[2]
        };
        let (x, y) = (squared(&gradients.x), squared(&gradients.y));
        let longest = if x > y { x } else { y };
        if !exact && longest <= 1.0 {
            0.0
        } else if !exact && self.levels.len() == 1 {
            1.0
        } else {
            0.5 * libm::log2f(longest)
        }
    }

    /// One or two MIP levels, each filtered over what `read` makes of its texels.
    fn filter(
        &self,
        sampler: &Sampler,
        place: &Place,
        lambda: f32,
        offset: [i32; 3],
        read: impl Fn([f32; 4]) -> [f32; 4],
    ) -> [f32; 4] {
        let magnified = lambda.is_nan() || lambda <= 0.0;
        let linear = if magnified {
            sampler.linear_magnification
        } else {
            sampler.linear_minification
        };
        let last = self.levels.len() - 1;
        let (fine, part) = if magnified {
            (0, 0.0)
        } else {
            let lambda = lambda.min(last as f32);
            (lambda as usize, lambda - (lambda as usize) as f32)
        };
        let of_level = |level: usize| {
            let level = &self.levels[level];
            match (self.dimension, linear) {
                (Dimension::D3, _) => level.volume(sampler, place, offset, linear, &read),
                (Dimension::Cube, true) => level.bilinear_cube(place, &read),
                (Dimension::D2, true) => level.bilinear(sampler, place, offset, &read),
                (Dimension::Cube, false) => {
                    level.nearest([Wrap::ClampToEdge; 3], place, offset, &read)
                }
                (Dimension::D2, false) => level.nearest(sampler.wrap, place, offset, &read),
            }
        };
        if part == 0.0 {
            of_level(fine)
        } else if sampler.linear_mip {
            mix(of_level(fine), of_level(fine + 1), part)
        } else {
            of_level(fine + usize::from(part > 0.5))
        }
    }

    /// One component of the four texels of a bilinear sample.
    fn gather(
        &self,
        sampler: &Sampler,
        request: &Request,
        place: &Place,
        component: usize,
        lane: usize,
    ) -> [f32; 4] {
        let level = &self.levels[0];
        let read = |texel: [f32; 4]| match request.reference {
            None => texel[component & 3],
            Some(reference) => sampler.comparison.holds(reference[lane], texel[0]),
        };
        if self.dimension == Dimension::Cube {
            let (x, _) = split(place.at[0], level.width, Wrap::ClampToEdge);
            let (y, _) = split(place.at[1], level.height, Wrap::ClampToEdge);
            let tap = |x: i32, y: i32| read(level.cube_texel(place.plane, x, y));
            [tap(x, y + 1), tap(x + 1, y + 1), tap(x + 1, y), tap(x, y)]
        } else {
            let (x, _) = taps(place.at[0], level.width, sampler.wrap[0], request.offset[0]);
            let (y, _) = taps(
                place.at[1],
                level.height,
                sampler.wrap[1],
                request.offset[1],
            );
            let tap = |x: usize, y: usize| read(level.texel(place.plane, x, y));
            [
                tap(x[0], y[1]),
                tap(x[1], y[1]),
                tap(x[1], y[0]),
                tap(x[0], y[0]),
            ]
        }
    }
}

/// Where a lane samples.
struct Place {
    /// Layer, face or (for a volume) 0.
    plane: usize,
    /// Normalised coordinates on it.
    at: [f32; 3],
    /// For a cube: the direction as seen from its face, see [`project`].
    projected: [f32; 3],
}

/// How coordinates change from pixel to pixel.
#[derive(Default)]
struct Gradients {
    x: [f32; 3],
    y: [f32; 3],
}

impl Gradients {
    /// The gradients of the coordinates on a cube's face, from those of the direction.
    fn on_face(&self, place: &Place) -> Gradients {
        let face = place.plane % 6;
        let [sc, tc, ma] = place.projected;
        // s = sc / (2 ma) + 1/2 by the quotient rule.
        let on_face = |d: [f32; 3]| {
            let d = project(face, d);
            let scale = 0.5 / (ma * ma);
            [
                scale * (d[0] * ma - sc * d[2]),
                scale * (d[1] * ma - tc * d[2]),
                0.0,
            ]
        };
        Gradients {
            x: on_face(self.x),
            y: on_face(self.y),
        }
    }
}

/// The differences within a quad.
fn quad_gradients(coordinates: &[&Floats], quad: usize) -> Gradients {
    let first = quad * 4;
    let difference = |lane: usize| {
        [0, 1, 2].map(|i| {
            coordinates
                .get(i)
                .map_or(0.0, |c| c[first + lane] - c[first])
        })
    };
    Gradients {
        x: difference(1),
        y: difference(2),
    }
}

impl Level {
    #[inline]
    fn texel(&self, plane: usize, x: usize, y: usize) -> [f32; 4] {
        self.texels[(plane * self.height as usize + y) * self.width as usize + x]
    }

    fn nearest(
        &self,
        wrap: [Wrap; 3],
        place: &Place,
        offset: [i32; 3],
        read: &impl Fn([f32; 4]) -> [f32; 4],
    ) -> [f32; 4] {
        let x = tap(place.at[0], self.width, wrap[0], offset[0]);
        let y = tap(place.at[1], self.height, wrap[1], offset[1]);
        read(self.texel(place.plane, x, y))
    }

    fn bilinear(
        &self,
        sampler: &Sampler,
        place: &Place,
        offset: [i32; 3],
        read: &impl Fn([f32; 4]) -> [f32; 4],
    ) -> [f32; 4] {
        let (x, u) = taps(place.at[0], self.width, sampler.wrap[0], offset[0]);
        let (y, v) = taps(place.at[1], self.height, sampler.wrap[1], offset[1]);
        self.four(place.plane, x, y, u, v, read)
    }

    /// Four texels of a plane, interpolated.
    #[inline]
    fn four(
        &self,
        plane: usize,
        x: [usize; 2],
        y: [usize; 2],
        u: f32,
        v: f32,
        read: &impl Fn([f32; 4]) -> [f32; 4],
    ) -> [f32; 4] {
        let tap = |x, y| read(self.texel(plane, x, y));
        let top = mix(tap(x[0], y[0]), tap(x[1], y[0]), u);
        let bottom = mix(tap(x[0], y[1]), tap(x[1], y[1]), u);
        mix(top, bottom, v)
    }

    fn bilinear_cube(&self, place: &Place, read: &impl Fn([f32; 4]) -> [f32; 4]) -> [f32; 4] {
        let (x, u) = split(place.at[0], self.width, Wrap::ClampToEdge);
        let (y, v) = split(place.at[1], self.height, Wrap::ClampToEdge);
        let tap = |x, y| read(self.cube_texel(place.plane, x, y));
        let top = mix(tap(x, y), tap(x + 1, y), u);
        let bottom = mix(tap(x, y + 1), tap(x + 1, y + 1), u);
        mix(top, bottom, v)
    }

    /// A texel of a cube's face; one step beyond an edge it is the neighbour's.
    fn cube_texel(&self, plane: usize, x: i32, y: i32) -> [f32; 4] {
        let size = self.width as i32;
        let inside = |i: i32| (0..size).contains(&i);
        let (cx, cy) = (x.clamp(0, size - 1), y.clamp(0, size - 1));
        if inside(x) && inside(y) || !inside(x) && !inside(y) {
            return self.texel(plane, cx as usize, cy as usize);
        }
        // The middle of the texel, if the face went on, seen from the centre: the neighbour's
        // outermost texel, off by less than half a texel along the edge.
        let middle = |i: i32| (i as f32 + 0.5) / size as f32;
        let direction = cube_direction(plane % 6, middle(x), middle(y));
        let (face, s, t) = cube_face(direction);
        let x = tap(s, self.width, Wrap::ClampToEdge, 0);
        let y = tap(t, self.height, Wrap::ClampToEdge, 0);
        self.texel(plane - plane % 6 + face, x, y)
    }

    fn volume(
        &self,
        sampler: &Sampler,
        place: &Place,
        offset: [i32; 3],
        linear: bool,
        read: &impl Fn([f32; 4]) -> [f32; 4],
    ) -> [f32; 4] {
        let size = [self.width, self.height, self.layers];
        if linear {
            let [(x, u), (y, v), (z, w)] =
                [0, 1, 2].map(|i| taps(place.at[i], size[i], sampler.wrap[i], offset[i]));
            mix(
                self.four(z[0], x, y, u, v, read),
                self.four(z[1], x, y, u, v, read),
                w,
            )
        } else {
            let [x, y, z] =
                [0, 1, 2].map(|i| tap(place.at[i], size[i], sampler.wrap[i], offset[i]));
            read(self.texel(z, x, y))
        }
    }
}

/// `a + (b - a) * t` per component.
#[inline]
fn mix(a: [f32; 4], b: [f32; 4], t: f32) -> [f32; 4] {
    std::array::from_fn(|c| a[c] + (b[c] - a[c]) * t)
}

/// The largest integer not above a value, without the call that `f32::floor` is on older instruction sets.
/// Values from 2^23 on, infinities and NaN come back as they are.
#[inline]
fn floor(x: f32) -> f32 {
    if x.abs() < 8_388_608.0 {
        let cut = x as i32 as f32;
        if cut > x { cut - 1.0 } else { cut }
    } else {
        x
    }
}

/// A normalised coordinate in texels, within one period of its wrap mode so that it fits an integer.
#[inline]
fn in_texels(at: f32, size: u32, wrap: Wrap) -> f32 {
    let period = match wrap {
        Wrap::Repeat => at - floor(at),
        Wrap::MirrorRepeat => at - 2.0 * floor(0.5 * at),
        Wrap::ClampToEdge => at,
    };
    // NaN, which infinities have become under the periodic modes, is 0.
    let period = if period.is_nan() { 0.0 } else { period };
    (period * size as f32).clamp(-1.0e9, 1.0e9)
}

/// The left of the two texels that linear filtering reads, unwrapped, and the weight of the right one.
#[inline]
fn split(at: f32, size: u32, wrap: Wrap) -> (i32, f32) {
    let x = in_texels(at, size, wrap) - 0.5;
    let left = floor(x);
    (left as i32, x - left)
}

/// The two texels that linear filtering reads along an axis, and the weight of the second.
#[inline]
fn taps(at: f32, size: u32, wrap: Wrap, offset: i32) -> ([usize; 2], f32) {
    let (left, weight) = split(at, size, wrap);
    let left = left.saturating_add(offset);
    let right = left.saturating_add(1);
    (
        [wrapped(left, size, wrap), wrapped(right, size, wrap)],
        weight,
    )
}

/// The nearest texel along an axis.
#[inline]
fn tap(at: f32, size: u32, wrap: Wrap, offset: i32) -> usize {
    let i = floor(in_texels(at, size, wrap)) as i32;
    wrapped(i.saturating_add(offset), size, wrap)
}

/// A texel index brought inside.
#[inline]
fn wrapped(i: i32, size: u32, wrap: Wrap) -> usize {
    if (i as u32) < size {
        return i as usize;
    }
    let (i, size) = (i64::from(i), i64::from(size));
    let inside = match wrap {
        Wrap::Repeat => i.rem_euclid(size),
        Wrap::ClampToEdge => i.clamp(0, size - 1),
        Wrap::MirrorRepeat => {
            let i = i.rem_euclid(2 * size);
            i.min(2 * size - 1 - i)
        }
    };
    inside as usize
}

/// A direction in the frame of a cube's face: to the right, down, and outwards.
#[inline]
fn project(face: usize, [x, y, z]: [f32; 3]) -> [f32; 3] {
    match face {
        0 => [-z, -y, x],
        1 => [z, -y, -x],
        2 => [x, z, y],
        3 => [x, -z, -y],
        4 => [x, -y, z],
        _ => [-x, -y, -z],
    }
}

/// The face that a direction points at, and the coordinates on it. Of equal axes z wins, then y.
#[inline]
fn cube_face(direction: [f32; 3]) -> (usize, f32, f32) {
    let [x, y, z] = direction.map(f32::abs);
    let axis = if z >= x && z >= y {
        2
    } else if y >= x {
        1
    } else {
        0
    };
    let face = 2 * axis + usize::from(direction[axis] < 0.0);
    let [sc, tc, ma] = project(face, direction);
    (face, 0.5 * (sc / ma) + 0.5, 0.5 * (tc / ma) + 0.5)
}

/// The point of the unit cube's surface at coordinates of a face.
pub(super) fn cube_direction(face: usize, s: f32, t: f32) -> [f32; 3] {
    let (s, t) = (2.0 * s - 1.0, 2.0 * t - 1.0);
    match face {
        0 => [1.0, -t, -s],
        1 => [-1.0, -t, s],
        2 => [s, 1.0, t],
        3 => [s, -1.0, -t],
        4 => [s, -t, 1.0],
        _ => [-s, -t, -1.0],
    }
}
