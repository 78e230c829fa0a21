//! Runs a [`Program`] over blocks of lanes, with execution masks and helper lanes.

use super::lane::{Mask, Words};
use super::program::Program;
use super::texture::{Sampler, Texture};
use lodc_passes::Work;
use std::collections::BTreeMap;
use std::sync::Arc;

/// What is bound at a group and binding.
#[derive(Clone, Debug)]
pub enum Resource {
    /// A uniform or read-only storage buffer, in the layout of its type.
    Buffer(Arc<Vec<u8>>),
    /// A texture.
    Texture(Arc<Texture>),
    /// A sampler.
    Sampler(Arc<Sampler>),
}

/// The resources of a draw, by group and binding.
pub type Bindings = BTreeMap<(u32, u32), Resource>;

/// What a run of a program showed besides its results.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Profile {
    /// Covered lanes that were run, helper lanes apart.
    pub lanes: u64,
    /// Work that those lanes executed, in total (divide by `lanes` for the mean).
    pub work: Work,
    /// For each probe of the program and each of its components: what covered active lanes held.
    pub probes: Vec<Vec<Probe>>,
}

/// What covered active lanes held of one component of one value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Probe {
    /// How many lanes.
    pub count: u64,
    /// Their sum, accumulated in f64 in lane order.
    pub sum: f64,
    /// The smallest; NaN when one was NaN.
    pub min: f32,
    /// The largest; NaN when one was NaN.
    pub max: f32,
}

/// A program made ready to run over the resources of one draw: buffers read, uniform values computed.
#[derive(Debug)]
pub struct Machine<'a> {
    program: &'a Program,
}

impl<'a> Machine<'a> {
    /// Makes a machine for a program and its resources. One machine serves one thread.
    ///
    /// # Panics
    /// When a resource that the program uses is not bound, or is of another kind: the scene sees to that.
    pub fn new(program: &'a Program, bindings: &'a Bindings) -> Self {
        let _ = bindings;
        Self { program }
    }

    /// Runs one block. `inputs` has one entry per slot of [`Program::inputs`], `outputs` one per slot
    /// of [`Program::outputs`]. `active` lanes run; of those, `covered` ones count in the profile (the others
    /// are helper lanes). Returns the lanes that were not discarded.
    pub fn run(
        &mut self,
        inputs: &[Words],
        active: Mask,
        covered: Mask,
        outputs: &mut [Words],
    ) -> Mask {
        let _ = (self.program, inputs, covered, outputs);
        active
    }

    /// What has been run so far.
    pub fn profile(&self) -> Profile {
        Profile::default()
    }
}
