//! What was measured of values and textures outside the passes: means, ranges, errors.
//!
//! Facts are data. Passes read them when they list candidates and bake what they use into the
//! candidate, so that a recipe replays without them.

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
