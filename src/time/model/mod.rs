//! The cost model: how long a draw takes, from what it executes. It orders variants; a device decides.
//!
//! ```text
//! Features --Model--> ms          calibrated for an adapter, or in arbitrary units
//! rows of (Features, ms) --fit--> Model
//! ```
//!
//! A draw has four parts, each a weighted sum of what it executes: arithmetic, texture reads, what a fragment costs
//! whatever its program, and what vertices and triangles cost. A part that takes longer hides the others, more or less:
//! the parts of the fragments are added up as a p-norm, and so are those together and the geometry's. A p of 1 is a sum
//! (a program on a CPU does one thing after the other), and a large one the longest alone. What a draw takes that does
//! nothing comes on top.

mod calibration;
mod features;
mod fit;
mod judge;

pub use calibration::{Calibration, Comparison, Measurement, Quality};
pub use features::{Extent, Features, Invocation};
pub use judge::{Judged, coefficient, he, judged, spearman};

use lodc_passes::cost::{FLAT_WEIGHT, INTERPOLATION_WEIGHT, SAMPLE_WEIGHT, SPECIAL_WEIGHT};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A part of a draw that other parts may hide.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part {
    Arithmetic,
    Texture,
    Fragment,
    Geometry,
    Overhead,
}

/// How many kinds of things a draw takes time for.
const TERMS: usize = 27;

/// Each kind: its name; its part; what the static cost model says that one is worth, and what one is thought to be worth
/// before anything was measured, both in scalar operations at full rate. The first are the classes of
/// [`crate::eval::mix::Class`], of each lane.
const TABLE: [(&str, Part, f64, f64); TERMS] = [
    ("float", Part::Arithmetic, 1.0, 1.0),
    ("word", Part::Arithmetic, 1.0, 1.0),
    ("division", Part::Arithmetic, SPECIAL_WEIGHT, 4.0),
    ("root", Part::Arithmetic, SPECIAL_WEIGHT, 4.0),
    ("exponential", Part::Arithmetic, SPECIAL_WEIGHT, 8.0),
    ("trigonometry", Part::Arithmetic, SPECIAL_WEIGHT, 8.0),
    ("derivative", Part::Arithmetic, 1.0, 1.0),
    ("uniform", Part::Arithmetic, 1.0, 0.3),
    ("branch", Part::Arithmetic, 0.0, 4.0),
    ("sample", Part::Texture, SAMPLE_WEIGHT, 20.0),
    ("texel", Part::Texture, 0.0, 10.0),
    ("level", Part::Texture, 0.0, 10.0),
    ("gradient", Part::Texture, 0.0, 10.0),
    ("cube", Part::Texture, 0.0, 20.0),
    // Of each lane, too.
    ("interpolated", Part::Fragment, INTERPOLATION_WEIGHT, 4.0),
    ("flat", Part::Fragment, FLAT_WEIGHT, 1.0),
    ("lane", Part::Fragment, 0.0, 20.0),
    ("fragment", Part::Fragment, 0.0, 10.0),
    ("target byte", Part::Fragment, 0.0, 2.0),
    ("drawn triangle", Part::Fragment, 0.0, 200.0),
    ("input of a triangle", Part::Fragment, 0.0, 10.0),
    ("vertex", Part::Geometry, 0.0, 50.0),
    ("vertex operation", Part::Geometry, 1.0, 1.0),
    ("vertex sample", Part::Geometry, SAMPLE_WEIGHT, 50.0),
    ("vertex byte", Part::Geometry, 0.0, 1.0),
    ("triangle", Part::Geometry, 0.0, 50.0),
    ("draw", Part::Overhead, 0.0, 1000.0),
];

/// How long a draw takes: weights of what it executes, and how its parts hide each other.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Model {
    /// The adapter that it was fitted on; `None` where it never was, and times are in scalar operations at full rate.
    pub adapter: Option<String>,
    /// The lodc that fitted it.
    pub version: String,
    /// For each kind of thing what one takes, in milliseconds of a draw. None is negative.
    weights: BTreeMap<String, f64>,
    /// By which p arithmetic, texture reads and what else fragments cost are added up, at least 1.
    fragment_p: f64,
    /// By which p that and the geometry are.
    geometry_p: f64,
    /// How much of a block of 4 x 4 pixels is shaded where some of it is covered, beyond its squares of 2 x 2: 0..1.
    stamp_share: f64,
}

