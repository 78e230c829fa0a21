//! Which level an object is drawn with: the arithmetic, for hosts that have neither lodc nor the standard library.
//!
//! ```text
//! Camera, Object --rho--> pixels per object unit --auto_lod--> autoLOD --level--> level, its middle for the shader
//! ```

/// How far a threshold must be passed before the level changes, in halvings of scale. A twentieth of a halving is 3.5 % of the
/// distance.
pub const HYSTERESIS: f64 = 0.05;

/// Who looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Where the eye is, in world units.
    pub eye: [f32; 3],
    /// The vertical field of view in degrees, between 0 and 180.
    pub fov: f32,
    /// The height of the picture in pixels.
    pub height: f32,
    /// The distance of the near clip plane in world units, above 0.
    pub z_near: f32,
}

/// What is looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Object {
    /// From object units to world units, column by column.
    pub model: [[f32; 4]; 4],
    /// The centre of its bounding sphere, in object units.
    pub centre: [f32; 3],
    /// The radius of that sphere, in object units.
    pub radius: f32,
}

/// Pixels per object unit at the object's nearest point.
pub fn rho(camera: &Camera, object: &Object) -> f64 {
    let columns = object.model.map(|column| column.map(f64::from));
    let mut square = 0.0;
    for axis in 0..3 {
        let mut centre = columns[3][axis];
        for (column, along) in columns.iter().zip(object.centre) {
            centre += column[axis] * f64::from(along);
        }
        let away = centre - f64::from(camera.eye[axis]);
        square += away * away;
    }
    let stretched = s_max(&object.model);
    let nearest = sqrt(square) - stretched * f64::from(object.radius);
    let focal = f64::from(camera.height) / 2.0 * cot_of_half(f64::from(camera.fov).to_radians());
    stretched * focal / nearest.max(f64::from(camera.z_near))
}

/// Halvings of scale between `rho0` and `rho`: 0 at the nearest distance that levels were made for and nearer, one more each
/// time that `rho` halves. 0 when either is no positive number, so that a broken view gets the original.
pub fn auto_lod(rho0: f64, rho: f64) -> f64 {
    if rho0 > 0.0 && rho > 0.0 && rho0.is_finite() {
        log2(rho0 / rho).max(0.0)
    } else {
        0.0
    }
}

/// The level to draw: the last one whose threshold has been reached, 0 for the original. With the level that was drawn before
/// (`current`), it changes only when the threshold between has been passed by [`HYSTERESIS`].
pub fn level(thresholds: &[f32], auto_lod: f64, current: Option<usize>) -> usize {
    let at = |x: f64| {
        let reached = thresholds
            .iter()
            .take_while(|start| x >= f64::from(**start));
        reached.count()
    };
    match current {
        None => at(auto_lod),
        Some(current) => {
            let up = at(auto_lod - HYSTERESIS);
            let down = at(auto_lod + HYSTERESIS);
            current.clamp(up, down.max(up))
        }
    }
}

/// The autoLOD to hand to the shader for a level: the middle of its interval, and for the last level half a halving above its
/// threshold. Level 0 gets 0.
pub fn middle(thresholds: &[f32], level: usize) -> f32 {
    let start = level
        .checked_sub(1)
        .and_then(|before| thresholds.get(before));
    match (start, thresholds.get(level)) {
        (None, _) => 0.0,
        (Some(start), Some(end)) => (start + end) / 2.0,
        (Some(start), None) => start + 0.5,
    }
}

/// The most that a model matrix stretches any direction: its largest singular value, by Jacobi's rotations.
pub fn s_max(model: &[[f32; 4]; 4]) -> f64 {
    let columns = [model[0], model[1], model[2]].map(|c| [c[0], c[1], c[2]].map(f64::from));
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    // The squares of the singular values are the eigenvalues of the transpose times the matrix.
    let mut a = columns.map(|i| columns.map(|j| dot(i, j)));
    for _ in 0..8 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q] == 0.0 {
                continue;
            }
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let (sign, size) = if theta < 0.0 {
                (-1.0, -theta)
            } else {
                (1.0, theta)
            };
            let t = sign / (size + sqrt(size * size + 1.0));
            let c = 1.0 / sqrt(t * t + 1.0);
            let s = t * c;
            for row in &mut a {
                (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
            }
            let (above, below) = (a[p], a[q]);
            for k in 0..3 {
                a[p][k] = c * above[k] - s * below[k];
                a[q][k] = s * above[k] + c * below[k];
            }
        }
    }
    sqrt(a[0][0].max(a[1][1]).max(a[2][2]))
}

/// The square root, 0 of what is not above 0. `core` has none.
fn sqrt(x: f64) -> f64 {
    if !(x > 0.0 && x.is_finite()) {
        return if x > 0.0 { x } else { 0.0 };
    }
    // Half the exponent is within 6 %, and each step doubles the digits.
    let mut root = f64::from_bits((x.to_bits() >> 1) + (1023 << 51));
    for _ in 0..5 {
        root = (root + x / root) / 2.0;
    }
    root
}

/// The logarithm to the base 2 of a number above 0.
fn log2(x: f64) -> f64 {
    let bits = x.to_bits();
    let mut exponent = ((bits >> 52) & 0x7ff) as f64 - 1023.0;
    let mut rest = f64::from_bits((bits & ((1 << 52) - 1)) | (1023 << 52));
    if rest > core::f64::consts::SQRT_2 {
        rest /= 2.0;
        exponent += 1.0;
    }
    // The series of the inverse hyperbolic tangent: the last term is below 1e-17.
    let s = (rest - 1.0) / (rest + 1.0);
    let mut sum = 0.0;
    for term in (0..12).rev() {
        sum = sum * (s * s) + 1.0 / f64::from(2 * term + 1);
    }
    exponent + 2.0 * core::f64::consts::LOG2_E * s * sum
}

/// The cotangent of half an angle between 0 and pi.
fn cot_of_half(angle: f64) -> f64 {
    let quarter = angle / 4.0;
    let square = -quarter * quarter;
    let (mut sine, mut cosine) = (0.0, 0.0);
    for term in (0..10).rev() {
        let term = f64::from(2 * term);
        cosine = cosine * (square / ((term + 1.0) * (term + 2.0))) + 1.0;
        sine = sine * (square / ((term + 2.0) * (term + 3.0))) + 1.0;
    }
    let tangent = quarter * sine / cosine;
    (1.0 - tangent * tangent) / (2.0 * tangent)
}
