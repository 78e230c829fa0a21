//! Draws a frame: rasterises once, shades as often as there are variants.

mod blend;
mod format;
mod light;
#[cfg(test)]
mod tests;

pub use blend::{Blend, DrawState, Weights};
pub(crate) use blend::{Layers, state_of};
pub use format::Format;
pub use light::{Lighting, Lit, Plane};

use super::image::Picture;
use super::lane::{LANES, Words};
use super::machine::{Bindings, Machine, Profile};
use super::program::{Program, Slot};
use super::raster::{Block, Coverage, Frame, rasterize};
use naga::{Binding, BuiltIn, ScalarKind};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Blocks that one machine runs. Profiles are summed machine by machine, so this is part of the result's
/// bits; the number of threads is not.
const BLOCKS_PER_MACHINE: usize = 8;

/// What a fragment program made of a coverage.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shading {
    /// For each covered fragment of the coverage, in its order, the colour at location 0. Components
    /// that the program does not return are 0, alpha 1; integers are converted.
    pub colours: Vec<[f32; 4]>,
    /// The same for further locations, where they were asked for, in their order.
    pub targets: Vec<Vec<[f32; 4]>>,
    /// For each covered fragment, whether it was kept (not discarded, and its sample mask not 0).
    pub alive: Vec<bool>,
    /// For each covered fragment its depth, when the program returns one; empty otherwise.
    pub depths: Vec<f32>,
    /// What was executed.
    pub profile: Profile,
}

impl Shading {
    /// The depth of a fragment: what the program returned, clamped to the viewport's range (NaN is 0), or else that
    /// of its triangle.
    pub(crate) fn depth(&self, fragment: usize, of_triangle: f32) -> f32 {
        let own = self.depths.get(fragment).copied();
        own.unwrap_or(of_triangle).max(0.0)
    }
}

/// Shades every fragment, in parallel, with all colours that the program returns; the result does not depend on the number of threads.
///
/// Inputs are matched by location or built-in and component, so a program may read less than the one that
/// the coverage was made for; what the coverage does not have is 0.
///
/// # Panics
/// When a resource of the program is not bound.
pub fn shade(fragment: &Program, coverage: &Coverage, bindings: &Bindings) -> Shading {
    let mut shading = Shading::default();
    let further = fragment
        .outputs()
        .iter()
        .filter_map(|slot| match slot.binding {
            Binding::Location { location, .. } if location > 0 => Some(location),
            _ => None,
        });
    let further: BTreeSet<u32> = further.collect();
    let further: Vec<u32> = further.into_iter().collect();
    shade_targets(fragment, coverage, bindings, &further, None, &mut shading);
    shading
}

/// The same of location 0 alone, into a shading that is used again, so that nothing is allocated for its fragments.
///
/// # Panics
/// When a resource of the program is not bound.
pub fn shade_into(
    fragment: &Program,
    coverage: &Coverage,
    bindings: &Bindings,
    shading: &mut Shading,
) {
    shade_targets(fragment, coverage, bindings, &[], None, shading);
}

/// The same, lit where something lights it: the colours are those that are seen.
///
/// # Panics
/// When a resource of the program is not bound.
pub(crate) fn shade_lit(
    lit: Option<&Lit>,
    fragment: &Program,
    coverage: &Coverage,
    bindings: &Bindings,
    shading: &mut Shading,
) {
    match lit {
        Some(lit) => lit.shade_into(fragment, coverage, bindings, shading),
        None => shade_into(fragment, coverage, bindings, shading),
    }
}

/// The same with what each covered fragment weighs in the program's probes.
///
/// # Panics
/// When a resource of the program is not bound, or there are fewer weights than fragments.
pub fn shade_weighed(
    fragment: &Program,
    coverage: &Coverage,
    bindings: &Bindings,
    weights: &[f32],
    shading: &mut Shading,
) {
    shade_targets(fragment, coverage, bindings, &[], Some(weights), shading);
}

