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
use crate::lane::{LANES, Mask};
use lodc_passes::semantics::Real;

/// One float a lane.
pub type Floats = [f32; LANES];

/// One integer a lane, an unsigned one by its bits: above `i32::MAX` it is clamped like a negative one.
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
        let places = Places::new(self, request);
        match (request.gather, request.reference) {
            (Some(component), None) => {
                let read = |_, texel: [f32; 4]| texel[component & 3];
                self.gather(sampler, request, &places, mask, read, out);
            }
            (Some(_), Some(reference)) => {
                let read = |lane: usize, texel: [f32; 4]| {
                    sampler.comparison.holds(reference[lane], texel[0])
                };
                self.gather(sampler, request, &places, mask, read, out);
            }
            (None, None) => self.filter(sampler, request, &places, mask, |_, t| t, out),
            (None, Some(reference)) => {
                let read = |lane: usize, texel: [f32; 4]| {
                    let holds = sampler.comparison.holds(reference[lane], texel[0]);
                    [holds, 0.0, 0.0, 0.0]
                };
                self.filter(sampler, request, &places, mask, read, out);
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
        for lane in mask.lanes() {
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
            store(out, lane, level.texel(plane, x, y));
        }
    }

    /// One or two MIP levels a lane, each filtered over what `read` makes of its texels.
    ///
    /// Level by level: the arithmetic of the coordinates runs over all lanes at once, in loops that
    /// vectorise; then each lane reads its texels. A block mostly needs one or two levels.
    fn filter(
        &self,
        sampler: &Sampler,
        request: &Request,
        places: &Places,
        mask: Mask,
        read: impl Fn(usize, [f32; 4]) -> [f32; 4],
        out: &mut [Floats; 4],
    ) {
        let lambda = self.lambda(request, places);
        let choice = Choice::new(&lambda, sampler, self.levels.len() - 1);
        let Some((finest, coarsest)) = choice.range(mask) else {
            return;
        };
        for (i, level) in self.levels[finest..=coarsest].iter().enumerate() {
            let i = (finest + i) as i32;
            for linear in [false, true] {
                if linear != sampler.linear_magnification && linear != sampler.linear_minification {
                    continue;
                }
                let axes = self.axes(level, sampler, request.offset, places, linear);
                for lane in mask.lanes() {
                    let fine = choice.fine[lane] == i;
                    let coarse = choice.fine[lane] + 1 == i && choice.part[lane] > 0.0;
                    if !fine && !coarse || choice.linear[lane] != linear {
                        continue;
                    }
                    let read = |texel| read(lane, texel);
                    let plane = places.plane[lane] as usize;
                    let [x, y, z] = &axes;
                    let value = match (self.dimension, linear) {
                        (Dimension::D2, true) => {
                            level.bilinear(plane, x.taps(lane), y.taps(lane), read)
                        }
                        (Dimension::Cube, true) => {
                            level.bilinear_cube(plane, x.taps(lane), y.taps(lane), read)
                        }
                        (Dimension::D3, true) => {
                            let (x, y, z) = (x.taps(lane), y.taps(lane), z.taps(lane));
                            let near = level.bilinear(z.first, x, y, read);
                            mix(near, level.bilinear(z.second, x, y, read), z.weight)
                        }
                        (Dimension::D3, false) => {
                            let [x, y, z] = [x, y, z].map(|axis| axis.first[lane] as usize);
                            read(level.texel(z, x, y))
                        }
                        (_, false) => {
                            let [x, y] = [x, y].map(|axis| axis.first[lane] as usize);
                            read(level.texel(plane, x, y))
                        }
                    };
                    let value = if fine {
                        value
                    } else {
                        let finer = [0, 1, 2, 3].map(|c| out[c][lane]);
                        mix(finer, value, choice.part[lane])
                    };
                    store(out, lane, value);
                }
            }
        }
    }

    /// What `read` makes of the four texels of a bilinear sample of the finest level.
    fn gather(
        &self,
        sampler: &Sampler,
        request: &Request,
        places: &Places,
        mask: Mask,
        read: impl Fn(usize, [f32; 4]) -> f32,
        out: &mut [Floats; 4],
    ) {
        let level = &self.levels[0];
        let [x, y, _] = &self.axes(level, sampler, request.offset, places, true);
        for lane in mask.lanes() {
            let (x, y) = (x.taps(lane), y.taps(lane));
            let plane = places.plane[lane] as usize;
            let four = [
                (x.first, y.second),
                (x.second, y.second),
                (x.second, y.first),
                (x.first, y.first),
            ];
            let value = four.map(|(x, y)| {
                let texel = if self.dimension == Dimension::Cube {
                    level.cube_texel(plane, x, y)
                } else {
                    level.texel(plane, x, y)
                };
                read(lane, texel)
            });
            store(out, lane, value);
        }
    }

    /// Which texels of a level each lane reads, along each axis.
    fn axes(
        &self,
        level: &Level,
        sampler: &Sampler,
        offset: [i32; 3],
        places: &Places,
        linear: bool,
    ) -> [Axis; 3] {
        let size = [level.width, level.height, level.layers];
        let axis = |i: usize| {
            let edges = match self.dimension {
                Dimension::Cube if linear => Edges::Open,
                Dimension::Cube => Edges::Wrap(Wrap::ClampToEdge, 0),
                _ => Edges::Wrap(sampler.wrap[i], offset[i]),
            };
            Axis::new(&places.at[i], size[i], edges, linear)
        };
        let third = if self.dimension == Dimension::D3 {
            axis(2)
        } else {
            Axis::default()
        };
        [axis(0), axis(1), third]
    }

    /// The level of detail of each lane.
    fn lambda(&self, request: &Request, places: &Places) -> Floats {
        match request.detail {
            Detail::Zero => [0.0; LANES],
            Detail::Exact(level) => *level,
            Detail::Gradients { ddx, ddy } => self.detail(ddx, ddy, places),
            Detail::Implicit { bias } => {
                let mut gradients = [[[0.0; LANES]; 3]; 2];
                for (axis, at) in request.coordinates.iter().take(3).enumerate() {
                    let [x, y] = &mut gradients;
                    let x = x[axis].as_chunks_mut::<4>().0;
                    let y = y[axis].as_chunks_mut::<4>().0;
                    for ((quad, x), y) in at.as_chunks::<4>().0.iter().zip(x).zip(y) {
                        *x = [quad[1] - quad[0]; 4];
                        *y = [quad[2] - quad[0]; 4];
                    }
                }
                let count = request.coordinates.len().min(3);
                let [ddx, ddy] = gradients.each_ref().map(|g| g.each_ref());
                let mut lambda = self.detail(&ddx[..count], &ddy[..count], places);
                if let Some(bias) = bias {
                    for (lambda, bias) in lambda.iter_mut().zip(bias) {
                        *lambda += bias;
                    }
                }
                lambda
            }
        }
    }

    /// The level of detail for gradients of the coordinates along x and y.
    fn detail(&self, ddx: &[&Floats], ddy: &[&Floats], places: &Places) -> Floats {
        let size = self.size(0).map(|n| n as f32);
        let squared = |gradients: &[&Floats]| {
            let mut sum = [0.0; LANES];
            for (gradient, size) in gradients.iter().zip(size) {
                for (sum, gradient) in sum.iter_mut().zip(*gradient) {
                    let texels = gradient * size;
                    *sum += texels * texels;
                }
            }
            sum
        };
        let [mut x, y] = match (&places.on_cube, ddx, ddy) {
            (Some(cube), &[ax, ay, az], &[bx, by, bz]) => [[ax, ay, az], [bx, by, bz]]
                .map(|gradients| squared(&cube.on_faces(gradients).each_ref())),
            _ => [squared(ddx), squared(ddy)],
        };
        for (x, y) in x.iter_mut().zip(y) {
            *x = 0.5 * Real::log2(if *x > y { *x } else { y });
        }
        x
    }
}