/// The same as numbers in the order of the table.
#[derive(Clone, Copy, Debug)]
struct Parameters {
    weights: [f64; TERMS],
    fragment_p: f64,
    geometry_p: f64,
    stamp_share: f64,
}

impl Default for Model {
    fn default() -> Self {
        Self::estimated()
    }
}

impl Model {
    /// The model that nothing was measured for: the weights of the static cost model, [`lodc_passes::cost`], added up.
    pub fn estimated() -> Self {
        Self::of(
            &Parameters {
                weights: TABLE.map(|(_, _, estimated, _)| estimated),
                fragment_p: 1.0,
                geometry_p: 1.0,
                stamp_share: 0.0,
            },
            None,
        )
    }

    /// Whether it was fitted to times, so that it says milliseconds.
    pub fn is_calibrated(&self) -> bool {
        self.adapter.is_some()
    }

    /// How long a draw takes: milliseconds, or scalar operations at full rate where the model is not calibrated.
    pub fn time(&self, features: &Features) -> f64 {
        self.parameters().time(features)
    }

    /// How many times as long as the original a variant takes at the same distance. 1 where neither takes any time.
    pub fn ratio(&self, variant: &Features, original: &Features) -> f64 {
        let [variant, original] = [variant, original].map(|features| self.time(features));
        if original > 0.0 {
            variant / original
        } else {
            1.0
        }
    }

    /// What each kind of thing takes, by name, in the order of a table for people: of each lane first.
    pub fn weights(&self) -> impl Iterator<Item = (&'static str, f64)> {
        let known = |name: &str| self.weights.get(name).copied().unwrap_or(0.0);
        TABLE.iter().map(move |(name, ..)| (*name, known(name)))
    }

    /// By which p the parts of fragments, and those and the geometry, are added up, and the share of blocks of 4 x 4 pixels
    /// that is shaded beyond their covered squares.
    pub fn exponents(&self) -> [f64; 3] {
        [self.fragment_p, self.geometry_p, self.stamp_share]
    }

    fn of(parameters: &Parameters, adapter: Option<&str>) -> Self {
        let weights = TABLE.iter().zip(parameters.weights);
        Self {
            adapter: adapter.map(str::to_owned),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            weights: weights
                .map(|((name, ..), weight)| ((*name).to_owned(), figures(weight)))
                .collect(),
            fragment_p: figures(parameters.fragment_p),
            geometry_p: figures(parameters.geometry_p),
            stamp_share: figures(parameters.stamp_share),
        }
    }

    /// Its numbers, put right where a file has others.
    fn parameters(&self) -> Parameters {
        let mut weights = [0.0; TERMS];
        for (to, (_, weight)) in weights.iter_mut().zip(self.weights()) {
            *to = if weight.is_finite() {
                weight.max(0.0)
            } else {
                0.0
            };
        }
        Parameters {
            weights,
            fragment_p: self.fragment_p.max(1.0),
            geometry_p: self.geometry_p.max(1.0),
            stamp_share: self.stamp_share.clamp(0.0, 1.0),
        }
    }
}

impl Parameters {
    fn time(&self, features: &Features) -> f64 {
        let amounts = amounts(features, self.stamp_share);
        let mut parts = [0.0; 5];
        for ((amount, weight), (_, part, ..)) in amounts.iter().zip(&self.weights).zip(&TABLE) {
            parts[*part as usize] += amount * weight;
        }
        let [arithmetic, texture, fragment, geometry, overhead] = parts;
        let fragments = norm(&[arithmetic, texture, fragment], self.fragment_p);
        norm(&[fragments, geometry], self.geometry_p) + overhead
    }
}