/// The same with what the program returns at further locations.
fn shade_targets(
    fragment: &Program,
    coverage: &Coverage,
    bindings: &Bindings,
    targets: &[u32],
    weights: Option<&[f32]>,
    shading: &mut Shading,
) {
    let interface = Interface::new(fragment, coverage, targets);
    let depths = if interface.depth.is_some() {
        coverage.fragments
    } else {
        0
    };
    shading.colours.resize(coverage.fragments, [0.0; 4]);
    shading.alive.resize(coverage.fragments, false);
    shading.depths.resize(depths, 0.0);
    shading.targets.resize(targets.len(), Vec::new());
    for target in &mut shading.targets {
        target.resize(coverage.fragments, [0.0; 4]);
    }

    let mut jobs = Vec::new();
    let (mut colours, mut alive, mut depths) = (
        &mut shading.colours[..],
        &mut shading.alive[..],
        &mut shading.depths[..],
    );
    let mut targets: Vec<_> = shading.targets.iter_mut().map(|t| &mut t[..]).collect();
    let draws = coverage.blocks.chunk_by(|a, b| a.draw == b.draw);
    for blocks in draws.flat_map(|blocks| blocks.chunks(BLOCKS_PER_MACHINE)) {
        let count = blocks.iter().map(Block::covered_count).sum();
        jobs.push(Job {
            blocks,
            colours: colours.split_off_mut(..count).unwrap_or_default(),
            targets: targets
                .iter_mut()
                .map(|target| target.split_off_mut(..count).unwrap_or_default())
                .collect(),
            alive: alive.split_off_mut(..count).unwrap_or_default(),
            depths: depths.split_off_mut(..count).unwrap_or_default(),
            weights,
        });
    }
    let profiles: Vec<Profile> = jobs
        .into_par_iter()
        .map(|job| job.run(fragment, bindings, &interface))
        .collect();
    shading.profile = profiles
        .into_iter()
        .reduce(merge)
        .unwrap_or_else(|| Machine::new(fragment, bindings).profile());
}

/// The picture in fine pixels, fragments that hide each other resolved. Background pixels are 0. Where draws are
/// blended, pixels are premultiplied colours with coverage, as in a target of floats, and those that look the same over
/// any background are background.
pub fn resolve(coverage: &Coverage, shading: &Shading) -> Picture {
    let mut picture = Picture::empty(coverage.width, coverage.height);
    if coverage.blends() {
        let layers = Layers::new(coverage, shading, picture.pixels.len(), |_, pixel| pixel);
        let held = |[r, g, b, a]: [f32; 4]| [r, g, b, a.clamp(0.0, 1.0)];
        let pixels = picture.pixels.iter_mut().zip(&mut picture.covered);
        for (place, (pixel, covered)) in pixels.enumerate() {
            if let Some(composed) = layers.compose(place, shading, held) {
                (*pixel, *covered) = (composed, 1.0);
            }
        }
        return picture;
    }
    for (pixel, fragment) in nearest(coverage, shading).into_iter().enumerate() {
        if let Some(fragment) = fragment {
            picture.pixels[pixel] = shading.colours[fragment as usize];
            picture.covered[pixel] = 1.0;
        }
    }
    picture
}

/// The fragments that a picture is made of.
#[derive(Clone, Debug)]
pub struct Seen {
    /// The coverage with those fragments alone; the others have become helpers.
    pub coverage: Coverage,
    /// What they weigh, where they are blended; else each weighs 1.
    pub weights: Option<Weights>,
}