/// Where the lanes of a block sample.
struct Places {
    /// Normalised coordinates on the plane; for a volume three.
    at: [Floats; 3],
    /// Layer, face or (for a volume) 0.
    plane: [u32; LANES],
    /// For a cube, how the direction looks from each lane's face.
    on_cube: Option<Box<OnCube>>,
}

/// Directions in the frames of the faces that they point at, see [`Face::project`].
struct OnCube {
    faces: [Face; LANES],
    right: Floats,
    down: Floats,
    outwards: Floats,
}

impl Places {
    fn new(texture: &Texture, request: &Request) -> Self {
        let mut places = Self {
            at: [[0.5; LANES]; 3],
            plane: [0; LANES],
            on_cube: None,
        };
        if let Some(layer) = request.layer {
            let last = texture.layers() as i32 - 1;
            for (plane, &layer) in places.plane.iter_mut().zip(layer) {
                *plane = layer.max(0).min(last) as u32;
            }
        }
        match *request.coordinates {
            [x, y, z] if texture.dimension == Dimension::Cube => {
                let mut cube = Box::new(OnCube {
                    faces: [Face::default(); LANES],
                    right: [0.0; LANES],
                    down: [0.0; LANES],
                    outwards: [0.0; LANES],
                });
                for lane in 0..LANES {
                    let direction = [x[lane], y[lane], z[lane]];
                    let face = Face::of(direction);
                    let [right, down, outwards] = face.project(direction);
                    places.at[0][lane] = 0.5 * (right / outwards) + 0.5;
                    places.at[1][lane] = 0.5 * (down / outwards) + 0.5;
                    places.plane[lane] = places.plane[lane] * 6 + face.index();
                    cube.faces[lane] = face;
                    cube.right[lane] = right;
                    cube.down[lane] = down;
                    cube.outwards[lane] = outwards;
                }
                places.on_cube = Some(cube);
            }
            _ => {
                for (at, given) in places.at.iter_mut().zip(request.coordinates) {
                    *at = **given;
                }
            }
        }
        if request.clamp_to_edge {
            for (at, size) in places.at.iter_mut().zip(texture.size(0)) {
                let half = 0.5 / size as f32;
                for at in at {
                    *at = at.max(half).min(1.0 - half);
                }
            }
        }
        places
    }
}

