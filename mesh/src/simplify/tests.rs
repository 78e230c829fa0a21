//! That no bound is exceeded, by points all over both surfaces.

use super::*;
use crate::distance::Reference;
use crate::shapes::{Random, field, in_draws, sphere, torus};

#[test]
fn the_bound_holds_for_samples_of_both_surfaces() {
    let mut random = Random(20);
    let meshes = [
        ("a field", field(24, 0.05, &mut random)),
        ("a rough field", field(20, 0.5, &mut random)),
        ("a sphere", sphere(40, 24)),
        ("a torus", torus(40, 24)),
        (
            "draws",
            in_draws(&torus(36, 18), 3, |[x, y, _]| {
                if y > 0.0 { 0 } else { 1 + usize::from(x > 0.0) }
            }),
        ),
    ];
    for (name, mesh) in &meshes {
        let reference = Reference::new(mesh);
        let mut simplifier = Simplifier::new(mesh);
        for bound in [0.001, 0.004, 0.016, 0.06, 0.25] {
            simplifier.to_bound(bound * reference.to(mesh).diagonal, &mut |_| ());
            let result = simplifier.mesh();
            let distance = reference.to_by_samples(&result, 40_000);
            let largest = distance.largest().max(reference.to(&result).largest());
            println!(
                "{name} within {bound}: {} of {} triangles, {largest} of {}",
                result.indices.len() / 3,
                mesh.indices.len() / 3,
                simplifier.bound()
            );
            assert!(simplifier.bound() <= bound * distance.diagonal);
            assert!(
                largest <= simplifier.bound() + 1e-12,
                "{name}: {largest} is beyond {}",
                simplifier.bound()
            );
        }
    }
}

#[test]
fn a_mean_is_kept_and_nearly_used_up() {
    let mesh = torus(60, 36);
    let reference = Reference::new(&mesh);
    let mut simplifier = Simplifier::new(&mesh);
    let mut last = mesh.indices.len();
    for mean in [0.002, 0.01, 0.05] {
        simplifier.to_mean(mean, &reference, &mut |_| ());
        let result = simplifier.mesh();
        let reached = reference.to(&result).mean();
        assert!(
            reached <= mean && reached > 0.9 * mean,
            "{reached} of {mean}"
        );
        assert!(result.indices.len() < last);
        last = result.indices.len();
    }
}

#[test]
fn so_many_triangles_and_no_more() {
    let mesh = in_draws(&torus(40, 24), 2, |[x, ..]| usize::from(x > 0.0));
    let mut simplifier = Simplifier::new(&mesh);
    let mut told = Vec::new();
    for triangles in [1500, 700, 100] {
        simplifier.to_triangles(triangles, &mut |left| told.push(left));
        let left = simplifier.mesh().indices.len() / 3;
        assert!(
            left <= triangles && left + 2 > triangles,
            "{left} for {triangles}"
        );
        assert_eq!(told.last(), Some(&left));
        let distance = Reference::new(&mesh).to_by_samples(&simplifier.mesh(), 20_000);
        assert!(distance.largest() <= simplifier.bound());
    }
    assert!(told.is_sorted_by(|a, b| a >= b));
}

#[test]
fn what_is_flat_costs_nothing() {
    let mut random = Random(21);
    let mesh = field(16, 0.0, &mut random);
    let mut simplifier = Simplifier::new(&mesh);
    simplifier.to_bound(1e-4, &mut |_| ());
    assert_eq!(simplifier.mesh().indices.len() / 3, 2);
    assert!(simplifier.bound() < 1e-6, "{}", simplifier.bound());
}
