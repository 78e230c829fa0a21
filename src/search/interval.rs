//! The samples at several distances of the interval in which a level is used.

use super::samples::{Measured, SampleSet, Samples};
use crate::eval::program::Refused;
use crate::eval::programs::{Programs, Stand};
use lodc_passes::Shader;

/// Sample sets from the start of an interval to its end, nearest first.
pub(crate) struct Interval<'a>(Vec<SampleSet<'a>>);

impl<'a> Interval<'a> {
    /// The samples of a scene at these distances, of which there is at least one.
    pub(crate) fn new(
        stand: &'a Stand<'a>,
        distances: &[f64],
        samples: Samples,
    ) -> Result<Self, Refused> {
        let set = |distance: &f64| SampleSet::new(stand, *distance, samples);
        Ok(Self(distances.iter().map(set).collect::<Result<_, _>>()?))
    }

    /// The samples where the level begins.
    pub(crate) fn start(&self) -> &SampleSet<'a> {
        &self.0[0]
    }

    /// The samples at each of its distances.
    pub(crate) fn sets(&self) -> &[SampleSet<'a>] {
        &self.0
    }

    /// Measures a variant at every distance: error and cost are those at the start, the strain is the largest, the
    /// load the mean, and what was moved to the vertices too, since it weighs more the fewer fragments there are.
    pub(crate) fn measure(&self, shader: &Shader) -> Result<Measured, Refused> {
        let programs = Programs::of(shader)?;
        let mut all = self.0.iter().map(|set| set.measure_programs(&programs));
        // There is at least one.
        let mut measured = all.next().unwrap_or_default();
        for other in all {
            measured.strain = measured.strain.max(other.strain);
            measured.load += other.load;
            measured.used.work.moved += other.used.work.moved;
        }
        measured.used.work.moved /= self.0.len() as f64;
        measured.cost = self.start().cost(&measured.used);
        measured.load /= self.0.len() as f64;
        Ok(measured)
    }
}
