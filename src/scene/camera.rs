//! The camera: it looks at the centre of the object's bounding sphere, in WGSL's clip space.
//!
//! All of it is f64 arithmetic without platform functions, so that matrices have the same bits everywhere.

use super::buffers::Draw;
use super::chance::{child, unit};
use glam::{DMat3, DMat4, DVec3, DVec4};

/// A sphere around an object, world units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Its centre.
    pub centre: DVec3,
    /// Its radius, above 0.
    pub radius: f64,
}

/// What a picture is taken with: everything that the built-in uniforms of a shader are made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Object to world.
    pub model: DMat4,
    /// World to view: the eye at the origin, looking along -z, y up.
    pub view: DMat4,
    /// View to clip: z from 0 at the near plane to 1 at the far one.
    pub projection: DMat4,
    /// The eye, world units.
    pub eye: DVec3,
    /// Width and height in pixels.
    pub resolution: [u32; 2],
}

/// What a frame is a picture of.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shot {
    /// A unit vector from the centre of the object's bounding sphere to the eye.
    pub direction: DVec3,
    /// From the eye to that centre, world units.
    pub distance: f64,
    /// What the sampled uniforms hold in it.
    pub draw: Draw,
}

/// The nearest near plane, as a share of the sphere's radius.
const NEAREST_PLANE: f64 = 0.01;

/// The near plane for an eye at `distance` from the sphere's centre: in front of the sphere, where the
/// eye is outside.
pub(crate) fn z_near(distance: f64, radius: f64) -> f64 {
    (0.9 * (distance - radius)).max(NEAREST_PLANE * radius)
}

impl Pose {
    /// A pose at `distance` from the centre of a sphere, along `direction` (a unit vector from the centre to
    /// the eye), with a vertical field of view in degrees.
    pub fn new(
        model: DMat4,
        sphere: Sphere,
        direction: DVec3,
        distance: f64,
        fov: f64,
        resolution: [u32; 2],
    ) -> Self {
        let eye = sphere.centre + direction * distance;
        let [width, height] = resolution.map(f64::from);
        Self {
            model,
            view: look_at(eye, direction),
            projection: perspective(
                fov,
                width / height,
                z_near(distance, sphere.radius),
                1.1 * (distance + sphere.radius),
            ),
            eye,
            resolution,
        }
    }

    /// The pose for a pass over a picture that was sampled off its pixels' centres, by `offset` in pixels, at `grid`
    /// fine pixels a pixel: at the centres of the pass's pixels is what was drawn there.
    pub(crate) fn moved(&self, offset: [f32; 2], grid: u32) -> Self {
        let [width, height] = self.resolution.map(f64::from);
        let [x, y] = offset.map(f64::from);
        let shift = DVec3::new(-2.0 * x / width, 2.0 * y / height, 0.0);
        Self {
            projection: DMat4::from_translation(shift) * self.projection,
            resolution: self.resolution.map(|n| n * grid),
            ..*self
        }
    }

    /// World to clip.
    pub fn view_projection(&self) -> DMat4 {
        self.projection * self.view
    }

    /// The matrix that takes normals to world space: the inverse transpose of the model's linear part.
    /// Of a model that flattens, the linear part itself.
    pub fn normal_matrix(&self) -> DMat3 {
        let linear = DMat3::from_mat4(self.model);
        match linear.determinant() {
            0.0 => linear,
            _ => linear.inverse().transpose(),
        }
    }
}

/// World to view for an eye whose view is along `-back`.
fn look_at(eye: DVec3, back: DVec3) -> DMat4 {
    // Straight from above or below, the top of the picture is -z.
    let up = match back.y.abs() > 0.999 {
        true => DVec3::NEG_Z,
        false => DVec3::Y,
    };
    let right = up.cross(back).normalize();
    let up = back.cross(right);
    let axes = DMat3::from_cols(right, up, back).transpose();
    let offset = -(axes * eye);
    DMat4::from_cols(
        axes.x_axis.extend(0.0),
        axes.y_axis.extend(0.0),
        axes.z_axis.extend(0.0),
        offset.extend(1.0),
    )
}

/// View to clip, depth 0 at `near` and 1 at `far`.
fn perspective(fov: f64, aspect: f64, near: f64, far: f64) -> DMat4 {
    let focal = 1.0 / libm::tan(fov.to_radians() / 2.0);
    let depth = far / (near - far);
    DMat4::from_cols(
        DVec4::new(focal / aspect, 0.0, 0.0, 0.0),
        DVec4::new(0.0, focal, 0.0, 0.0),
        DVec4::new(0.0, 0.0, depth, -1.0),
        DVec4::new(0.0, 0.0, near * depth, 0.0),
    )
}

/// `count` directions spread evenly over the cap of the unit sphere within `angle` (radians) of `axis`:
/// a spiral of equal areas, the same always. The first is `axis` itself when there is one only.
pub(crate) fn spread(count: usize, axis: DVec3, angle: f64) -> Vec<DVec3> {
    if count == 1 {
        return vec![axis];
    }
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    (0..count)
        .map(|i| {
            let share = (i as f64 + 0.5) / count as f64;
            on_cap(axis, angle, share, golden * i as f64)
        })
        .collect()
}

/// How far a listed direction is turned, at most, for a view that decides nothing, in radians: 11 degrees.
pub const TURN: f64 = 0.2;

