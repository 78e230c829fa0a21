//! What was measured of values and textures outside the passes: means, ranges, errors.
//!
//! Facts are data. Passes read them when they list candidates and bake what they use into the
//! candidate, so that a recipe replays without them.

use crate::basis::{Basis, Lobe};
use crate::recipe::Declined;
use crate::shader::ValueId;
use std::collections::{BTreeMap, BTreeSet};

/// What the samples of a scene showed, at one distance.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Facts {
    /// For each float value that was seen, by its id.
    pub values: BTreeMap<ValueId, ValueFacts>,
    /// For each texture, by the name of its global variable; a texture that is not here is dynamic.
    pub textures: BTreeMap<String, TextureFacts>,
    /// The uniforms that may take any value, by their paths, such as `lights.items[2].colour`.
    pub dynamic: BTreeSet<String>,
    /// What the scene states of numbers, vectors and matrices in buffers, by their paths: the bits of each component, a matrix
    /// column by column.
    pub fixed: BTreeMap<String, Vec<u32>>,
    /// The samplers that repeat along both axes in every draw, by the names of their global variables.
    pub repeating: BTreeSet<String>,
    /// How many pixels the mesh's texture coordinates go over while they go from 0 to 1, at the facts' distance; `None` where
    /// there are none.
    pub pixels_per_coordinate: Option<f32>,
    /// For values and operands of theirs, how the one goes with the other: for each of the value's components.
    pub pairs: BTreeMap<(ValueId, ValueId), Vec<Moments>>,
}

/// What was seen of one value, component by component, over active lanes of covered pixels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ValueFacts {
    /// How many samples the figures stand for.
    pub count: u64,
    /// The mean of each component, weighed by how much each sample is seen.
    pub mean: Vec<f32>,
    /// What the samples of each component weigh together; empty where each weighs 1.
    pub weight: Vec<f64>,
    /// The smallest value of each component; NaN when a NaN was seen.
    pub min: Vec<f32>,
    /// The largest value of each component; NaN when a NaN was seen.
    pub max: Vec<f32>,
}

impl Facts {
    /// The mean of values that have `count` components each, taken as one: each weighs as much as it
    /// was seen. Those that were not seen are left out.
    ///
    /// # Errors
    /// When none was seen, or one only with infinite or undefined numbers.
    pub fn mean<'a>(
        &self,
        ids: impl IntoIterator<Item = &'a ValueId>,
        count: usize,
    ) -> Result<Vec<f32>, Declined> {
        let seen: Vec<&ValueFacts> = ids
            .into_iter()
            .filter_map(|id| self.values.get(id))
            .filter(|facts| facts.count > 0 && facts.mean.len() == count)
            .collect();
        let mean: Vec<f32> = match seen[..] {
            [] => return Err(Declined("no sample of the scene computes it".into())),
            [only] => only.mean.clone(),
            _ => (0..count)
                .map(|i| {
                    let whole: f64 = seen.iter().map(|facts| facts.weight(i)).sum();
                    let weighed = seen.iter().filter(|facts| facts.weight(i) > 0.0);
                    let part =
                        |facts: &&ValueFacts| f64::from(facts.mean[i]) * (facts.weight(i) / whole);
                    weighed.map(part).sum::<f64>() as f32
                })
                .collect(),
        };
        if mean.iter().all(|number| number.is_finite()) {
            Ok(mean)
        } else {
            Err(Declined("its mean over the samples is not finite".into()))
        }
    }
}

impl ValueFacts {
    /// What its samples weigh together in the mean of a component.
    fn weight(&self, component: usize) -> f64 {
        let weight = self.weight.get(component).copied();
        weight.unwrap_or(self.count as f64)
    }
}

/// Means and central second moments of two numbers that are seen together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments {
    /// How often they were seen, weighed by how much.
    pub weight: f64,
    /// The mean of each.
    pub mean: [f64; 2],
    /// The sum of the squared differences of each from its mean.
    pub squares: [f64; 2],
    /// The sum of the products of these differences.
    pub product: f64,
}

