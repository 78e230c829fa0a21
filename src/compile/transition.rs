//! What transitions cost: the text that is written, drawn in the middle of each band.

use super::clock::Watch;
use super::normal_form;
use super::search::{Ready, vertex_program};
use crate::Result;
use crate::emit::{self, EmitLevel, Output, Transition, figure};
use crate::eval::program::Program;
use crate::eval::programs::Stand;
use crate::eval::refusal;
use crate::report::{RatioReport, TransitionReport};
use crate::scene::Scene;
use crate::search::{Found, SampleSet, Samples};
use crate::time::clock::worst;
use lodc_passes::autolod;

impl Ready {
    /// What is drawn where each level that was found begins, and what it costs there; nothing for the original, and
    /// where levels pop. `levels` are those of `found` that are emitted.
    pub(super) fn transitions(
        &self,
        vertex: &Program,
        found: &Found,
        levels: &[EmitLevel],
        output: Output,
        watch: Option<&mut Watch<'_>>,
    ) -> Result<Vec<Option<TransitionReport>>> {
        let mut transitions = vec![None; found.levels.len()];
        if output.transition == Transition::Pop || levels.is_empty() {
            return Ok(transitions);
        }
        let output = Output {
            target: emit::Target::Wgsl,
            ..output
        };
        let emitted = emit::read(&self.source, &self.base, levels, output, "levels")?;
        let (_, mut scene) = Scene::read_both(&self.source, &emitted, self.scene_file.as_deref())?;
        let base = normal_form(&emitted)?;
        let own = vertex_program(&scene, &base).map_err(|refused| refusal(&refused, &emitted))?;
        let mut bands = Vec::new();
        for (place, (at, _)) in found.written().enumerate() {
            let Some(until) = emit::band_end(levels, place, output) else {
                continue;
            };
            let from = levels[place].autolod;
            let middle = f64::midpoint(f64::from(from), f64::from(until));
            scene.set_auto_lod(middle);
            let of_scene = &self.scene;
            let view = of_scene.view(of_scene.nearest);
            let distance = autolod::distance_of(middle, of_scene.rho0(), &view);
            let stands = [
                Stand {
                    base: &self.base,
                    vertex,
                    scene: of_scene,
                },
                Stand {
                    base: &base,
                    vertex: &own,
                    scene: &scene,
                },
            ];
            let [original, both] =
                SampleSet::of_two([&stands[0], &stands[1]], distance, Samples::Search)
                    .map_err(|refused| refusal(&refused, &self.source))?;
            let drawn = both
                .measure(&base)
                .map_err(|refused| refusal(&refused, &emitted))?;
            // What the vertex stages of the two do more is theirs.
            let moved = [at.checked_sub(1), Some(at)].into_iter().flatten();
            let moved: f64 = moved.map(|of| found.levels[of].used.work.moved).sum();
            let cost = (drawn.used.work.total() + moved) / original.original().used.work.total();
            bands.push((at, (middle, distance)));
            transitions[at] = Some(TransitionReport {
                kind: output.transition.name(),
                from: f64::from(from),
                until: f64::from(until),
                cost: Some(figure(cost)),
                time: None,
            });
        }
        if let Some(watch) = watch {
            let (of, places): (Vec<usize>, Vec<(f64, f64)>) = bands.into_iter().unzip();
            let timed = watch.whole((&self.base, levels), output, &places);
            for (at, timings) in of.into_iter().zip(timed) {
                if let Some(transition) = &mut transitions[at] {
                    transition.time = worst(&timings).map(RatioReport::of);
                }
            }
        }
        Ok(transitions)
    }
}
