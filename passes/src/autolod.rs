//! Distance, autoLOD and the error bound: the numbers that a host and the compiler must agree on.
//!
//! `autoLOD` counts halvings of scale on screen since the nearest view of the scene: 0 there, 1 at half
//! the pixels per object unit, and so on. It is the shift in MIP level, and it grows with distance.
//!
//! ```text
//! View --rho--> pixels per object unit --auto_lod--> autoLOD --level--> level, its middle for the shader
//! autoLOD --distance_of--> distance --bound--> the error that is allowed there
//! ```

/// How the error of a level is held against what [`bound`] allows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum BoundReading {
    /// What the level adds to the original's own error may be as much, root mean square, over a pixel's channels.
    #[default]
    Excess,
    /// Liang's own: the error against `e_a(d) * s_d` (2022, equations 3 and 6). The error is the sum of squared differences
    /// over pixels and channels, and `s_d` the size of the object on screen, in pixels.
    Paper,
}

impl BoundReading {
    /// Its name in scenes, locks and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Excess => "excess",
            Self::Paper => "paper",
        }
    }

    /// The reading of a name.
    pub fn of_name(name: &str) -> Option<Self> {
        [Self::Excess, Self::Paper]
            .into_iter()
            .find(|reading| reading.name() == name)
    }
}

/// How far the selection of a level must be overshot before the host changes it, in halvings of scale.
/// A twentieth of a halving is 3.5 % of the distance.
pub const HYSTERESIS: f64 = 0.05;

/// What decides how large an object is on screen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The largest factor by which the model matrix stretches anything ([`s_max`]); 1 for none.
    pub s_max: f64,
    /// From the eye to the centre of the object's bounding sphere, world units.
    pub distance: f64,
    /// Radius of that sphere, world units.
    pub radius: f64,
    /// Distance of the near clip plane, world units, above 0: nothing nearer is seen.
    pub z_near: f64,
    /// Height of the picture, pixels.
    pub height: f64,
    /// Vertical field of view, degrees, between 0 and 180.
    pub fov: f64,
}

/// Pixels per object unit at the object's nearest point.
pub fn rho(view: &View) -> f64 {
    let focal = view.height / 2.0 / libm::tan(view.fov.to_radians() / 2.0);
    view.s_max * focal / (view.distance - view.radius).max(view.z_near)
}

/// Halvings of scale between `rho0`, the pixels per object unit at the nearest distance of the scene,
/// and `rho`: 0 at that distance and nearer, one more each time that `rho` halves.
/// 0 when either is no positive number, so that a broken view gets the original.
pub fn auto_lod(rho0: f64, rho: f64) -> f64 {
    if rho0 > 0.0 && rho > 0.0 && rho0.is_finite() {
        libm::log2(rho0 / rho).max(0.0)
    } else {
        0.0
    }
}

/// The distance from the eye to the centre, in world units, at which a view of the given shape reaches
/// `auto_lod`: the inverse of [`auto_lod`] after [`rho`]. The distance in `view` does not enter.
/// At 0 it is the farthest distance that still has autoLOD 0.
pub fn distance_of(auto_lod: f64, rho0: f64, view: &View) -> f64 {
    let focal = view.height / 2.0 / libm::tan(view.fov.to_radians() / 2.0);
    view.radius + view.s_max * focal / rho0 * libm::exp2(auto_lod)
}

/// The largest singular value of a model matrix's linear part: the most that it stretches any direction. The matrix is given column
/// by column.
pub fn s_max(model: &[[f32; 4]; 4]) -> f64 {
    let columns = [model[0], model[1], model[2]].map(|[x, y, z, _]| [x, y, z].map(f64::from));
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    // The squares of the singular values are the eigenvalues of the transpose times the matrix.
    let mut a: [[f64; 3]; 3] = columns.map(|i| columns.map(|j| dot(i, j)));
    // Jacobi rotations converge quadratically; eight sweeps are far more than 3 x 3 needs.
    for _ in 0..8 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            rotate(&mut a, p, q);
        }
    }
    a[0][0].max(a[1][1]).max(a[2][2]).max(0.0).sqrt()
}