impl Moments {
    /// Takes in another pair, with a weight (Welford, "Note on a method for calculating corrected sums of squares and
    /// products", 1962, and with weights West, "Updating mean and variance estimates", 1979).
    pub fn add(&mut self, pair: [f64; 2], weight: f64) {
        if weight <= 0.0 {
            return;
        }
        self.weight += weight;
        let part = weight / self.weight;
        let before = [0, 1].map(|i| pair[i] - self.mean[i]);
        for i in 0..2 {
            self.mean[i] += before[i] * part;
            self.squares[i] += weight * before[i] * (pair[i] - self.mean[i]);
        }
        self.product += weight * before[0] * (pair[1] - self.mean[1]);
    }

    /// Adds what was seen elsewhere (Chan, Golub, LeVeque, "Updating formulae and a pairwise algorithm for computing
    /// sample variances", 1979).
    pub fn merge(&mut self, other: &Self) {
        if other.weight == 0.0 {
            return;
        }
        let whole = self.weight + other.weight;
        let part = other.weight / whole;
        let apart = [0, 1].map(|i| other.mean[i] - self.mean[i]);
        let weight = self.weight * part;
        for (i, apart) in apart.into_iter().enumerate() {
            self.mean[i] += apart * part;
            self.squares[i] += other.squares[i] + apart * apart * weight;
        }
        self.product += other.product + apart[0] * apart[1] * weight;
        self.weight = whole;
    }

    /// The scale and the offset with which the second number comes closest to the first one, in least squares;
    /// `None` when the second does not vary.
    pub fn line(&self) -> Option<[f64; 2]> {
        let scale = self.product / self.squares[1];
        let offset = self.mean[0] - scale * self.mean[1];
        (self.squares[1] > 0.0 && scale.is_finite() && offset.is_finite())
            .then_some([scale, offset])
    }

    /// The mean squared error of the first number when a line through the second stands for it.
    pub fn error_of(&self, [scale, offset]: [f64; 2]) -> f64 {
        let shift = self.mean[0] - scale * self.mean[1] - offset;
        let spread = self.squares[0] - 2.0 * scale * self.product + scale * scale * self.squares[1];
        let weight = if self.weight > 0.0 { self.weight } else { 1.0 };
        spread.max(0.0) / weight + shift * shift
    }
}

impl TextureFacts {
    /// The whole-texture mean at the facts' MIP level, between two levels a mix of theirs.
    ///
    /// # Errors
    /// When no level is known, or a mean is not finite.
    pub fn mean_at_level(&self) -> Result<[f32; 4], Declined> {
        at_level(&self.mean, self.level)
            .filter(|mean| mean.iter().all(|number| number.is_finite()))
            .ok_or_else(|| Declined("the mean of its texture is not known".into()))
    }

    /// The least-squares error of [`mean_at_level`](Self::mean_at_level), a standard deviation for
    /// each channel (Olano, section 2.1); `None` when no level is known.
    pub fn deviation_at_level(&self) -> Option<[f32; 4]> {
        at_level(&self.deviation, self.level)
    }

    /// The variance of the slopes that a reference shows of a map of normals, along both axes together; `None` for other
    /// textures. The reference is made of 4 x 4 samples a pixel and so reads two levels below the facts' one. But
    /// surfaces are seen aslant, over a sphere by 0.7 levels in the mean, and samples between texels vary less than
    /// these, as if they were 0.6 levels higher up.
    pub fn slope_variance(&self) -> Option<f32> {
        let [across, along] = at_level(&self.slopes, self.level - FINER)?;
        Some(across + along).filter(|sum| sum.is_finite())
    }

    /// Whether every texel of every level is the same, so that the mean is exact.
    pub fn is_flat(&self) -> bool {
        !self.mean.is_empty()
            && self.mean.iter().all(|mean| *mean == self.mean[0])
            && self.deviation.len() == self.mean.len()
            && self
                .deviation
                .iter()
                .all(|deviation| *deviation == [0.0; 4])
    }
}

/// By how many MIP levels the slopes that a reference shows are finer than the texels that a picture reads.
const FINER: f32 = 1.0;

/// What a list with one entry a MIP level holds at a level between two.
fn at_level<const N: usize>(levels: &[[f32; N]], level: f32) -> Option<[f32; N]> {
    let last = levels.len().checked_sub(1)?;
    // A level that is not a number is the finest.
    let level = level.max(0.0).min(last as f32);
    let (low, high) = (level.floor() as usize, level.ceil() as usize);
    let part = level - low as f32;
    let mut mixed = levels[low];
    for (channel, number) in mixed.iter_mut().enumerate() {
        if part > 0.0 {
            *number += (levels[high][channel] - *number) * part;
        }
    }
    Some(mixed)
}