impl OnCube {
    /// Gradients of the direction as gradients of the coordinates on each lane's face.
    fn on_faces(&self, [x, y, z]: [&Floats; 3]) -> [Floats; 2] {
        let mut out = [[0.0; LANES]; 2];
        for lane in 0..LANES {
            let [right, down, outwards] = self.faces[lane].project([x[lane], y[lane], z[lane]]);
            let ma = self.outwards[lane];
            // s = sc / (2 ma) + 1/2 by the quotient rule.
            let scale = 0.5 / (ma * ma);
            out[0][lane] = scale * (right * ma - self.right[lane] * outwards);
            out[1][lane] = scale * (down * ma - self.down[lane] * outwards);
        }
        out
    }
}

/// The levels that the lanes of a block read.
struct Choice {
    /// The level, or the finer of two.
    fine: [i32; LANES],
    /// How much of the next coarser level there is.
    part: Floats,
    /// Whether texels are interpolated within a level.
    linear: [bool; LANES],
}

impl Choice {
    fn new(lambda: &Floats, sampler: &Sampler, last: usize) -> Self {
        let mut choice = Self {
            fine: [0; LANES],
            part: [0.0; LANES],
            linear: [sampler.linear_magnification; LANES],
        };
        let last = last as f32;
        for (lane, &lambda) in lambda.iter().enumerate() {
            // NaN is magnified.
            let minified = lambda > 0.0;
            let lambda = if minified { lambda } else { 0.0 };
            let lambda = if lambda < last { lambda } else { last };
            let fine = floor(lambda);
            let part = lambda - fine;
            let (fine, part) = if sampler.linear_mip {
                (fine, part)
            } else {
                (if part > 0.5 { fine + 1.0 } else { fine }, 0.0)
            };
            choice.fine[lane] = index(fine);
            choice.part[lane] = part;
            if minified {
                choice.linear[lane] = sampler.linear_minification;
            }
        }
        choice
    }

    /// The finest and the coarsest level that the lanes of a mask read; none when it is empty.
    fn range(&self, mask: Mask) -> Option<(usize, usize)> {
        let mut range = None;
        for lane in mask.lanes() {
            let fine = self.fine[lane];
            let coarse = fine + i32::from(self.part[lane] > 0.0);
            let (low, high) = range.unwrap_or((fine, coarse));
            range = Some((low.min(fine), high.max(coarse)));
        }
        range.map(|(low, high)| (low as usize, high as usize))
    }
}

/// What happens at the ends of an axis.
#[derive(Clone, Copy)]
enum Edges {
    /// A wrap mode, and a number of texels that is added before.
    Wrap(Wrap, i32),
    /// The texels before the first and after the last are named as such, -1 and the size.
    Open,
}

/// The texels that the lanes of a block read along an axis.
struct Axis {
    /// The nearest texel, or the first of two.
    first: [i32; LANES],
    /// The other one, when filtering linearly.
    second: [i32; LANES],
    /// The weight of the other one.
    weight: Floats,
}

impl Default for Axis {
    fn default() -> Self {
        Self {
            first: [0; LANES],
            second: [0; LANES],
            weight: [0.0; LANES],
        }
    }
}

/// One lane's texels along an axis. On a cube they may be one step outside.
#[derive(Clone, Copy)]
struct Taps {
    first: usize,
    second: usize,
    weight: f32,
}