/// One Jacobi rotation: makes `a[p][q]` of a symmetric matrix zero.
fn rotate(a: &mut [[f64; 3]; 3], p: usize, q: usize) {
    if a[p][q] == 0.0 {
        return;
    }
    let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
    let c = 1.0 / (t * t + 1.0).sqrt();
    let s = t * c;
    for row in a.iter_mut() {
        (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
    }
    let (above, below) = (a[p], a[q]);
    a[p] = std::array::from_fn(|k| c * above[k] - s * below[k]);
    a[q] = std::array::from_fn(|k| s * above[k] + c * below[k]);
}

/// The level to draw: the last one whose threshold has been reached. `thresholds` are those of levels 1
/// and up, rising; level 0 is the original. An autoLOD that is not a number gets level 0.
///
/// With the level that was drawn before (`current`), it changes only when the threshold between has been
/// passed by `hysteresis` (see [`HYSTERESIS`]), so that an object at a threshold does not flicker.
pub fn level(thresholds: &[f64], auto_lod: f64, current: Option<usize>, hysteresis: f64) -> usize {
    let at = |x: f64| thresholds.iter().take_while(|&&t| x >= t).count();
    match current {
        None => at(auto_lod),
        Some(current) => {
            let up = at(auto_lod - hysteresis);
            let down = at(auto_lod + hysteresis);
            current.clamp(up, down.max(up))
        }
    }
}

/// The autoLOD to hand to the shader for a level: the middle of its interval, and for the last level half
/// a halving above its threshold, so that rounding never puts shader and mesh on different levels.
/// Level 0 gets exactly 0.
pub fn middle(thresholds: &[f64], level: usize) -> f64 {
    let Some(start) = level.checked_sub(1).and_then(|i| thresholds.get(i)) else {
        return 0.0;
    };
    match thresholds.get(level) {
        Some(end) => (start + end) / 2.0,
        None => start + 0.5,
    }
}

/// The error that is allowed at `distance`, in display-referred values 0..1:
/// `((d - near) / (far - near))^Q * e_max` (Liang 2022, equation 4).
/// 0 up to `near`, and `e_max` from `far` on. `q` is 0 or more.
pub fn bound(distance: f64, near: f64, far: f64, e_max: f64, q: f64) -> f64 {
    if distance >= far {
        return e_max;
    }
    let t = (distance - near) / (far - near);
    if t > 0.0 {
        libm::pow(t, q) * e_max
    } else {
        0.0
    }
}

/// `count` distances from `nearest` to `farthest`, nearest first, each the same factor from the last.
/// Both ends are exact. One distance is the nearest alone.
pub fn distances(nearest: f64, farthest: f64, count: usize) -> Vec<f64> {
    let step = libm::log2(farthest / nearest) / (count.max(2) - 1) as f64;
    (0..count)
        .map(|i| match i {
            0 => nearest,
            _ if i + 1 == count => farthest,
            _ => nearest * libm::exp2(step * i as f64),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Mat4, Quat, Vec3};

    const VIEW: View = View {
        s_max: 1.0,
        distance: 3.0,
        radius: 1.0,
        z_near: 0.1,
        height: 256.0,
        fov: 90.0,
    };

    fn at(distance: f64) -> View {
        View { distance, ..VIEW }
    }

    #[test]
    fn rho_counts_pixels_at_the_nearest_point() {
        // With 90 degrees the half height is as wide as the distance: 128 pixels for 2 units.
        assert!((rho(&VIEW) - 64.0).abs() < 1e-9);
        assert!((rho(&View { s_max: 3.0, ..VIEW }) - 192.0).abs() < 1e-9);
        // Inside the sphere, the near plane decides.
        assert_eq!(rho(&at(0.5)), rho(&at(0.0)));
        assert!((rho(&at(0.5)) - 1280.0).abs() < 1e-6);
    }

    #[test]
    fn auto_lod_is_zero_at_the_nearest_and_grows_with_distance() {
        let rho0 = rho(&VIEW);
        let mut last = 0.0;
        for i in 0..1000 {
            let lod = auto_lod(rho0, rho(&at(0.1 * f64::from(i))));
            assert!(lod >= last, "{i}: {lod} < {last}");
            if 0.1 * f64::from(i) <= 3.0 {
                assert_eq!(lod, 0.0);
            }
            last = lod;
        }
        assert_eq!(auto_lod(rho0, rho(&at(5.0))), 1.0);
        assert_eq!(auto_lod(rho0, rho(&at(9.0))), 2.0);
    }

    #[test]
    fn a_broken_view_gets_the_original() {
        for (rho0, rho) in [
            (f64::NAN, 1.0),
            (1.0, f64::NAN),
            (0.0, 1.0),
            (1.0, 0.0),
            (-1.0, 2.0),
            (f64::INFINITY, 1.0),
        ] {
            assert_eq!(auto_lod(rho0, rho), 0.0);
        }
        assert_eq!(level(&[0.5], f64::NAN, None, 0.0), 0);
    }

    #[test]
    fn distance_is_the_inverse_of_auto_lod() {
        let rho0 = rho(&VIEW);
        for lod in [0.0, 0.3, 1.0, 2.7, 6.0] {
            let d = distance_of(lod, rho0, &VIEW);
            assert!((auto_lod(rho0, rho(&at(d))) - lod).abs() < 1e-12);
        }
        assert!((distance_of(0.0, rho0, &VIEW) - 3.0).abs() < 1e-12);
        // Half the window reaches the same level one halving sooner.
        let small = View {
            height: 128.0,
            ..VIEW
        };
        assert!((distance_of(1.0, rho0, &small) - 3.0).abs() < 1e-12);
    }

    #[test]
    fn s_max_is_the_largest_stretch() {
        let s_max = |model: &Mat4| s_max(&model.to_cols_array_2d());
        let turned = Mat4::from_scale_rotation_translation(
            Vec3::new(0.5, 3.0, 2.0),
            Quat::from_euler(glam::EulerRot::XYZ, 0.4, 1.1, -2.0),
            Vec3::new(7.0, 8.0, 9.0),
        );
        assert!((s_max(&turned) - 3.0).abs() < 1e-5);
        assert!(
            (s_max(&turned.transpose())
                - s_max(&Mat4::from_mat3(glam::Mat3::from_mat4(turned).transpose())))
            .abs()
                < 1e-5
        );
        assert_eq!(s_max(&Mat4::IDENTITY), 1.0);
        assert_eq!(s_max(&Mat4::ZERO), 0.0);
        // A shear stretches by more than any of its columns' lengths in the other direction.
        let shear = Mat4::from_cols_array_2d(&[
            [1.0, 0.0, 0.0, 0.0],
            [1.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 1.0, 0.0],
            [0.0, 0.0, 0.0, 1.0],
        ]);
        let golden = (1.0 + 5f64.sqrt()) / 2.0;
        assert!((s_max(&shear) - golden).abs() < 1e-9);
        // Nothing is stretched by more.
        for i in 0..200 {
            let a = 0.1 * i as f32;
            let v = Vec3::new(a.cos() * (0.7 * a).sin(), a.sin(), (1.3 * a).cos()).normalize();
            let length = f64::from(turned.transform_vector3(v).length());
            assert!(length <= s_max(&turned) + 1e-5);
        }
    }

    #[test]
    fn levels_change_at_thresholds_and_stick_within_the_hysteresis() {
        let t = [0.5, 1.5, 3.0];
        let plain = |x| level(&t, x, None, HYSTERESIS);
        assert_eq!(
            [0.0, 0.49, 0.5, 1.6, 3.0, 99.0].map(plain),
            [0, 0, 1, 2, 3, 3]
        );
        let from = |current, x| level(&t, x, Some(current), 0.1);
        assert_eq!(from(0, 0.55), 0);
        assert_eq!(from(0, 0.61), 1);
        assert_eq!(from(1, 0.45), 1);
        assert_eq!(from(1, 0.39), 0);
        // A jump lands where it belongs.
        assert_eq!(from(0, 10.0), 3);
        assert_eq!(from(3, 0.0), 0);
        // A level that no longer exists does not stay.
        assert_eq!(from(9, 0.0), 0);
    }

    #[test]
    fn the_middle_is_inside_its_level() {
        let t = [0.5, 1.5, 3.0];
        for l in 0..=3 {
            assert_eq!(level(&t, middle(&t, l), None, 0.0), l);
        }
        assert_eq!(middle(&t, 0), 0.0);
        assert_eq!(middle(&t, 2), 2.25);
        assert_eq!(middle(&t, 3), 3.5);
        assert_eq!(middle(&t, 9), 0.0);
    }

    #[test]
    fn the_bound_rises_from_nothing_to_e_max() {
        let e = |d| bound(d, 2.0, 40.0, 0.05, 0.5);
        assert_eq!(e(0.0), 0.0);
        assert_eq!(e(2.0), 0.0);
        assert_eq!(e(40.0), 0.05);
        assert_eq!(e(1000.0), 0.05);
        assert!((e(11.5) - 0.025).abs() < 1e-12);
        let mut last = 0.0;
        for i in 0..500 {
            let now = e(0.1 * f64::from(i));
            assert!(now >= last);
            last = now;
        }
        // An exponent of 0 allows everything at once, but nothing at the nearest distance.
        assert_eq!(bound(2.0, 2.0, 40.0, 0.05, 0.0), 0.0);
        assert_eq!(bound(2.1, 2.0, 40.0, 0.05, 0.0), 0.05);
        // A single distance allows all of it.
        assert_eq!(bound(2.0, 2.0, 2.0, 0.05, 0.5), 0.05);
    }

    #[test]
    fn distances_are_spaced_by_a_factor() {
        let d = distances(2.0, 32.0, 5);
        for (have, want) in d.iter().zip([2.0, 4.0, 8.0, 16.0, 32.0]) {
            assert!((have - want).abs() < 1e-12);
        }
        assert_eq!((d[0], d[4]), (2.0, 32.0));
        assert_eq!(distances(2.0, 40.0, 1), [2.0]);
        assert_eq!(distances(2.0, 40.0, 2), [2.0, 40.0]);
        assert!(distances(2.0, 40.0, 0).is_empty());
    }
}
