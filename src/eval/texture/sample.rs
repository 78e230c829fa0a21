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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eval::image::Image;

    fn image(width: u32, height: u32, value: impl Fn(u32, u32) -> f32) -> Image {
        let texels = (0..height)
            .flat_map(|y| (0..width).map(move |x| (x, y)))
            .map(|(x, y)| [value(x, y), y as f32, 0.0, 1.0])
            .collect();
        Image {
            width,
            height,
            texels,
        }
    }

    /// Red is the column, green the row.
    fn ramp(width: u32, height: u32) -> Texture {
        Texture::new(Dimension::D2, vec![image(width, height, |x, _| x as f32)]).unwrap()
    }

    /// Six 4 x 4 faces; red is a function of the direction, which has no seams.
    fn cube(value: impl Fn([f32; 3]) -> f32) -> Texture {
        let face = |face: usize| {
            image(4, 4, |x, y| {
                value(cube_direction(
                    face,
                    (x as f32 + 0.5) / 4.0,
                    (y as f32 + 0.5) / 4.0,
                ))
            })
        };
        Texture::new(Dimension::Cube, (0..6).map(face).collect()).unwrap()
    }

    const ONE: Mask = Mask([1, 0, 0, 0]);

    /// Samples in lane 0.
    fn one<'r>(
        texture: &Texture,
        sampler: &Sampler,
        at: &[f32],
        edit: impl Fn(&mut Request<'r>),
    ) -> [f32; 4] {
        let coordinates: Vec<Floats> = at.iter().map(|&c| [c; LANES]).collect();
        let coordinates: Vec<&Floats> = coordinates.iter().collect();
        let mut edited = Request::implicit(&[]);
        edit(&mut edited);
        let request = Request {
            coordinates: &coordinates,
            ..edited
        };
        let mut out = [[0.0; LANES]; 4];
        texture.sample(sampler, &request, ONE, &mut out);
        out.map(|c| c[0])
    }

    fn wrapping(wrap: Wrap) -> Sampler {
        Sampler {
            wrap: [wrap; 3],
            ..Sampler::default()
        }
    }

    fn nearest(wrap: Wrap) -> Sampler {
        Sampler {
            linear_magnification: false,
            linear_minification: false,
            linear_mip: false,
            ..wrapping(wrap)
        }
    }

    #[test]
    fn bilinear_weights() {
        let texture = ramp(4, 4);
        // Texel centres are at (i + 0.5) / 4.
        for (u, v, expected) in [
            (0.375, 0.125, [1.0, 0.0]),
            (0.5, 0.5, [1.5, 1.5]),
            (0.4375, 0.8125, [1.25, 2.75]),
        ] {
            let got = one(&texture, &Sampler::default(), &[u, v], |_| {});
            assert_eq!(got[..2], expected);
            assert_eq!(got[2..], [0.0, 1.0]);
        }
    }

    #[test]
    fn wrap_modes() {
        let texture = ramp(4, 1);
        let at = |wrap, u: f32| one(&texture, &nearest(wrap), &[u, 0.5], |_| {})[0];
        let columns = |wrap| [-1.2, -0.3, -0.1, 0.1, 0.3, 0.9, 1.0, 1.3, 2.1].map(|u| at(wrap, u));
        assert_eq!(
            columns(Wrap::Repeat),
            [3.0, 2.0, 3.0, 0.0, 1.0, 3.0, 0.0, 1.0, 0.0]
        );
        assert_eq!(
            columns(Wrap::ClampToEdge),
            [0.0, 0.0, 0.0, 0.0, 1.0, 3.0, 3.0, 3.0, 3.0]
        );
        assert_eq!(
            columns(Wrap::MirrorRepeat),
            [3.0, 1.0, 0.0, 0.0, 1.0, 3.0, 3.0, 2.0, 0.0]
        );
        // Linear filtering at the edge, u = 0: halfway between texel 0 and its neighbour on the left.
        let linear = |wrap| one(&texture, &wrapping(wrap), &[0.0, 0.5], |_| {})[0];
        assert_eq!(linear(Wrap::Repeat), 1.5);
        assert_eq!(linear(Wrap::ClampToEdge), 0.0);
        assert_eq!(linear(Wrap::MirrorRepeat), 0.0);
    }

    #[test]
    fn offsets_move_by_texels() {
        let texture = ramp(4, 4);
        let at = |wrap, offset: i32| {
            one(&texture, &wrapping(wrap), &[0.375, 0.375], |r| {
                r.offset = [offset, 0, 0];
            })[0]
        };
        assert_eq!(at(Wrap::Repeat, 1), 2.0);
        assert_eq!(at(Wrap::Repeat, -2), 3.0);
        assert_eq!(at(Wrap::Repeat, 7), 0.0);
        assert_eq!(at(Wrap::ClampToEdge, 7), 3.0);
        assert_eq!(at(Wrap::MirrorRepeat, -2), 0.0);
        assert_eq!(at(Wrap::MirrorRepeat, 3), 3.0);
    }

    #[test]
    fn any_coordinate_is_safe() {
        let flat = Texture::new(Dimension::D2, vec![image(5, 3, |_, _| 0.5)])
            .unwrap()
            .with_mip_chain();
        let sky = cube(|_| 0.5).with_mip_chain();
        let volume = Texture::new(Dimension::D3, vec![image(5, 3, |_, _| 0.5); 3]).unwrap();
        let hard = [
            f32::NAN,
            f32::INFINITY,
            f32::NEG_INFINITY,
            3e38,
            -3e38,
            1e10,
            -1e-40,
            -1e-8,
            0.0,
        ];
        for wrap in [Wrap::Repeat, Wrap::ClampToEdge, Wrap::MirrorRepeat] {
            for sampler in [wrapping(wrap), nearest(wrap)] {
                for a in hard {
                    for b in hard {
                        for texture in [&flat, &sky, &volume] {
                            let mut level = [a; LANES];
                            level[0] = b;
                            for offset in [0, i32::MAX, i32::MIN] {
                                let got = one(texture, &sampler, &[a, b, 0.3], |r| {
                                    r.offset = [offset, 1, 0];
                                    r.detail = Detail::Exact(&level);
                                });
                                assert_eq!(got[0], 0.5, "{wrap:?} {a} {b}");
                            }
                            let got = one(texture, &sampler, &[a, b, 0.3], |_| {});
                            assert_eq!(got[0], 0.5);
                        }
                    }
                }
            }
        }
    }

    /// A chain of 16, 8, 4, 2 and 1 texels whose red is the level.
    fn staircase() -> Texture {
        let mut texture = ramp(16, 16).with_mip_chain();
        for (i, level) in texture.levels.iter_mut().enumerate() {
            level.texels.fill([i as f32, 0.0, 0.0, 1.0]);
        }
        texture
    }

    #[test]
    fn level_of_detail_at_known_scales() {
        let texture = staircase();
        let trilinear = Sampler::default();
        // `step` texels a pixel along x, half of that along y: the longer counts.
        let implicit = |sampler: &Sampler, step: f32, bias: Option<&Floats>| {
            let mut u = [0.0; LANES];
            let mut v = [0.0; LANES];
            for lane in 0..4 {
                u[lane] = 0.25 + (lane % 2) as f32 * step / 16.0;
                v[lane] = 0.25 + (lane / 2) as f32 * 0.5 * step / 16.0;
            }
            let coordinates = [&u, &v];
            let mut request = Request::implicit(&coordinates);
            request.detail = Detail::Implicit { bias };
            let mut out = [[0.0; LANES]; 4];
            texture.sample(sampler, &request, Mask([15, 0, 0, 0]), &mut out);
            assert!(
                out[0][..4].iter().all(|&r| r == out[0][0]),
                "one level a quad"
            );
            out[0][0]
        };
        for (step, level) in [
            (0.25, 0.0),
            (1.0, 0.0),
            (2.0, 1.0),
            (4.0, 2.0),
            (16.0, 4.0),
            (64.0, 4.0),
        ] {
            assert_eq!(implicit(&trilinear, step, None), level, "{step}");
        }
        let half = implicit(&trilinear, 2.0_f32.sqrt(), None);
        assert!((half - 0.5).abs() < 1e-6, "{half}");
        assert_eq!(implicit(&trilinear, 2.0, Some(&[1.5; LANES])), 2.5);
        assert_eq!(implicit(&trilinear, 0.5, Some(&[1.5; LANES])), 0.5);
        assert_eq!(implicit(&trilinear, 8.0, Some(&[-9.0; LANES])), 0.0);
        let steps = Sampler {
            linear_mip: false,
            ..trilinear
        };
        assert_eq!(implicit(&steps, 2.8, None), 1.0);
        assert_eq!(implicit(&steps, 2.9, None), 2.0);

        let exact = |level: f32| {
            one(&texture, &trilinear, &[0.3, 0.3], |r| {
                r.detail = Detail::Exact(if level == 1.25 {
                    &[1.25; LANES]
                } else {
                    &[9.0; LANES]
                });
            })[0]
        };
        assert_eq!((exact(1.25), exact(9.0)), (1.25, 4.0));
        let gradients = one(&texture, &trilinear, &[0.3, 0.3], |r| {
            r.detail = Detail::Gradients {
                ddx: &[&[0.0; LANES], &[0.125; LANES]],
                ddy: &[&[0.5; LANES], &[0.0; LANES]],
            };
        });
        assert_eq!(gradients[0], 3.0);
    }

    #[test]
    fn magnification_and_minification_filters_differ() {
        let texture = ramp(4, 1);
        let sampler = Sampler {
            linear_magnification: false,
            ..wrapping(Wrap::ClampToEdge)
        };
        let at = |level: &Floats| {
            one(&texture, &sampler, &[0.45, 0.5], |r| {
                r.detail = Detail::Exact(level)
            })[0]
        };
        assert_eq!(at(&[0.0; LANES]), 1.0);
        assert!((at(&[0.5; LANES]) - 1.3).abs() < 1e-6);
    }

    #[test]
    fn compares_depth_then_filters() {
        let texture = ramp(4, 1);
        let shadow = |reference: &Floats, comparison| {
            let sampler = Sampler {
                comparison,
                ..wrapping(Wrap::ClampToEdge)
            };
            one(&texture, &sampler, &[0.4375, 0.5], |r| {
                r.reference = Some(reference);
                r.detail = Detail::Zero;
            })[0]
        };
        // Texels 1 and 2 with weights 3/4 and 1/4.
        assert_eq!(shadow(&[1.5; LANES], Comparison::LessEqual), 0.25);
        assert_eq!(shadow(&[2.0; LANES], Comparison::LessEqual), 0.25);
        assert_eq!(shadow(&[2.0; LANES], Comparison::Less), 0.0);
        assert_eq!(shadow(&[1.5; LANES], Comparison::Greater), 0.75);
        assert_eq!(shadow(&[1.0; LANES], Comparison::Equal), 0.75);
        assert_eq!(shadow(&[f32::NAN; LANES], Comparison::LessEqual), 0.0);
        assert_eq!(shadow(&[f32::NAN; LANES], Comparison::Always), 1.0);
    }

    #[test]
    fn gathers_in_order() {
        let texture = ramp(4, 4);
        let gather = |component, reference: Option<&Floats>| {
            one(&texture, &Sampler::default(), &[0.5, 0.5], |r| {
                r.gather = Some(component);
                r.reference = reference;
            })
        };
        assert_eq!(gather(0, None), [1.0, 2.0, 2.0, 1.0]);
        assert_eq!(gather(1, None), [2.0, 2.0, 1.0, 1.0]);
        assert_eq!(gather(0, Some(&[1.5; LANES])), [0.0, 1.0, 1.0, 0.0]);
        let sky = cube(|d| d[1]);
        let all = one(&sky, &Sampler::default(), &[0.0, 0.0, 1.0], |r| {
            r.gather = Some(0)
        });
        assert_eq!(all, [-0.25, -0.25, 0.25, 0.25]);
    }

    #[test]
    fn cube_faces() {
        // Each face its own number: the axes, and directions that lean towards another.
        let faces = (0..6).map(|f| image(2, 2, move |_, _| f as f32)).collect();
        let texture = Texture::new(Dimension::Cube, faces).unwrap();
        let directions = [
            [2.0, 0.3, -0.4],
            [-3.0, 1.0, 1.0],
            [0.1, 0.5, 0.2],
            [0.1, -0.5, 0.2],
            [0.0, 0.0, 7.0],
            [0.5, -0.5, -0.6],
        ];
        for (face, direction) in directions.iter().enumerate() {
            let got = one(&texture, &nearest(Wrap::Repeat), direction, |_| {});
            assert_eq!(got[0], face as f32);
        }
        // Every point of every face comes back to its own coordinates.
        for face in 0..6 {
            let (s, t) = (0.3, 0.8);
            let (found, found_s, found_t) = cube_face(cube_direction(face, s, t));
            assert_eq!(found, face);
            assert!((found_s - s).abs() < 1e-6 && (found_t - t).abs() < 1e-6);
        }
    }

    #[test]
    fn cube_edges_are_seamless() {
        let texture = cube(|d| d[0] + 2.0 * d[1] + 4.0 * d[2]);
        let sampler = Sampler::default();
        let at = |d: [f32; 3]| one(&texture, &sampler, &d, |_| {})[0];
        // Just on both sides of the edges between +z and +x, and +z and +y, the same value.
        // (Up to the outermost texels' centres: at a corner there are only three texels.)
        for i in 0..16 {
            let along = -0.75 + 0.1 * i as f32;
            for (a, b) in [
                ([1.000_01, along, 1.0], [1.0, along, 1.000_01]),
                ([along, 1.000_01, 1.0], [along, 1.0, 1.000_01]),
                ([-1.000_01, along, -1.0], [-1.0, along, -1.000_01]),
            ] {
                assert!((at(a) - at(b)).abs() < 1e-3, "{a:?}: {} {}", at(a), at(b));
            }
        }
        // On an edge it is the mean of the faces' outermost texels.
        assert!((at([1.0, 0.25, 1.0]) - (0.875 + 0.5 + 3.5)).abs() < 0.2);
    }

    #[test]
    fn cube_level_of_detail_uses_projected_gradients() {
        let mut texture = cube(|_| 0.0).with_mip_chain();
        for (i, level) in texture.levels.iter_mut().enumerate() {
            level.texels.fill([i as f32, 0.0, 0.0, 1.0]);
        }
        let sampler = Sampler::default();
        // At (0, 0, 2), a step of 2 along x is a step of 1 of sc / ma, half the face: two texels.
        let along = |ddx: &[&Floats]| {
            one(&texture, &sampler, &[0.0, 0.0, 2.0], |r| {
                r.detail = Detail::Gradients {
                    ddx,
                    ddy: &[&[0.0; LANES], &[0.0; LANES], &[0.0; LANES]],
                };
            })[0]
        };
        let (zero, two) = ([0.0; LANES], [2.0; LANES]);
        assert_eq!(along(&[&two, &zero, &zero]), 1.0);
        // A step along the axis itself does not move the point on the face.
        assert_eq!(along(&[&zero, &zero, &two]), 0.0);
    }

    #[test]
    fn array_layers_are_clamped() {
        let layers = (0..3).map(|l| image(1, 1, move |_, _| l as f32)).collect();
        let texture = Texture::new(Dimension::D2, layers).unwrap();
        for (layer, expected) in [(0, 0.0), (2, 2.0), (-5, 0.0), (i32::MAX, 2.0)] {
            let layers = [layer; LANES];
            let got = one(&texture, &Sampler::default(), &[0.5, 0.5], |r| {
                r.layer = Some(&layers)
            });
            assert_eq!(got[0], expected);
        }
        assert_eq!((texture.layers(), texture.size(0)), (3, [1, 1, 1]));
        let faces = (0..12).map(|f| image(1, 1, move |_, _| f as f32)).collect();
        let texture = Texture::new(Dimension::Cube, faces).unwrap();
        let second = [1; LANES];
        let got = one(&texture, &Sampler::default(), &[0.0, -1.0, 0.0], |r| {
            r.layer = Some(&second);
        });
        assert_eq!((got[0], texture.layers()), (9.0, 2));
    }

    #[test]
    fn volumes_filter_along_three_axes() {
        let slices = (0..4)
            .map(|z| image(4, 4, move |x, _| (x + 10 * z) as f32))
            .collect();
        let texture = Texture::new(Dimension::D3, slices).unwrap();
        let got = one(&texture, &Sampler::default(), &[0.5, 0.375, 0.5], |_| {});
        assert_eq!(got[..2], [16.5, 1.0]);
        let got = one(&texture, &nearest(Wrap::Repeat), &[0.6, 0.1, 1.3], |_| {});
        assert_eq!(got[..2], [12.0, 0.0]);
        assert_eq!(texture.size(0), [4, 4, 4]);
    }

    #[test]
    fn loads_are_clamped() {
        let texture = ramp(4, 2).with_mip_chain();
        let load = |x: i32, y: i32, level: i32| {
            let (x, y, level) = ([x; LANES], [y; LANES], [level; LANES]);
            let mut out = [[9.0; LANES]; 4];
            texture.load(&[&x, &y], None, Some(&level), ONE, &mut out);
            assert_eq!(out[0][1], 9.0, "other lanes are left alone");
            [out[0][0], out[1][0]]
        };
        assert_eq!(load(2, 1, 0), [2.0, 1.0]);
        assert_eq!(load(-1, 7, 0), [0.0, 1.0]);
        assert_eq!(load(1, 0, 1), [2.5, 0.5]);
        assert_eq!(load(i32::MAX, i32::MIN, 99), [1.5, 0.5]);
    }

    #[test]
    fn one_dimension_and_clamped_edges() {
        let texture = ramp(4, 1);
        assert_eq!(one(&texture, &Sampler::default(), &[0.375], |_| {})[0], 1.0);
        let at = |u: f32| {
            one(&texture, &Sampler::default(), &[u, 0.5], |r| {
                r.detail = Detail::Zero;
                r.clamp_to_edge = true;
            })[0]
        };
        assert_eq!((at(-1.0), at(1.0), at(0.5)), (0.0, 3.0, 1.5));
    }

    #[test]
    fn constant_images_give_their_constant() {
        let texture = Texture::new(Dimension::D2, vec![image(7, 5, |_, _| 0.1)])
            .unwrap()
            .with_mip_chain();
        // The box filter may round; what a level holds is what a sample of it gives.
        for i in 0..100 {
            let (u, v) = (i as f32 * 0.37, i as f32 * 0.73);
            assert_eq!(one(&texture, &Sampler::default(), &[u, v], |_| {})[0], 0.1);
        }
    }
}
