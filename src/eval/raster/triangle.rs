//! One triangle on the pixel grid: clipping, which pixels it covers, how values vary over it.
//!
//! Coverage comes from the clipped polygon, in fixed point. Values come from the whole triangle in homogeneous
//! coordinates, so that clipping does not touch them.
//! This work is based on: Olano and Greer, Triangle scan conversion using 2D homogeneous coordinates, 1997, section 3.

use super::Target;

/// Sub-pixel steps, as a power of two.
const STEPS: i64 = 256;
/// How far from the origin a clipped polygon may reach, in pixels. With 8 bits below the pixel, an edge function
/// then needs 49 bits.
const GUARD: f64 = 32_768.0;
/// The smallest w that is kept by clipping.
const MIN_W: f64 = 1e-20;

/// A triangle that may cover something.
pub(super) struct Triangle {
    /// Its place in the mesh.
    pub(super) index: u32,
    /// Its vertices.
    pub(super) corners: [u32; 3],
    /// Whether it is counter-clockwise on screen.
    pub(super) front: bool,
    /// For each corner, its weight over w, as a plane in fine pixels: `p[0] x + p[1] y + p[2]`.
    weights: [[f64; 3]; 3],
    /// One over w.
    inverse_w: [f64; 3],
    /// Depth.
    depth: [f64; 3],
    /// The w of each corner.
    w: [f64; 3],
    /// The triangles that the clipped polygon is made of.
    parts: Vec<Part>,
}

/// A snapped triangle, wholly in front of the eye.
struct Part {
    /// Inside is where all are at least 0, at the centres of pixels.
    edges: [Edge; 3],
    /// First and last pixel in x and y.
    x: [i64; 2],
    y: [i64; 2],
}

/// An edge function at pixel centres: `a x + b y + c`, less one where a centre on the edge is outside.
struct Edge {
    a: i64,
    b: i64,
    c: i64,
}

/// A vertex in pixels times w, with depth times w, and w.
type Point = [f64; 4];

impl Triangle {
    /// A triangle of these vertices, or none when it is behind the eye, outside of the target, without area,
    /// or has a corner that is not finite or not there.
    pub(super) fn new(
        index: u32,
        corners: [u32; 3],
        positions: &[[f32; 4]],
        target: &Target,
    ) -> Option<Self> {
        let mut points = [[0.0; 4]; 3];
        for (point, &corner) in points.iter_mut().zip(&corners) {
            *point = to_pixels(*positions.get(corner as usize)?, target)?;
        }
        // Most triangles of a dense mesh lie between the centres of pixels.
        let parts = parts(&points, target);
        if parts.is_empty() {
            return None;
        }
        let [p, q, r] = points.map(|[x, y, _, w]| [x, y, w]);
        let normals = [cross(q, r), cross(r, p), cross(p, q)];
        let volume = p[0] * normals[0][0] + p[1] * normals[0][1] + p[2] * normals[0][2];
        let weights = normals.map(|n| n.map(|c| c / volume));
        if !weights.as_flattened().iter().all(|c| c.is_finite()) {
            return None;
        }
        let plane = |values: [f64; 3]| {
            [0, 1, 2].map(|i| {
                weights[0][i] * values[0] + weights[1][i] * values[1] + weights[2][i] * values[2]
            })
        };
        Some(Self {
            index,
            corners,
            // With y down, what is counter-clockwise to the eye has a negative area.
            front: volume < 0.0,
            weights,
            inverse_w: plane([1.0; 3]),
            depth: plane(points.map(|p| p[2])),
            w: points.map(|p| p[3]),
            parts,
        })
    }

    /// Calls back for every 2 x 2 quad that it covers some of, with the quad's top-left pixel and a bit for each
    /// pixel. A pixel on an edge that is shared with a neighbour belongs to one of the two.
    pub(super) fn scan(&self, mut visit: impl FnMut(u32, u32, u8)) {
        for part in &self.parts {
            let mut y = part.y[0] & !1;
            while y <= part.y[1] {
                let mut x = part.x[0] & !1;
                while x <= part.x[1] {
                    let mut mask = 15;
                    for edge in &part.edges {
                        let at = edge.a * x + edge.b * y + edge.c;
                        let four = [at, at + edge.a, at + edge.b, at + edge.a + edge.b];
                        for (i, value) in four.iter().enumerate() {
                            mask &= !(u8::from(*value < 0) << i);
                        }
                    }
                    // A quad sticks out of a target with an odd side.
                    if x == part.x[1] {
                        mask &= 0b0101;
                    }
                    if y == part.y[1] {
                        mask &= 0b0011;
                    }
                    if mask != 0 {
                        visit(x as u32, y as u32, mask);
                    }
                    x += 2;
                }
                y += 2;
            }
        }
    }

    /// Depth at the centre of a pixel, or none where the triangle is not in front of the eye.
    /// Snapping may put a centre a little outside of the triangle, so depth is clamped to 0 from below.
    pub(super) fn depth(&self, x: u32, y: u32) -> Option<f32> {
        let at = centre(x, y);
        let depth = evaluate(&self.depth, at) as f32;
        (evaluate(&self.inverse_w, at) > 0.0 && depth < 1.0).then_some(depth.max(0.0))
    }

    /// One over w at the centre of a pixel.
    pub(super) fn inverse_w(&self, x: u32, y: u32) -> f64 {
        evaluate(&self.inverse_w, centre(x, y))
    }