/// Finds the fragments that a picture is made of. What a shader that discards computes where it is hidden should not
/// count as seen. `held` is what the target holds of a colour that is blended.
pub fn seen(coverage: &Coverage, shading: &Shading, held: impl Fn([f32; 4]) -> [f32; 4]) -> Seen {
    let mut shown = vec![false; coverage.fragments];
    let places = coverage.width as usize * coverage.height as usize;
    let weights = coverage.blends().then(|| {
        let layers = Layers::new(coverage, shading, places, |_, pixel| pixel);
        let mut weights = layers.weights(shading, held);
        for (shown, arrives) in shown.iter_mut().zip(&weights.arrives) {
            *shown = *arrives > 0.0;
        }
        for list in [&mut weights.arrives, &mut weights.share] {
            let mut kept = shown.iter();
            list.retain(|_| kept.next().copied().unwrap_or(false));
        }
        weights
    });
    if weights.is_none() {
        for fragment in nearest(coverage, shading).into_iter().flatten() {
            shown[fragment as usize] = true;
        }
    }
    let mut seen = coverage.clone();
    seen.fragments = 0;
    for (block, before) in seen.blocks.iter_mut().zip(&coverage.blocks) {
        block.first = seen.fragments;
        for (i, lane) in before.covered.lanes().enumerate() {
            if !shown[before.first + i] {
                block.covered.0[lane / 64] &= !(1 << (lane % 64));
                block.pixels[lane] = u32::MAX;
            }
        }
        seen.fragments += block.covered_count();
    }
    Seen {
        coverage: seen,
        weights,
    }
}

/// For each fine pixel the fragment that it shows: the nearest that is alive, of equal ones the first.
fn nearest(coverage: &Coverage, shading: &Shading) -> Vec<Option<u32>> {
    let mut nearest = vec![None; coverage.width as usize * coverage.height as usize];
    let places = nearest.len();
    let place = |_, pixel| pixel;
    each_visible(coverage, shading, places, place, |pixel, fragment| {
        nearest[pixel as usize] = Some(fragment as u32);
    });
    nearest
}

/// Shows every fragment that is alive and that none before it hides, with its place: the last one shown at a
/// place is the one that is seen there. `place` numbers the pixels, below `places`, from a fragment and its fine
/// pixel.
pub(crate) fn each_visible(
    coverage: &Coverage,
    shading: &Shading,
    places: usize,
    place: impl Fn(usize, u32) -> u32,
    mut show: impl FnMut(u32, usize),
) {
    let mut depths = vec![1.0_f32; if coverage.late { places } else { 0 }];
    for block in &coverage.blocks {
        for (i, lane) in block.covered.lanes().enumerate() {
            let fragment = block.first + i;
            if !shading.alive[fragment] {
                continue;
            }
            let place = place(fragment, block.pixels[lane]);
            if coverage.late {
                let depth = shading.depth(fragment, block.depths[lane]);
                let nearest = &mut depths[place as usize];
                if depth >= *nearest {
                    continue;
                }
                *nearest = depth;
            }
            show(place, fragment);
        }
    }
}

/// Draws a frame whole: rasterises, shades, resolves, and filters the grid's fine pixels into pixels.
/// The profile is the fragment program's.
///
/// # Panics
/// When a resource of a program is not bound, or the frame is larger than [`super::raster::MAX_EDGE`].
pub fn draw(vertex: &Program, fragment: &Program, frame: &Frame) -> (Picture, Profile) {
    let coverage = rasterize(vertex, fragment, frame);
    let shading = shade(fragment, &coverage, &frame.bindings);
    let picture = resolve(&coverage, &shading);
    (picture.box_filtered(frame.grid), shading.profile)
}

/// How a program's inputs and outputs lie in a coverage and a shading.
struct Interface {
    /// For each input the coverage's, when they are not the same list.
    inputs: Option<Vec<Option<usize>>>,
    /// How many outputs there are.
    outputs: usize,
    /// The outputs that are the colour.
    colour: Vec<Component>,
    /// The same for each further location.
    targets: Vec<Vec<Component>>,
    /// The output that is the depth.
    depth: Option<usize>,
    /// The output that is the sample mask.
    sample_mask: Option<usize>,
}

