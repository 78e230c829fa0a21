//! What times shaders for a search: a device, or recordings of some.
//!
//! ```text
//! [Shader] x distance --Clock--> [one Timing for each adapter]
//! [Mesh x Shader] x distance --Clock--> the same
//! ```

use super::Timing;
use super::model::Model;
use crate::stability::Device;
use lodc_mesh::Mesh;
use lodc_passes::Shader;
use std::sync::Arc;

/// Times variants of one shader in one scene. A search asks it, and knows nothing of devices.
pub trait Clock {
    /// The adapters that it knows times of, in the order of what [`Clock::time`] gives.
    fn adapters(&self) -> &[String];

    /// What predicts times before there are any: the model of the adapter, where it was calibrated.
    fn model(&self) -> Model {
        Model::estimated()
    }

    /// Times variants against the original at a distance from the eye to the object's centre, in world units. For each one
    /// timing for each adapter; none at all where it could not be timed on one of them.
    fn time(&mut self, variants: &[&Shader], distance: f64) -> Vec<Vec<Timing>>;

    /// The same of shaders on meshes of their own, against the original on the scene's own mesh.
    fn time_on(&mut self, pairs: &[(&Arc<Mesh>, &Shader)], distance: f64) -> Vec<Vec<Timing>>;

    /// The device that it times on, to be asked about single inputs; nothing where there is none.
    fn device(&mut self) -> Option<&mut dyn Device> {
        None
    }
}

/// A variant's timing on the adapter where it does worst: the largest ratio. `None` where it was not timed.
pub fn worst(timings: &[Timing]) -> Option<&Timing> {
    let timings = timings.iter();
    timings.max_by(|a, b| a.ratio.total_cmp(&b.ratio))
}

/// The share of the original's time that a variant takes there.
pub fn worst_ratio(timings: &[Timing]) -> Option<f64> {
    worst(timings).map(|timing| timing.ratio)
}

/// Whether one variant is faster than another, beyond the noise, on every adapter.
pub fn is_faster(one: &[Timing], other: &[Timing]) -> bool {
    !one.is_empty()
        && one.len() == other.len()
        && one.iter().zip(other).all(|(one, other)| {
            let floor = one.floor.max(other.floor);
            one.high * (1.0 + floor) < other.low
        })
}

/// For each of several variants how much slower it is than the fastest of them, where it is slowest: its worst regret over the
/// adapters, 1 for what is fastest on all. Infinite for what was not timed.
pub fn worst_regrets(variants: &[&[Timing]]) -> Vec<f64> {
    let adapters = variants.iter().map(|of| of.len()).max().unwrap_or(0);
    let timed = |of: &&[Timing]| of.len() == adapters && adapters > 0;
    let fastest: Vec<f64> = (0..adapters)
        .map(|at| {
            let ratios = variants
                .iter()
                .copied()
                .filter(|of| timed(of))
                .map(|of| of[at].ratio);
            ratios.fold(f64::INFINITY, f64::min)
        })
        .collect();
    let regret = |of: &&[Timing]| match timed(of) {
        true => of
            .iter()
            .zip(&fastest)
            .map(|(timing, fastest)| timing.ratio / fastest)
            .fold(0.0, f64::max),
        false => f64::INFINITY,
    };
    variants.iter().map(regret).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faster_is_faster_on_every_adapter_and_beyond_the_noise() {
        let (a, b) = (
            Timing::made_up(0.5, 0.01, 0.01),
            Timing::made_up(0.6, 0.01, 0.01),
        );
        let one = std::slice::from_ref;
        assert!(is_faster(one(&a), one(&b)));
        assert!(!is_faster(one(&b), one(&a)));
        assert!(!is_faster(one(&a), one(&a)));
        assert!(!is_faster(
            one(&Timing::made_up(0.5, 0.06, 0.0)),
            one(&Timing::made_up(0.6, 0.06, 0.0))
        ));
        assert!(!is_faster(one(&Timing::made_up(0.5, 0.01, 0.2)), one(&b)));
        assert!(!is_faster(&[a.clone(), b.clone()], &[b.clone(), b.clone()]));
        assert!(!is_faster(&[], &[]));
        assert!(!is_faster(one(&a), &[]));
    }

    #[test]
    fn the_least_regret_is_that_of_what_is_good_everywhere() {
        let of = |ratios: [f64; 2]| ratios.map(|ratio| Timing::made_up(ratio, 0.0, 0.0));
        // Each of the first two is best on one adapter, and bad on the other.
        let all = [of([0.2, 0.8]), of([0.8, 0.2]), of([0.3, 0.3])];
        let mut variants: Vec<&[Timing]> = all.iter().map(|of| &of[..]).collect();
        variants.push(&[]);
        let regrets = worst_regrets(&variants);
        assert!((regrets[0] - 4.0).abs() < 1e-9 && (regrets[1] - 4.0).abs() < 1e-9);
        assert!((regrets[2] - 1.5).abs() < 1e-9);
        assert_eq!(regrets[3], f64::INFINITY);
        assert_eq!(worst_regrets(&[&[], &[]]), [f64::INFINITY; 2]);
        assert_eq!(worst_ratio(&all[0]), Some(0.8));
    }
}
