//! One frame of a sample set: rasterised once for every offset, with the reference's pixels beside it; and a frame as a
//! picture, for people.

use crate::error::{
    FrameError, GRID, Reference, Shown, TILE, Tally, colours, encoded, held, over_black,
    reference_of,
};
use crate::eval::draw::{Lit, Seen, Shading, seen, shade_into, shade_lit};
use crate::eval::machine::{Bindings, Profile};
use crate::eval::mix::Mix;
use crate::eval::program::Program;
use crate::eval::programs::Programs;
use crate::eval::raster::{Coverage, Frame, rasterize};
use crate::scene::{Output, Scene, chance::mix};
use lodc_passes::{Fingerprint, Work};
use std::collections::{BTreeSet, VecDeque};
use std::sync::{Arc, Mutex, PoisonError};

/// Of how many vertex stages that variants have of their own it is kept what they hand over.
const KEPT: usize = 4;

/// How much of a frame is looked at.
#[derive(Clone, Copy, Debug)]
pub(super) enum Part<'a> {
    /// At most so many squares of 2 x 2 pixels.
    Squares(usize),
    /// At most so many tiles.
    Tiles(usize),
    /// These tiles, by column and row.
    These(&'a BTreeSet<(u32, u32)>),
}

/// What draws a frame: the stages of a shader, and the scene as it is for that shader.
#[derive(Clone, Copy)]
pub(super) struct Pen<'a> {
    pub(super) vertex: &'a Program,
    pub(super) fragment: &'a Program,
    pub(super) scene: &'a Scene,
}

/// A frame, rasterised.
pub(super) struct Rasterised {
    /// Which of the scene's views it is, from 0.
    view: usize,
    /// What was rasterised, at the centre of the pixel.
    pub(super) frame: Frame,
    /// One for each offset.
    pub(super) drawings: Vec<Drawing>,
    /// The pixels that the reference or a fragment covers.
    reference: Arc<Reference>,
}

/// Coverages by the vertex stage that their inputs are of, the latest first.
type Wider = VecDeque<(Option<Fingerprint>, Arc<Coverage>)>;

/// A frame rasterised at one offset.
pub(super) struct Drawing {
    pub(super) coverage: Arc<Coverage>,
    /// Where in a pixel it is sampled.
    offset: [f32; 2],
    /// With the inputs of variants that have a vertex stage of their own, known by the identity of that; the latest.
    wider: Option<Mutex<Wider>>,
    /// What lights it, in a deferred scene.
    lit: Option<Lit>,
    /// Those fragments alone that the original shows, where others are shaded too and hidden afterwards.
    pub(super) seen: Option<Seen>,
    /// For each covered fragment, its place in the reference.
    places: Vec<u32>,
}

/// What was executed for a frame, at all of its offsets together.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Executed {
    /// Covered fragments that were shaded.
    pub(super) fragments: u64,
    /// In them.
    pub(super) work: Work,
    /// The same by class.
    pub(super) mix: Mix,
    /// Vertices that were shaded.
    pub(super) vertices: u64,
    /// In them.
    pub(super) vertex_mix: Mix,
    /// Covered fragments of the whole pictures.
    pub(super) drawn: usize,
    /// What the vertex stage did more than the original's at all vertices, and the parameter stage for all draws, in
    /// full-rate scalar operations.
    pub(super) elsewhere: f64,
}