    /// The weights of the corners at the centre of a pixel, perspective-correct. They sum to 1.
    pub(super) fn perspective(&self, x: u32, y: u32) -> [f64; 3] {
        let at = centre(x, y);
        let w = 1.0 / evaluate(&self.inverse_w, at);
        self.weights.map(|plane| evaluate(&plane, at) * w)
    }

    /// The weights of the corners at the centre of a pixel, linear on screen. They sum to 1 but for rounding.
    pub(super) fn linear(&self, x: u32, y: u32) -> [f64; 3] {
        let at = centre(x, y);
        [0, 1, 2].map(|i| evaluate(&self.weights[i], at) * self.w[i])
    }
}

fn centre(x: u32, y: u32) -> [f64; 2] {
    [f64::from(x) + 0.5, f64::from(y) + 0.5]
}

fn evaluate(plane: &[f64; 3], [x, y]: [f64; 2]) -> f64 {
    plane[0] * x + plane[1] * y + plane[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// A clip position in fine pixels (times w), moved so that samples are at the centres; none unless it is finite.
fn to_pixels(position: [f32; 4], target: &Target) -> Option<Point> {
    if !position.iter().all(|c| c.is_finite()) {
        return None;
    }
    let [x, y, z, w] = position.map(f64::from);
    let grid = f64::from(target.grid);
    let [dx, dy] = target.offset.map(|o| f64::from(o) * grid);
    Some([
        (0.5 * (x + w)) * f64::from(target.width) - dx * w,
        (0.5 * (w - y)) * f64::from(target.height) - dy * w,
        z,
        w,
    ])
}

/// Clips a triangle and snaps what is left.
fn parts(points: &[Point; 3], target: &Target) -> Vec<Part> {
    // Signed distances, at least 0 inside. The far plane is left to the depth test.
    let planes: [fn(&Point) -> f64; 6] = [
        |p| p[2],
        |p| p[3] - MIN_W,
        |p| p[0] + GUARD * p[3],
        |p| GUARD * p[3] - p[0],
        |p| p[1] + GUARD * p[3],
        |p| GUARD * p[3] - p[1],
    ];
    let snap = |p: &Point| [0, 1].map(|i| (p[i] / p[3] * STEPS as f64 + 0.5).floor() as i64);
    if planes
        .iter()
        .all(|plane| points.iter().all(|p| plane(p) >= 0.0))
    {
        let part = Part::new([0, 1, 2].map(|i| snap(&points[i])), target);
        return part.into_iter().collect();
    }
    let mut polygon = points.to_vec();
    for plane in planes {
        if polygon.iter().any(|p| plane(p) < 0.0) {
            polygon = clip(&polygon, plane);
        }
    }
    let snapped: Vec<[i64; 2]> = polygon.iter().map(snap).collect();
    let Some((&first, rest)) = snapped.split_first() else {
        return Vec::new();
    };
    rest.windows(2)
        .filter_map(|pair| Part::new([first, pair[0], pair[1]], target))
        .collect()
}

/// The part of a polygon where a distance is at least 0.
fn clip(polygon: &[Point], distance: fn(&Point) -> f64) -> Vec<Point> {
    let mut out = Vec::with_capacity(polygon.len() + 1);
    for (i, here) in polygon.iter().enumerate() {
        let next = &polygon[(i + 1) % polygon.len()];
        let (d, e) = (distance(here), distance(next));
        if d >= 0.0 {
            out.push(*here);
        }
        if (d < 0.0) != (e < 0.0) {
            // Always from the inside, so that the neighbour across this edge finds the same point.
            let (inside, outside, d, e) = if d >= 0.0 {
                (here, next, d, e)
            } else {
                (next, here, e, d)
            };
            let t = d / (d - e);
            out.push([0, 1, 2, 3].map(|c| inside[c] + (outside[c] - inside[c]) * t));
        }
    }
    out
}

impl Part {
    /// A snapped triangle, or none when it covers nothing of the target.
    fn new(mut corners: [[i64; 2]; 3], target: &Target) -> Option<Self> {
        let [a, b, c] = corners;
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if area == 0 {
            return None;
        }
        if area < 0 {
            corners.swap(1, 2);
        }
        let range = |i: usize, size: u32| {
            let all = corners.map(|c| c[i]);
            let low = all[0].min(all[1]).min(all[2]);
            let high = all[0].max(all[1]).max(all[2]);
            // Pixels whose centres may be inside.
            let first = (low - STEPS / 2).div_euclid(STEPS).max(0);
            let last = (high - STEPS / 2)
                .div_euclid(STEPS)
                .min(i64::from(size) - 1);
            (first <= last).then_some([first, last])
        };
        Some(Self {
            edges: [0, 1, 2].map(|i| Edge::new(corners[i], corners[(i + 1) % 3])),
            x: range(0, target.width)?,
            y: range(1, target.height)?,
        })
    }
}

impl Edge {
    /// The edge between two corners of a triangle that is clockwise to the eye.
    fn new(from: [i64; 2], to: [i64; 2]) -> Self {
        let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
        let top_left = dy < 0 || dy == 0 && dx > 0;
        let half = STEPS / 2;
        Self {
            a: -dy * STEPS,
            b: dx * STEPS,
            c: dx * (half - from[1]) - dy * (half - from[0]) - i64::from(!top_left),
        }
    }
}