/// How much of each kind of thing a draw takes time for.
fn amounts(features: &Features, stamp_share: f64) -> [f64; TERMS] {
    let Features { invocation, extent } = features;
    let lanes = extent.lanes + stamp_share * (extent.stamp_lanes - extent.lanes).max(0.0);
    let inputs = invocation.interpolated + invocation.flat;
    let vertices = extent.vertices;
    let further = [
        lanes * invocation.interpolated,
        lanes * invocation.flat,
        lanes,
        extent.fragments,
        extent.fragments * extent.target_bytes,
        extent.drawn_triangles,
        extent.drawn_triangles * inputs,
        vertices,
        vertices * invocation.vertex.operations(),
        vertices * invocation.vertex[crate::eval::mix::Class::Sample],
        vertices * extent.vertex_bytes,
        extent.triangles,
        1.0,
    ];
    let classes = crate::eval::mix::Class::ALL.map(|class| lanes * invocation.fragment[class]);
    let mut amounts = [0.0; TERMS];
    for (amount, known) in amounts.iter_mut().zip(classes.into_iter().chain(further)) {
        *amount = known;
    }
    amounts
}

/// A number to five figures: more would say nothing, make files long, and not always be read as it was written.
fn figures(number: f64) -> f64 {
    if number == 0.0 || !number.is_finite() {
        return 0.0;
    }
    format!("{number:.4e}").parse().unwrap_or(number)
}

/// The p-norm of numbers from 0.
fn norm(parts: &[f64], p: f64) -> f64 {
    if p == 1.0 {
        return parts.iter().sum();
    }
    let longest = parts.iter().copied().fold(0.0, f64::max);
    if longest <= 0.0 {
        return 0.0;
    }
    let sum: f64 = parts.iter().map(|part| (part / longest).powf(p)).sum();
    longest * sum.powf(1.0 / p)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eval::mix::{Class, Mix};

    fn features(float: f64, samples: f64, lanes: f64) -> Features {
        let mut fragment = Mix::default();
        fragment[Class::Float] = float;
        fragment[Class::Sample] = samples;
        Features {
            invocation: Invocation {
                fragment,
                ..Invocation::default()
            },
            extent: Extent {
                lanes,
                stamp_lanes: 2.0 * lanes,
                ..Extent::default()
            },
        }
    }

    #[test]
    fn the_table_begins_with_the_classes() {
        for (class, (name, ..)) in Class::ALL.into_iter().zip(TABLE) {
            assert_eq!(class.name(), name);
        }
        let names: std::collections::BTreeSet<_> = TABLE.iter().map(|(name, ..)| name).collect();
        assert_eq!(names.len(), TERMS);
    }

    #[test]
    fn nothing_measured_is_the_static_cost() {
        let model = Model::estimated();
        assert!(!model.is_calibrated());
        assert_eq!(model.time(&features(20.0, 2.0, 4.0)), 4.0 * 220.0);
        let [one, other] = [10.0, 20.0].map(|float| features(float, 0.0, 3.0));
        assert_eq!(model.ratio(&one, &other), 0.5);
        assert_eq!(model.ratio(&Features::default(), &Features::default()), 1.0);
    }

    #[test]
    fn parts_hide_each_other_by_p() {
        let mut model = Model::estimated();
        let both = features(300.0, 4.0, 1.0);
        assert_eq!(model.time(&both), 700.0);
        model.fragment_p = 2.0;
        assert!((model.time(&both) - 500.0).abs() < 1e-9);
        model.fragment_p = 1e3;
        assert!((model.time(&both) - 400.0).abs() < 1e-9);
        model.stamp_share = 0.5;
        assert!((model.time(&both) - 600.0).abs() < 1e-9);
    }

    #[test]
    fn a_model_is_read_as_it_was_written() {
        let model = Model::estimated();
        let json = serde_json::to_string(&model).unwrap();
        assert_eq!(serde_json::from_str::<Model>(&json).unwrap(), model);
        // What a file makes of it is never a negative time.
        let broken = json.replace("\"float\":1.0", "\"float\":-1.0");
        let broken: Model = serde_json::from_str(&broken).unwrap();
        assert_eq!(broken.time(&features(20.0, 0.0, 4.0)), 0.0);
    }
}