impl Axis {
    /// The texels for normalised coordinates on an axis of `size` texels. All in floats, which hold
    /// integers up to 2^24 exactly, and without branches, so that it vectorises.
    fn new(at: &Floats, size: u32, edges: Edges, linear: bool) -> Self {
        let mut axis = Self::default();
        let n = size as f32;
        let half = if linear { 0.5 } else { 0.0 };
        // Each closure makes (left texel, right texel) of the unwrapped left one.
        match edges {
            Edges::Open => {
                let limit = n - half;
                axis.fill(
                    at,
                    |at| (at * n - half).min(limit).max(-half),
                    |left| (left, left + 1.0),
                );
            }
            Edges::Wrap(Wrap::ClampToEdge, offset) => {
                let offset = offset.clamp(-(1 << 21), 1 << 21) as f32;
                let last = n - 1.0;
                let clamp = |i: f32| i.max(0.0).min(last);
                axis.fill(
                    at,
                    |at| at * n - half,
                    |left| (clamp(left + offset), clamp(left + offset + 1.0)),
                );
            }
            Edges::Wrap(Wrap::Repeat, offset) => {
                let offset = i64::from(offset).rem_euclid(i64::from(size)) as f32;
                let below = |i: f32| if i >= n { i - n } else { i };
                axis.fill(
                    at,
                    |at| fraction(at) * n - half,
                    |left| {
                        let left = left + offset;
                        let left = below(if left < 0.0 { left + n } else { left });
                        (left, below(left + 1.0))
                    },
                );
            }
            Edges::Wrap(Wrap::MirrorRepeat, offset) => {
                let offset = i64::from(offset).rem_euclid(2 * i64::from(size)) as f32;
                let period = 2.0 * n;
                let below = |i: f32| if i >= period { i - period } else { i };
                let mirror = |i: f32| if i >= n { period - 1.0 - i } else { i };
                axis.fill(
                    at,
                    |at| fraction(0.5 * at) * period - half,
                    |left| {
                        let left = left + offset;
                        let left = below(if left < 0.0 { left + period } else { left });
                        (mirror(left), mirror(below(left + 1.0)))
                    },
                );
            }
        }
        axis
    }

    #[inline(always)]
    fn fill(
        &mut self,
        at: &Floats,
        in_texels: impl Fn(f32) -> f32,
        wrap: impl Fn(f32) -> (f32, f32),
    ) {
        /// Beyond this, a coordinate has no fraction that is worth keeping; what is clamped stays exact.
        const FAR: f32 = 2_097_152.0;
        for (lane, &at) in at.iter().enumerate() {
            // NaN fails the comparison.
            let x = in_texels(at);
            let x = if x > -FAR { x } else { -FAR };
            let x = if x < FAR { x } else { FAR };
            let left = floor(x);
            let (first, second) = wrap(left);
            self.first[lane] = index(first);
            self.second[lane] = index(second);
            self.weight[lane] = x - left;
        }
    }

    #[inline(always)]
    fn taps(&self, lane: usize) -> Taps {
        Taps {
            first: self.first[lane] as usize,
            second: self.second[lane] as usize,
            weight: self.weight[lane],
        }
    }
}

impl Level {
    #[inline(always)]
    fn texel(&self, plane: usize, x: usize, y: usize) -> [f32; 4] {
        self.texels[(plane * self.height as usize + y) * self.width as usize + x]
    }

    /// Four texels of a plane, interpolated.
    #[inline(always)]
    fn bilinear(
        &self,
        plane: usize,
        x: Taps,
        y: Taps,
        read: impl Fn([f32; 4]) -> [f32; 4],
    ) -> [f32; 4] {
        let tap = |x, y| read(self.texel(plane, x, y));
        let top = mix(tap(x.first, y.first), tap(x.second, y.first), x.weight);
        let bottom = mix(tap(x.first, y.second), tap(x.second, y.second), x.weight);
        mix(top, bottom, y.weight)
    }

    /// The same on a cube's face, where texels may lie on its neighbours.
    #[inline(always)]
    fn bilinear_cube(
        &self,
        plane: usize,
        x: Taps,
        y: Taps,
        read: impl Fn([f32; 4]) -> [f32; 4],
    ) -> [f32; 4] {
        let tap = |x, y| read(self.cube_texel(plane, x, y));
        let top = mix(tap(x.first, y.first), tap(x.second, y.first), x.weight);
        let bottom = mix(tap(x.first, y.second), tap(x.second, y.second), x.weight);
        mix(top, bottom, y.weight)
    }

    /// A texel of a cube's face. One step beyond an edge (`usize::MAX` is -1) it is the neighbour's.
    #[inline(always)]
    fn cube_texel(&self, plane: usize, x: usize, y: usize) -> [f32; 4] {
        let size = self.width as usize;
        if x < size && y < size {
            self.texel(plane, x, y)
        } else {
            self.texel_beyond(plane, x as i32, y as i32)
        }
    }