/// Where views come from that the scene does not list.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Around {
    /// From a cap of the sphere: its axis, and its angle in radians.
    Cap(DVec3, f64),
    /// From around the directions that are listed.
    Listed,
}

impl Around {
    /// A direction by chance.
    pub(super) fn view(self, listed: &[DVec3], seed: u64) -> DVec3 {
        match self {
            Self::Cap(axis, angle) => within(axis, angle, seed),
            Self::Listed => {
                let one = (unit(child(seed, 0)) * listed.len() as f64) as usize;
                let direction = listed.get(one).copied().unwrap_or(DVec3::Z);
                within(direction, TURN, child(seed, 1))
            }
        }
    }
}

/// A direction by chance, every one within `angle` (radians) of `axis` as likely as another.
pub(super) fn within(axis: DVec3, angle: f64, seed: u64) -> DVec3 {
    let share = unit(child(seed, 0));
    let turn = std::f64::consts::TAU * unit(child(seed, 1));
    on_cap(axis, angle, share, turn)
}

/// The direction that has the given share of a cap's area within it, turned about its axis.
fn on_cap(axis: DVec3, angle: f64, share: f64, turn: f64) -> DVec3 {
    let side = match axis.y.abs() > 0.9 {
        true => DVec3::Z,
        false => DVec3::Y,
    };
    let u = side.cross(axis).normalize();
    let v = axis.cross(u);
    let along = 1.0 - share * (1.0 - libm::cos(angle));
    let across = (1.0 - along * along).max(0.0).sqrt();
    (axis * along + u * (across * libm::cos(turn)) + v * (across * libm::sin(turn))).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPHERE: Sphere = Sphere {
        centre: DVec3::new(1.0, 2.0, 3.0),
        radius: 1.5,
    };

    fn pose(direction: DVec3, distance: f64) -> Pose {
        let direction = direction.normalize();
        Pose::new(
            DMat4::IDENTITY,
            SPHERE,
            direction,
            distance,
            60.0,
            [200, 100],
        )
    }

    fn project(pose: &Pose, point: DVec3) -> DVec3 {
        pose.view_projection().project_point3(point)
    }

    #[test]
    fn the_centre_is_in_the_middle_and_the_sphere_between_the_planes() {
        for direction in [
            DVec3::Z,
            DVec3::NEG_X,
            DVec3::Y,
            DVec3::NEG_Y,
            DVec3::new(1.0, 0.5, 1.0),
        ] {
            for distance in [1.0, 2.0, 40.0] {
                let pose = pose(direction, distance);
                let centre = project(&pose, SPHERE.centre);
                assert!(centre.truncate().length() < 1e-9, "{centre}");
                let back = project(&pose, SPHERE.centre - direction.normalize() * SPHERE.radius);
                assert!(back.z > 0.0 && back.z < 1.0, "{back}");
                if distance > SPHERE.radius {
                    let front = SPHERE.centre + direction.normalize() * SPHERE.radius;
                    let front = project(&pose, front);
                    assert!(front.z > 0.0 && front.z < back.z, "{front}");
                }
            }
        }
    }

    #[test]
    fn right_is_right_and_up_is_up() {
        let pose = pose(DVec3::Z, 10.0);
        let right = project(&pose, SPHERE.centre + DVec3::X);
        assert!(right.x > 0.0 && right.y.abs() < 1e-9);
        let up = project(&pose, SPHERE.centre + DVec3::Y);
        assert!(up.y > 0.0 && up.x.abs() < 1e-9);
        // Twice as wide as high: a step right is half as long in clip space.
        assert!((up.y - 2.0 * right.x).abs() < 1e-9);
        // Half the field of view is 30 degrees.
        let edge = project(
            &pose,
            SPHERE.centre + DVec3::Y * 10.0 * 30f64.to_radians().tan(),
        );
        assert!((edge.y - 1.0).abs() < 1e-9);
    }

    #[test]
    fn directions_are_spread_within_their_cap() {
        for (axis, angle) in [
            (DVec3::Z, 1.0),
            (DVec3::Y, 3.2f64.min(std::f64::consts::PI)),
        ] {
            let all = spread(7, axis, angle);
            assert_eq!(all.len(), 7);
            for (i, d) in all.iter().enumerate() {
                assert!((d.length() - 1.0).abs() < 1e-12);
                assert!(d.dot(axis) >= angle.cos() - 1e-12);
                for other in &all[..i] {
                    assert!(d.distance(*other) > 0.2);
                }
            }
        }
        assert_eq!(spread(1, DVec3::Z, 1.0), [DVec3::Z]);
        assert!(spread(0, DVec3::Z, 1.0).is_empty());
    }

    #[test]
    fn normals_stay_normal_to_a_stretched_surface() {
        let model = DMat4::from_scale(DVec3::new(1.0, 4.0, 1.0));
        let pose = Pose {
            model,
            ..pose(DVec3::Z, 5.0)
        };
        let normal = pose.normal_matrix() * DVec3::new(1.0, 1.0, 0.0);
        let along = model.transform_vector3(DVec3::new(1.0, -1.0, 0.0));
        assert!(normal.dot(along).abs() < 1e-12);
        let flat = Pose {
            model: DMat4::from_scale(DVec3::new(1.0, 0.0, 1.0)),
            ..pose
        };
        assert!(flat.normal_matrix().is_finite());
    }
}