/// A sum of functions of a texture's coordinates that is as near to the texture as such a sum can be.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// The functions.
    pub basis: Basis,
    /// What each of them is multiplied with, for each channel.
    pub numbers: Vec<[f32; 4]>,
    /// Where its lights are.
    pub lobes: Vec<Lobe>,
    /// The part of the texture's variance that it leaves, 0..=1.
    pub left: f64,
}

/// What is known of the image behind a texture. Colours are linear, as a sample returns them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TextureFacts {
    /// Width and height of its finest level in texels.
    pub size: [u32; 2],
    /// How many layers it has, 1 where it is no array.
    pub layers: u32,
    /// The mean over the whole texture at each MIP level, finest first; where its alpha is what is seen of the
    /// others, those are weighed by it.
    pub mean: Vec<[f32; 4]>,
    /// The least-squares error of that mean at each MIP level: the standard deviation of its texels
    /// (Olano, section 2.1).
    pub deviation: Vec<[f32; 4]>,
    /// For a map of normals in tangent space, the variance of their slopes along each axis at each MIP level; empty for
    /// any other texture.
    pub slopes: Vec<[f32; 2]>,
    /// Sums of functions of its coordinates that are near it, simplest first; empty where nobody looked for them.
    pub fits: Vec<Fit>,
    /// The MIP level that a sample at the facts' distance falls on, when it is known.
    pub level: f32,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_needs_samples_and_finite_numbers() {
        let id = ValueId::from("fs_main.x");
        let mut facts = Facts::default();
        assert!(facts.mean([&id], 1).is_err());
        let seen = ValueFacts {
            count: 4,
            mean: vec![0.25],
            weight: Vec::new(),
            min: vec![0.0],
            max: vec![1.0],
        };
        facts.values.insert(id.clone(), seen.clone());
        assert_eq!(facts.mean([&id], 1), Ok(vec![0.25]));
        assert!(facts.mean([&id], 2).is_err(), "another count of components");
        let endless = ValueFacts {
            mean: vec![f32::INFINITY],
            ..seen.clone()
        };
        facts.values.insert(id.clone(), endless);
        assert!(facts.mean([&id], 1).is_err());
        facts
            .values
            .insert(id.clone(), ValueFacts { count: 0, ..seen });
        assert!(facts.mean([&id], 1).is_err(), "never computed");
    }

    #[test]
    fn a_mean_over_several_weighs_them_by_their_samples() {
        let ids: Vec<ValueId> = ["fs_main.x", "fs_main.y", "fs_main.z"]
            .map(ValueId::from)
            .into();
        let mut facts = Facts::default();
        for (id, (count, mean)) in ids.iter().zip([(1, 1.0), (3, 0.0), (0, 9.0)]) {
            let seen = ValueFacts {
                count,
                mean: vec![mean],
                ..ValueFacts::default()
            };
            facts.values.insert(id.clone(), seen);
        }
        assert_eq!(facts.mean(&ids, 1), Ok(vec![0.25]));
        assert!(facts.mean(&ids[2..], 1).is_err());
        // By what they weigh, where samples do not weigh the same: 3 parts of the first and 1 of the second. What
        // weighs nothing has no mean.
        for (id, weight) in ids.iter().zip([1.5, 0.5, 0.0]) {
            let seen = facts.values.entry(id.clone()).or_default();
            seen.count = 4;
            seen.weight = vec![weight];
        }
        facts.values.entry(ids[2].clone()).or_default().mean = vec![f32::NAN];
        assert_eq!(facts.mean(&ids, 1), Ok(vec![0.75]));
        assert!(facts.mean(&ids[2..], 1).is_err());
    }

    #[test]
    fn a_level_between_two_mixes_them_and_one_outside_is_the_nearest() {
        let mut texture = TextureFacts {
            mean: vec![[0.0; 4], [1.0; 4]],
            deviation: vec![[0.5; 4], [0.0; 4]],
            level: 0.25,
            ..TextureFacts::default()
        };
        assert_eq!(texture.mean_at_level(), Ok([0.25; 4]));
        assert_eq!(texture.deviation_at_level(), Some([0.375; 4]));
        for (level, mean) in [(-3.0, 0.0), (9.0, 1.0), (f32::NAN, 0.0)] {
            texture.level = level;
            assert_eq!(texture.mean_at_level(), Ok([mean; 4]), "level {level}");
        }
        assert!(TextureFacts::default().mean_at_level().is_err());
    }

    #[test]
    fn moments_weigh_pairs() {
        // A pair that weighs 3 is as good as three of them, and one that weighs nothing does not count.
        let (mut weighed, mut told) = (Moments::default(), Moments::default());
        weighed.add([1.0, 2.0], 3.0);
        weighed.add([f64::INFINITY, 9.0], 0.0);
        weighed.add([5.0, 4.0], 1.0);
        for pair in [[1.0, 2.0], [1.0, 2.0], [5.0, 4.0], [1.0, 2.0]] {
            told.add(pair, 1.0);
        }
        for i in 0..2 {
            assert!((weighed.mean[i] - told.mean[i]).abs() < 1e-12);
            assert!((weighed.squares[i] - told.squares[i]).abs() < 1e-12);
        }
        assert_eq!(
            (weighed.weight, weighed.product),
            (told.weight, told.product)
        );
        // Means 2 and 2.5; 3 * 1 * 0.5 + 3 * 1.5 and so on.
        assert_eq!((weighed.mean, weighed.product), ([2.0, 2.5], 6.0));
        assert_eq!(weighed.squares, [12.0, 3.0]);
    }

    #[test]
    fn a_reference_shows_the_slopes_of_a_level_further_down() {
        let mut texture = TextureFacts {
            slopes: vec![[0.5, 0.25], [0.25, 0.125], [0.0; 2]],
            ..TextureFacts::default()
        };
        for (level, variance) in [
            (0.0, 0.75),
            (1.0, 0.75),
            (1.5, 0.5625),
            (2.0, 0.375),
            (9.0, 0.0),
        ] {
            texture.level = level;
            assert_eq!(texture.slope_variance(), Some(variance), "level {level}");
        }
        assert_eq!(TextureFacts::default().slope_variance(), None);
    }

    #[test]
    fn moments_give_the_line_and_merge() {
        let pairs = [
            [1.0, 1e6],
            [3.0, 1e6 + 1.0],
            [4.0, 1e6 + 2.0],
            [8.0, 1e6 + 4.0],
        ];
        let mut whole = Moments::default();
        let mut halves = [Moments::default(); 2];
        for (i, pair) in pairs.into_iter().enumerate() {
            whole.add(pair, 1.0);
            halves[i / 2].add(pair, 1.0);
        }
        let [mut merged, other] = halves;
        merged.merge(&other);
        merged.merge(&Moments::default());
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-6 * a.abs().max(1.0), "{a} {b}");
        assert_eq!(merged.weight, 4.0);
        close(merged.product, whole.product);
        close(merged.squares[0], whole.squares[0]);
        close(merged.squares[1], whole.squares[1]);
        // By hand: means 4 and 1.75 (+ 1e6), products 15, squares 26 and 8.75.
        let [scale, offset] = whole.line().expect("the second varies");
        close(scale, 15.0 / 8.75);
        close(offset + scale * 1e6, 4.0 - 1.75 * 15.0 / 8.75);
        close(
            whole.error_of([scale, offset]),
            (26.0 - 15.0 * 15.0 / 8.75) / 4.0,
        );
        close(whole.error_of([0.0, 4.0]), 26.0 / 4.0);
        close(whole.error_of([0.0, 5.0]), 26.0 / 4.0 + 1.0);
        let mut still = Moments::default();
        still.add([1.0, 2.0], 1.0);
        still.add([2.0, 2.0], 1.0);
        assert_eq!(still.line(), None);
    }

    #[test]
    fn only_a_texture_of_one_colour_is_flat() {
        let mut texture = TextureFacts {
            mean: vec![[0.5; 4]; 2],
            deviation: vec![[0.0; 4]; 2],
            ..TextureFacts::default()
        };
        assert!(texture.is_flat());
        texture.deviation[0][3] = 0.01;
        assert!(!texture.is_flat());
        assert!(!TextureFacts::default().is_flat());
    }
}