    #[cold]
    fn texel_beyond(&self, plane: usize, x: i32, y: i32) -> [f32; 4] {
        let size = self.width as i32;
        let inside = |i: i32| (0..size).contains(&i);
        let clamp = |i: i32| i.clamp(0, size - 1) as usize;
        if inside(x) == inside(y) {
            return self.texel(plane, clamp(x), clamp(y));
        }
        // The middle of the texel, if the face went on, seen from the centre: the neighbour's
        // outermost texel, off by less than half a texel along the edge.
        let middle = |i: i32| (i as f32 + 0.5) / size as f32;
        let direction = cube_direction(plane % 6, middle(x), middle(y));
        let face = Face::of(direction);
        let [sc, tc, ma] = face.project(direction);
        let along = |c: f32| clamp(floor((0.5 * (c / ma) + 0.5) * size as f32) as i32);
        self.texel(
            plane - plane % 6 + face.index() as usize,
            along(sc),
            along(tc),
        )
    }
}

#[inline(always)]
fn store(out: &mut [Floats; 4], lane: usize, value: [f32; 4]) {
    for (out, value) in out.iter_mut().zip(value) {
        out[lane] = value;
    }
}

/// `a + (b - a) * t` per component.
#[inline(always)]
fn mix(a: [f32; 4], b: [f32; 4], t: f32) -> [f32; 4] {
    std::array::from_fn(|c| a[c] + (b[c] - a[c]) * t)
}

/// The largest integer not above a value of less than 2^22, by rounding at the end of the mantissa:
/// it vectorises everywhere, which `f32::floor` does on newer instruction sets only.
#[inline(always)]
fn floor(x: f32) -> f32 {
    const ROUND: f32 = 12_582_912.0;
    let rounded = (x + ROUND) - ROUND;
    if rounded > x { rounded - 1.0 } else { rounded }
}

/// An integer from -2^22 to 2^22, likewise.
#[inline(always)]
fn index(x: f32) -> i32 {
    const ROUND: f32 = 12_582_912.0;
    (x + ROUND).to_bits().wrapping_sub(ROUND.to_bits()) as i32
}

/// What a coordinate is above an integer, 0..=1; 0 from 2^21 on (where f32 has quarters at best), and for NaN.
#[inline(always)]
fn fraction(x: f32) -> f32 {
    let part = x - floor(x);
    if x.abs() < 2_097_152.0 { part } else { 0.0 }
}

/// A face of a cube.
#[derive(Clone, Copy, Default, PartialEq)]
struct Face {
    /// Its axis: 0, 1 or 2.
    axis: u32,
    /// 1 or -1: at which end.
    sign: f32,
}

impl Face {
    /// The face that a direction points at. Of equal axes z wins, then y.
    #[inline(always)]
    fn of([x, y, z]: [f32; 3]) -> Self {
        let y_wins = y.abs() >= x.abs();
        let (axis, along) = if y_wins { (1, y) } else { (0, x) };
        let z_wins = z.abs() >= along.abs();
        let (axis, along) = if z_wins { (2, z) } else { (axis, along) };
        Self {
            axis,
            sign: if along < 0.0 { -1.0 } else { 1.0 },
        }
    }

    /// +x, -x, +y, -y, +z, -z.
    #[inline(always)]
    fn index(self) -> u32 {
        2 * self.axis + u32::from(self.sign < 0.0)
    }

    /// A direction in the face's frame: to the right, down, and outwards.
    #[inline(always)]
    fn project(self, [x, y, z]: [f32; 3]) -> [f32; 3] {
        let (on_x, on_y) = (self.axis == 0, self.axis == 1);
        // One choice after the other rather than a match: it vectorises.
        let right = if on_x { -z } else { x };
        let right = if on_y { right } else { right * self.sign };
        let down = if on_y { z * self.sign } else { -y };
        let outwards = if on_x { x } else { z };
        let outwards = if on_y { y } else { outwards };
        [right, down, outwards * self.sign]
    }
}

/// The point of the unit cube's surface at coordinates of a face, both 0..1; faces are in the order of [`Dimension::Cube`].
pub fn cube_direction(face: usize, s: f32, t: f32) -> [f32; 3] {
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
    use crate::texture::Image;

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
            let direction = cube_direction(face, s, t);
            let found = Face::of(direction);
            assert_eq!(found.index() as usize, face);
            let [sc, tc, ma] = found.project(direction);
            assert!((0.5 * (sc / ma) + 0.5 - s).abs() < 1e-6);
            assert!((0.5 * (tc / ma) + 0.5 - t).abs() < 1e-6);
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
