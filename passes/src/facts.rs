//! What was measured of values and textures outside the passes: means, ranges, errors.
//!
//! Facts are data. Passes read them when they list candidates and bake what they use into the
//! candidate, so that a recipe replays without them.

use crate::recipe::Declined;
use crate::shader::ValueId;
use std::collections::BTreeMap;

/// What the samples of a scene showed, at one distance.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Facts {
    /// For each float value that was seen, by its id.
    pub values: BTreeMap<ValueId, ValueFacts>,
    /// For each texture, by the name of its global variable; a texture that is not here is dynamic.
    pub textures: BTreeMap<String, TextureFacts>,
}

/// What was seen of one value, component by component, over active lanes of covered pixels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ValueFacts {
    /// How many samples the figures stand for.
    pub count: u64,
    /// The mean of each component.
    pub mean: Vec<f32>,
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
        let samples: f64 = seen.iter().map(|facts| facts.count as f64).sum();
        let mean: Vec<f32> = match seen[..] {
            [] => return Err(Declined("no sample of the scene computes it".into())),
            [only] => only.mean.clone(),
            _ => (0..count)
                .map(|i| {
                    let weighted = |facts: &&ValueFacts| {
                        f64::from(facts.mean[i]) * (facts.count as f64 / samples)
                    };
                    seen.iter().map(weighted).sum::<f64>() as f32
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

/// What a list with one entry a MIP level holds at a level between two.
fn at_level(levels: &[[f32; 4]], level: f32) -> Option<[f32; 4]> {
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

/// What is known of the image behind a texture. Colours are linear, as a sample returns them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TextureFacts {
    /// The mean over the whole texture at each MIP level, finest first, not alpha-weighted.
    pub mean: Vec<[f32; 4]>,
    /// The least-squares error of that mean at each MIP level: the standard deviation of its texels
    /// (Olano, section 2.1).
    pub deviation: Vec<[f32; 4]>,
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
    }

    #[test]
    fn a_level_between_two_mixes_them_and_one_outside_is_the_nearest() {
        let mut texture = TextureFacts {
            mean: vec![[0.0; 4], [1.0; 4]],
            deviation: vec![[0.5; 4], [0.0; 4]],
            level: 0.25,
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
    fn only_a_texture_of_one_colour_is_flat() {
        let mut texture = TextureFacts {
            mean: vec![[0.5; 4]; 2],
            deviation: vec![[0.0; 4]; 2],
            level: 0.0,
        };
        assert!(texture.is_flat());
        texture.deviation[0][3] = 0.01;
        assert!(!texture.is_flat());
        assert!(!TextureFacts::default().is_flat());
    }
}
