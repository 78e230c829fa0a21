//! What a device makes of inputs near trouble: they are handed over as data, and a variant that gives what is no number there
//! fails, where the original gives one on the device and in the evaluator.
//!
//! Drivers have roundings and a `pow` of their own, fuse operations and flush denormals. What WGSL allows of that the eight rough
//! arithmetics cover; this is what an adapter does.

#[cfg(feature = "gpu")]
use super::fed::Fed;
use super::inputs::Group;
#[cfg(feature = "gpu")]
use super::inputs::Interface;
use super::run::Failure;
#[cfg(feature = "gpu")]
use super::run::Given;
use super::{Battery, Blamed, Inputs, Reach};
#[cfg(feature = "gpu")]
use crate::eval::program::Program;
#[cfg(feature = "gpu")]
use crate::eval::raster::on_spots;
#[cfg(feature = "gpu")]
use crate::scene::Scene;
use lodc_passes::{Recipe, Shader};
use serde::{Deserialize, Serialize};
#[cfg(feature = "gpu")]
use std::borrow::Cow;

/// Inputs that another renderer is asked about, in groups that share their uniforms.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Asked(pub(super) Vec<Group>);

impl Asked {
    /// How many fragments there are.
    pub fn count(&self) -> usize {
        4 * self.quads().count()
    }

    /// The group and the place in it of each quad.
    fn quads(&self) -> impl Iterator<Item = (&Group, usize)> {
        let groups = self.0.iter();
        groups.flat_map(|group| (0..group.quads.len()).map(move |quad| (group, quad)))
    }

    /// The inputs of a fragment stage, whose vertices are computed so, one frame for each group.
    #[cfg(feature = "gpu")]
    pub(crate) fn fed(&self, scene: &Scene, vertex: &Program, fragment: &Program) -> Vec<Fed> {
        let interface = Interface::new(scene, scene.seed);
        let of_group = |group: &Group| {
            let frame = interface.frame(group);
            let spots = Interface::spots(group);
            let given = Given {
                blocks: on_spots(vertex, fragment, &frame, &spots, None),
                slots: fragment.inputs().to_vec(),
                frame: Cow::Owned(frame),
            };
            let blocks = given.blocks.iter().enumerate();
            let lanes = blocks.flat_map(|(at, block)| block.covered.lanes().map(move |l| (at, l)));
            let lanes: Vec<(usize, usize)> = lanes.collect();
            Fed::of(&given, lanes.into_iter())
        };
        self.0.iter().map(of_group).collect()
    }
}

/// A renderer that says on which inputs shaders give what is no number, or infinite.
pub trait Device {
    /// What it is called.
    fn name(&self) -> &str;

    /// For each shader and each fragment of the inputs, whether what is returned there is not finite. Nothing where one of the shaders
    /// cannot be asked, as with textures that were made for it.
    fn bad(&mut self, shaders: &[&Shader], asked: &Asked) -> Option<Vec<Vec<bool>>>;
}

/// What a device made of the inputs of a variant.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct OnDevice {
    /// How many inputs it was asked about.
    pub inputs: usize,
    /// On how many of them the variant fails there and the original does not.
    pub fails: usize,
    /// Why it does on the first of them.
    pub blamed: Option<Blamed>,
}

impl Battery<'_> {
    /// Asks a device about a variant, on declared inputs and on those that a hunt has found `near` trouble; nothing where it cannot be
    /// asked. `from` is what its recipe is replayed on.
    pub fn on_device(
        &self,
        device: &mut dyn Device,
        (from, recipe): (&Shader, &Recipe),
        shader: &Shader,
        near: &Asked,
    ) -> Option<OnDevice> {
        let declared = self
            .exhibits
            .iter()
            .filter_map(|exhibit| match &exhibit.inputs {
                Inputs::Made(group) => Some(group),
                Inputs::Seen(_) => None,
            });
        let asked = Asked(declared.chain(&near.0).cloned().collect());
        let said = device.bad(&[self.base(), shader], &asked)?;
        let [original, variant] = &said[..] else {
            return None;
        };
        let mut found = OnDevice {
            inputs: original.len(),
            fails: 0,
            blamed: None,
        };
        let both = original.chunks(4).zip(variant.chunks(4));
        for ((group, quad), (original, variant)) in asked.quads().zip(both) {
            let mut lanes = 0..original.len().min(variant.len());
            let Some(lane) = lanes.find(|&lane| variant[lane] && !original[lane]) else {
                continue;
            };
            let alone = Group {
                quads: vec![group.quads[quad].clone()],
                ..group.clone()
            };
            let exhibit = self.exhibit(self.interface.frame(&alone), Inputs::Made(alone.clone()));
            // Where the original fails by itself in the evaluator nothing is asked of a variant.
            if exhibit.original.iter().any(|bad| bad.block(0).has(lane)) {
                continue;
            }
            found.fails += 1;
            if found.blamed.is_none() {
                let failure = Failure {
                    exhibit: usize::MAX,
                    group: Some(alone.clone()),
                    block: 0,
                    lane,
                    arithmetic: 0,
                    law: None,
                    reach: Reach::Declared,
                };
                let alone = Asked(vec![alone]);
                let mut fails = |shader: &Shader| {
                    let said = device.bad(&[shader], &alone);
                    said.is_none_or(|said| said.concat().get(lane).copied().unwrap_or(true))
                };
                let mut blamed = self.blame_by((from, recipe), &failure, &mut fails);
                blamed.device = Some(device.name().to_owned());
                found.blamed = Some(blamed);
            }
        }
        Some(found)
    }
}