impl Rasterised {
    /// Rasterises a frame at each offset, for each shader that draws it, and draws its reference: the first, the
    /// original, 4 x 4 samples a pixel. Of more pixels than the part allows some are chosen, by the seed. One for each
    /// shader comes back, with the frame as its scene binds it; all have the same reference.
    pub(super) fn new(
        pens: &[(Pen<'_>, Frame)],
        view: usize,
        offsets: &[[f32; 2]],
        (part, seed): (Part<'_>, u64),
    ) -> Vec<Self> {
        let at = |frame: &Frame, offset: [f32; 2], grid: u32| Frame {
            offset,
            grid,
            ..frame.clone()
        };
        let Some((original, frame)) = pens.first() else {
            return Vec::new();
        };
        let mut coverages: Vec<Vec<Coverage>> = pens
            .iter()
            .map(|(pen, frame)| {
                let offsets = offsets.iter();
                let frames = offsets.map(|offset| at(frame, *offset, 1));
                frames
                    .map(|frame| rasterize(pen.vertex, pen.fragment, &frame))
                    .collect()
            })
            .collect();
        let fine = at(frame, [0.0; 2], GRID);
        let mut reference = rasterize(original.vertex, original.fragment, &fine);
        let all = coverages.iter().flatten().chain([&reference]);
        // A square is 2 x 2 pixels.
        let (side, most) = match part {
            Part::Squares(most) => (1, most),
            Part::Tiles(most) => (TILE / 2, most),
            Part::These(_) => (TILE / 2, 0),
        };
        let place = |(x, y): (u32, u32)| (x / side, y / side);
        let mut places: Vec<_> = all.flat_map(Coverage::squares).map(place).collect();
        places.sort_unstable();
        places.dedup();
        if places.len() > most {
            let chosen;
            let kept = match part {
                Part::These(tiles) => tiles,
                Part::Squares(_) | Part::Tiles(_) => {
                    chosen = choose(&places, most.max(1), seed);
                    &chosen
                }
            };
            let part = |coverage: &Coverage| coverage.part(|square| kept.contains(&place(square)));
            for coverage in coverages.iter_mut().flatten() {
                *coverage = part(coverage);
            }
            reference = part(&reference);
        }
        let output = original.scene.output;
        let mut shading = Shading::default();
        let lit = original.scene.lit(&fine, &reference);
        shade_lit(
            lit.as_ref(),
            original.fragment,
            &reference,
            &fine.bindings,
            &mut shading,
        );
        let (reference, pixels) =
            reference_of(&reference, &shading, coverages.iter().flatten(), output);
        let reference = Arc::new(reference);
        let drawn = pens.iter().zip(coverages);
        drawn
            .map(|((pen, frame), coverages)| {
                let drawings = coverages.into_iter().zip(offsets);
                let drawings = drawings.map(|(coverage, offset)| {
                    let lit = pen.scene.lit(&at(frame, *offset, 1), &coverage);
                    let bindings = (&frame.bindings, output);
                    Drawing::new(pen.fragment, (coverage, *offset), lit, &pixels, bindings)
                });
                Self {
                    view,
                    drawings: drawings.collect(),
                    frame: at(frame, [0.0; 2], 1),
                    reference: Arc::clone(&reference),
                }
            })
            .collect()
    }

    /// Which of the scene's views it is.
    pub(super) fn view(&self) -> usize {
        self.view
    }

    /// From now on what variants read of textures is remembered (see [`Coverage::remember`]), and what their own vertex
    /// stages hand over.
    pub(super) fn remember(&mut self) {
        for drawing in &mut self.drawings {
            Arc::make_mut(&mut drawing.coverage).remember();
            drawing.wider = Some(Mutex::default());
        }
    }

    /// Column and row of each of its tiles.
    pub(super) fn tiles(&self) -> &[(u32, u32)] {
        self.reference.tile_places()
    }

    /// Draws a variant at every offset and compares with the reference.
    pub(super) fn measure(&self, programs: &Programs, output: Output) -> (FrameError, Executed) {
        let mut shading = Shading::default();
        let mut executed = Executed::default();
        let mut tally = Tally::new(&self.reference);
        let (frame, of_draws) = programs.bound(&self.frame);
        for drawing in &self.drawings {
            let coverage = drawing.covered(programs, &frame);
            drawing.shade(programs, &coverage, &frame.bindings, &mut shading);
            tally.add(&drawing.colours(&shading, self.reference.len(), output));
            executed.fragments += shading.profile.lanes;
            executed.work += shading.profile.work;
            executed.mix += shading.profile.mix;
            executed.vertices += coverage.vertex_profile.lanes;
            executed.vertex_mix += coverage.vertex_profile.mix;
            executed.drawn += coverage.drawn;
            let each = |coverage: &Coverage| {
                let Profile { work, lanes, .. } = &coverage.vertex_profile;
                work.total() / (*lanes).max(1) as f64
            };
            let more = (each(&coverage) - each(&drawing.coverage)).max(0.0);
            executed.elsewhere += more * self.frame.mesh.positions.len() as f64 + of_draws;
        }
        (tally.finish(), executed)
    }

    /// FLIP of a variant's picture at the first offset: its sum over pixels, and how many those are.
    pub(super) fn flip(
        &self,
        programs: &Programs,
        output: Output,
        pixels_per_degree: f64,
    ) -> (f64, usize) {
        let Some(drawing) = self.drawings.first() else {
            return (0.0, 0);
        };
        let mut shading = Shading::default();
        let (frame, _) = programs.bound(&self.frame);
        let coverage = drawing.covered(programs, &frame);
        drawing.shade(programs, &coverage, &frame.bindings, &mut shading);
        let colours = drawing.colours(&shading, self.reference.len(), output);
        self.reference.flip(&colours, pixels_per_degree)
    }

    /// For each variant, what it leaves at each pixel of every drawing (see [`Reference::differences`]).
    pub(super) fn differences(&self, programs: &[Programs], output: Output) -> Vec<Vec<[f32; 6]>> {
        let mut shading = Shading::default();
        let mut of_all = vec![Vec::new(); programs.len()];
        for (programs, differences) in programs.iter().zip(&mut of_all) {
            let (frame, _) = programs.bound(&self.frame);
            for drawing in &self.drawings {
                let coverage = drawing.covered(programs, &frame);
                drawing.shade(programs, &coverage, &frame.bindings, &mut shading);
                let colours = drawing.colours(&shading, self.reference.len(), output);
                differences.extend(self.reference.differences(&colours));
            }
        }
        of_all
    }
}

/// A frame as a display shows it over black, row by row: encoded colours, 0..1. One sample a pixel, at its centre.
pub(super) fn shown(pen: &Pen<'_>, frame: &Frame) -> Vec<[f32; 3]> {
    let coverage = rasterize(pen.vertex, pen.fragment, frame);
    let lit = pen.scene.lit(frame, &coverage);
    let mut shading = Shading::default();
    shade_lit(
        lit.as_ref(),
        pen.fragment,
        &coverage,
        &frame.bindings,
        &mut shading,
    );
    let (picture, _) = over_black(&coverage, &shading, pen.scene.output);
    let pixels = picture.pixels.iter().zip(&picture.covered);
    pixels
        .map(|([r, g, b, _], covered)| match *covered > 0.0 {
            true => encoded([*r, *g, *b]),
            false => [0.0; 3],
        })
        .collect()
}

impl Drawing {
    fn new(
        original: &Program,
        (coverage, offset): (Coverage, [f32; 2]),
        lit: Option<Lit>,
        pixels: &[u32],
        (bindings, output): (&Bindings, Output),
    ) -> Self {
        let mut places = vec![0; coverage.fragments];
        for (place, pixel) in places.iter_mut().zip(coverage.pixels()) {
            // Every covered pixel is among them.
            *place = pixels.binary_search(&pixel).unwrap_or(0) as u32;
        }
        Self {
            seen: (coverage.late || coverage.blends()).then(|| {
                let mut shading = Shading::default();
                shade_into(original, &coverage, bindings, &mut shading);
                seen(&coverage, &shading, |colour| held(output, colour))
            }),
            places,
            lit,
            coverage: Arc::new(coverage),
            offset,
            wider: None,
        }
    }

    /// Its fragments, with the inputs that a variant has. The frame is the one that was rasterised.
    pub(super) fn covered(&self, programs: &Programs, frame: &Frame) -> Arc<Coverage> {
        let Some((_, identity)) = &programs.vertex else {
            return Arc::clone(&self.coverage);
        };
        // A thread that panicked has left nothing half done.
        let wider = self.wider.as_ref().filter(|_| identity.is_some());
        let kept = wider.map(Mutex::lock);
        let mut kept = kept.map(|kept| kept.unwrap_or_else(PoisonError::into_inner));
        if let Some(kept) = &mut kept
            && let Some((_, more)) = kept.iter().find(|(of, _)| of == identity)
        {
            return Arc::clone(more);
        }
        drop(kept);
        let more = Arc::new(self.with_inputs(&self.coverage, programs, frame));
        if let Some(wider) = wider {
            let mut kept = wider.lock().unwrap_or_else(PoisonError::into_inner);
            kept.truncate(KEPT - 1);
            kept.push_front((*identity, Arc::clone(&more)));
        }
        more
    }

    /// Some of its fragments with the inputs that a variant has.
    pub(super) fn with_inputs(
        &self,
        coverage: &Coverage,
        programs: &Programs,
        frame: &Frame,
    ) -> Coverage {
        let Some((vertex, _)) = &programs.vertex else {
            return coverage.clone();
        };
        let frame = Frame {
            offset: self.offset,
            ..frame.clone()
        };
        coverage.with_inputs_of(vertex, &programs.fragment, &frame)
    }

    /// Shades what is drawn, and lights it in a deferred scene: the colours are those that are seen.
    fn shade(
        &self,
        programs: &Programs,
        coverage: &Coverage,
        bindings: &Bindings,
        shading: &mut Shading,
    ) {
        shade_lit(
            self.lit.as_ref(),
            &programs.fragment,
            coverage,
            bindings,
            shading,
        );
    }

    /// What a display shows at each pixel of the reference, over each background.
    fn colours(&self, shading: &Shading, pixels: usize, output: Output) -> Vec<Shown> {
        let place = |fragment: usize, _| self.places[fragment];
        colours(&self.coverage, shading, (pixels, place), output)
    }
}

/// Some of the squares, `count` of them, spread evenly: sorted by a hash of their place and the seed.
fn choose(all: &[(u32, u32)], count: usize, seed: u64) -> BTreeSet<(u32, u32)> {
    let mut order: Vec<(u64, (u32, u32))> = all
        .iter()
        .map(|square| {
            (
                mix(seed ^ mix(u64::from(square.0) << 32 | u64::from(square.1))),
                *square,
            )
        })
        .collect();
    order.sort_unstable();
    order
        .into_iter()
        .take(count)
        .map(|(_, square)| square)
        .collect()
}

#[cfg(test)]
mod tests {
    use crate::compile::normal_form;
    use crate::eval::program::Program;
    use crate::eval::programs::Stand;
    use crate::front::Source;
    use crate::scene::Scene;
    use crate::search::{SampleSet, Samples};
    use lodc_passes::{PASSES, Stage};
    use std::path::Path;

    #[test]
    fn what_the_lighting_does_not_read_costs_no_error() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata/materials");
        let source = Source::read(&folder.join("gbuffer.wgsl")).unwrap();
        let path = folder.join("gbuffer.toml");
        let scene = std::fs::read_to_string(&path).unwrap();
        let scene = format!("resolution = [32, 32]\n{scene}");
        let scene = Scene::resolve(&source, Some((&path, &scene))).unwrap();
        let base = normal_form(&source).unwrap();
        let vertex = base.index(Stage::Vertex).unwrap();
        let vertex = Program::compile(base.module(), vertex, &[]).unwrap();
        let stand = Stand {
            base: &base,
            vertex: &vertex,
            scene: &scene,
        };
        let set = SampleSet::new(&stand, scene.distances[1], Samples::Full).unwrap();
        let facts = set.facts(&base);
        let (mut free, mut seen) = (0, 0);
        for pass in PASSES {
            for candidate in pass.candidates(&base, &facts) {
                let site = candidate.site.path();
                let unread =
                    site.starts_with("fs_main.velocity") || site.starts_with("fs_main.along");
                let albedo = site.starts_with("fs_main.painted");
                if !unread && !albedo {
                    continue;
                }
                let variant = pass.apply(&base, &candidate);
                let error = set.measure(&variant).unwrap().error;
                let floor = set.original().error;
                if unread {
                    assert_eq!(error, floor, "{candidate}");
                    free += 1;
                } else if error != floor {
                    seen += 1;
                }
            }
        }
        assert!(free > 2 && seen > 0, "{free} {seen}");
    }

    #[test]
    fn alpha_is_seen_where_it_is_blended_alone() {
        let source = Source::parse(
            "pane.wgsl",
            "@fragment fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
                 let light = uv.x * 0.9;
                 let cover = uv.y * 0.8 + 0.1;
                 return vec4f(vec3f(light), cover);
             }",
        )
        .expect("it parses");
        let base = normal_form(&source).expect("it is small");
        for (line, seen) in [("", false), ("blend = \"alpha\"", true)] {
            let text = format!("resolution = [32, 32]\n{line}\n");
            let scene = Scene::resolve(&source, Some((Path::new("a.toml"), &text)));
            let scene = scene.unwrap_or_else(|e| panic!("{e}"));
            let stage = scene.vertex_stage.as_ref().expect("lodc supplies one");
            let vertex = Program::compile(&stage.module, 0, &[]).expect("it is plain");
            let stand = Stand {
                base: &base,
                vertex: &vertex,
                scene: &scene,
            };
            let set = SampleSet::new(&stand, scene.nearest, Samples::Full).expect("it runs");
            let candidates = lodc_passes::recipe::candidates(&base, &set.facts(&base));
            let after = |value: &str| {
                let mut all = candidates.iter();
                let mean = all.find(|c| c.site.path() == value && c.choice == "mean");
                let mean = mean.expect("it is offered");
                let variant = lodc_passes::recipe::apply(&base, mean).expect("it applies");
                set.measure(&variant).expect("it runs").error
            };
            assert_eq!(after("fs_main.cover") != set.original().error, seen);
            assert_ne!(after("fs_main.light"), set.original().error);
        }
    }
}
