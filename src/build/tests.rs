//! The arithmetic that modules bring along, held against that of the compiler.

use super::host::{self, Camera, Object};
use lodc_passes::autolod::{self, View};

const THRESHOLDS: [f32; 4] = [0.5, 1.69, 2.99, 4.16];

/// Numbers that look random, in 0..1.
fn chance(state: &mut u64) -> f64 {
    *state = state
        .wrapping_mul(6_364_136_223_846_793_005)
        .wrapping_add(1_442_695_040_888_963_407);
    (*state >> 11) as f64 / (1_u64 << 53) as f64
}

#[test]
fn rho_and_auto_lod_are_the_compilers() {
    let mut state = 1;
    for _ in 0..2000 {
        let mut next = |from: f64, to: f64| (from + (to - from) * chance(&mut state)) as f32;
        let mut model = [[0.0; 4]; 4];
        for column in &mut model {
            for x in &mut column[..3] {
                *x = next(-2.0, 2.0);
            }
        }
        model[3][3] = 1.0;
        let camera = Camera {
            eye: [0.0; 3].map(|_| next(-30.0, 30.0)),
            fov: next(5.0, 170.0),
            height: next(16.0, 4000.0),
            z_near: 0.1,
        };
        let object = Object {
            model,
            centre: [0.0; 3].map(|_| next(-1.0, 1.0)),
            radius: next(0.1, 3.0),
        };
        let centre: Vec<f64> = (0..3)
            .map(|axis| {
                let turned =
                    (0..3).map(|k| f64::from(model[k][axis]) * f64::from(object.centre[k]));
                f64::from(model[3][axis]) + turned.sum::<f64>()
            })
            .collect();
        let away = (0..3).map(|axis| (centre[axis] - f64::from(camera.eye[axis])).powi(2));
        let s_max = host::s_max(&model);
        let view = View {
            s_max,
            distance: away.sum::<f64>().sqrt(),
            radius: s_max * f64::from(object.radius),
            z_near: f64::from(camera.z_near),
            height: f64::from(camera.height),
            fov: f64::from(camera.fov),
        };
        let (found, wanted) = (host::rho(&camera, &object), autolod::rho(&view));
        assert!(
            (found - wanted).abs() <= 1e-9 * wanted,
            "{found} {wanted} {camera:?}"
        );
        let (found, wanted) = (
            host::auto_lod(308.0, found),
            autolod::auto_lod(308.0, wanted),
        );
        assert!((found - wanted).abs() < 1e-9, "{found} {wanted}");
    }
}

#[test]
fn the_largest_stretch_is_the_compilers() {
    let mut state = 2;
    for _ in 0..500 {
        let model = [[0.0; 4]; 4]
            .map(|column| column.map(|_: f32| (4.0 * chance(&mut state) - 2.0) as f32));
        let wanted = autolod::s_max(&model);
        let found = host::s_max(&model);
        assert!((found - wanted).abs() <= 1e-12 * wanted, "{found} {wanted}");
    }
    assert_eq!(host::s_max(&[[0.0; 4]; 4]), 0.0);
}

#[test]
fn levels_are_the_compilers() {
    let thresholds = THRESHOLDS.map(f64::from);
    for step in 0..600 {
        let at = f64::from(step) * 0.01;
        for current in [None, Some(0), Some(1), Some(3), Some(4), Some(9)] {
            assert_eq!(
                host::level(&THRESHOLDS, at, current),
                autolod::level(&thresholds, at, current, autolod::HYSTERESIS)
            );
        }
    }
    for level in 0..7 {
        let wanted = autolod::middle(&thresholds, level) as f32;
        assert!((host::middle(&THRESHOLDS, level) - wanted).abs() < 1e-6);
    }
    assert_eq!(host::HYSTERESIS, autolod::HYSTERESIS);
    assert_eq!(host::level(&THRESHOLDS, f64::NAN, None), 0);
}

#[test]
fn a_broken_view_gets_the_original() {
    for (rho0, rho) in [
        (f64::NAN, 1.0),
        (1.0, f64::NAN),
        (0.0, 1.0),
        (1.0, 0.0),
        (f64::INFINITY, 1.0),
    ] {
        assert_eq!(host::auto_lod(rho0, rho), 0.0);
    }
}