impl Interface {
    fn new(program: &Program, coverage: &Coverage, targets: &[u32]) -> Self {
        let found: Vec<Option<usize>> = program
            .inputs()
            .iter()
            .map(|slot| coverage.slots.iter().position(|have| have.meets(slot)))
            .collect();
        let identical = found.len() == coverage.slots.len()
            && found.iter().enumerate().all(|(i, &at)| at == Some(i));
        let outputs = program.outputs();
        let built_in = |wanted: BuiltIn| {
            outputs
                .iter()
                .position(|slot| slot.binding == Binding::BuiltIn(wanted))
        };
        Self {
            inputs: (!identical).then_some(found),
            outputs: outputs.len(),
            colour: components(outputs, 0),
            targets: targets
                .iter()
                .map(|location| components(outputs, *location))
                .collect(),
            depth: built_in(BuiltIn::FragDepth),
            sample_mask: built_in(BuiltIn::SampleMask),
        }
    }
}

/// One component of a colour: the output that it is, its place in the colour, what its word holds.
type Component = (usize, usize, ScalarKind);

/// The components of the colour at a location.
fn components(outputs: &[Slot], wanted: u32) -> Vec<Component> {
    let all = outputs.iter().enumerate();
    let own = all.filter(|(_, slot)| {
        matches!(
            slot.binding,
            Binding::Location {
                location,
                blend_src: None | Some(0),
                ..
            } if location == wanted
        )
    });
    own.map(|(i, slot)| (i, slot.component, slot.kind))
        .collect()
}

/// The colour that a lane returned.
fn colour(components: &[Component], outputs: &[Words], lane: usize) -> [f32; 4] {
    let mut colour = [0.0, 0.0, 0.0, 1.0];
    for &(output, component, kind) in components {
        let word = outputs[output][lane];
        colour[component & 3] = match kind {
            ScalarKind::Uint | ScalarKind::Bool => word as f32,
            ScalarKind::Sint => word.cast_signed() as f32,
            _ => f32::from_bits(word),
        };
    }
    colour
}

/// The blocks of one machine, all of one draw, and where their results go.
struct Job<'a> {
    blocks: &'a [Block],
    colours: &'a mut [[f32; 4]],
    targets: Vec<&'a mut [[f32; 4]]>,
    alive: &'a mut [bool],
    depths: &'a mut [f32],
    /// Of all fragments of the coverage, where they do not weigh the same.
    weights: Option<&'a [f32]>,
}

impl Job<'_> {
    fn run(mut self, program: &Program, bindings: &Bindings, interface: &Interface) -> Profile {
        let draw = self.blocks.first().map_or(0, |block| block.draw);
        let mut machine = Machine::of_draw(program, bindings, draw);
        let mut outputs = vec![[0; LANES]; interface.outputs];
        let mut chosen: Vec<Words> = match &interface.inputs {
            Some(inputs) => vec![[0; LANES]; inputs.len()],
            None => Vec::new(),
        };
        let mut fragment = 0;
        for block in self.blocks {
            let inputs = match &interface.inputs {
                None => &block.inputs,
                Some(places) => {
                    for (words, place) in chosen.iter_mut().zip(places) {
                        if let Some(place) = *place {
                            *words = block.inputs[place];
                        }
                    }
                    &chosen
                }
            };
            if let Some(weights) = self.weights {
                let mut of_lanes = [0.0; LANES];
                for (i, lane) in block.covered.lanes().enumerate() {
                    of_lanes[lane] = weights[block.first + i];
                }
                machine.weigh(&of_lanes);
            }
            machine.recall(block.recall.as_deref());
            let kept = machine.run(inputs, block.active, block.covered, &mut outputs);
            for lane in block.covered.lanes() {
                self.colours[fragment] = colour(&interface.colour, &outputs, lane);
                for (target, components) in self.targets.iter_mut().zip(&interface.targets) {
                    target[fragment] = colour(components, &outputs, lane);
                }
                self.alive[fragment] = kept.0[lane / 64] >> (lane % 64) & 1 == 1
                    && interface
                        .sample_mask
                        .is_none_or(|o| outputs[o][lane] & 1 == 1);
                if let Some(depth) = interface.depth {
                    self.depths[fragment] = f32::from_bits(outputs[depth][lane]);
                }
                fragment += 1;
            }
        }
        machine.profile()
    }
}

/// The profile of two runs of one program, the first one first.
fn merge(mut first: Profile, second: Profile) -> Profile {
    first.absorb(&second);
    first
}
