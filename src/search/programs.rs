//! The programs that draw a variant: of its fragment stage, and of its vertex stage where it has one of its own.

use crate::eval::program::{Program, Refused};
use lodc_passes::{Fingerprint, Shader, Stage};
use naga::{Expression, Handle};

/// What draws a variant over fragments that its original was rasterised to.
#[derive(Debug)]
pub struct Programs {
    pub(super) fragment: Program,
    /// The vertex stage, and its identity where it is known; none where it is the original's.
    pub(super) vertex: Option<(Program, Option<Fingerprint>)>,
    /// What handing over costs a fragment beside what it costs the original's, in full-rate scalar operations.
    pub(super) handing_over: f64,
}

impl Programs {
    /// Those of a variant that passes made.
    ///
    /// # Errors
    /// When the evaluator refuses it; a variant of an original that runs, runs.
    pub fn of(shader: &Shader) -> Result<Self, Refused> {
        let fragment = fragment(shader, &[])?;
        Self::with(shader, fragment)
    }

    /// The same with another program of its fragment stage.
    pub(super) fn with(shader: &Shader, fragment: Program) -> Result<Self, Refused> {
        match shader.handing_over() {
            None => Ok(Self {
                fragment,
                vertex: None,
                handing_over: 0.0,
            }),
            Some(handing_over) => Ok(Self {
                fragment,
                vertex: vertex(shader)?,
                handing_over,
            }),
        }
    }

    /// Those of any shader with the original's inputs and positions, such as one that was emitted and read again: its
    /// vertex stage is run, whatever it hands over.
    pub fn new(vertex: Program, fragment: Program) -> Self {
        Self {
            fragment,
            vertex: Some((vertex, None)),
            handing_over: 0.0,
        }
    }
}

/// The program of a shader's fragment stage, with probes.
pub(super) fn fragment(shader: &Shader, probes: &[Handle<Expression>]) -> Result<Program, Refused> {
    // A shader always has a fragment stage.
    let entry = shader.index(Stage::Fragment).unwrap_or(0);
    Program::compile(shader.module(), entry, probes)
}

/// The program of its vertex stage, and its identity.
fn vertex(shader: &Shader) -> Result<Option<(Program, Option<Fingerprint>)>, Refused> {
    let Some(entry) = shader.index(Stage::Vertex) else {
        return Ok(None);
    };
    let program = Program::compile(shader.module(), entry, &[])?;
    Ok(Some((program, shader.fingerprint_of(Stage::Vertex))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compile::normal_form;
    use crate::eval::draw::shade;
    use crate::eval::raster::{Frame, rasterize};
    use crate::front::Source;
    use crate::scene::Scene;
    use crate::search::{SampleSet, Samples, Stand};
    use lodc_passes::vertex_motion::VertexMotion;
    use lodc_passes::{Pass, recipe};
    use std::path::Path;

    #[test]
    fn inputs_that_are_added_to_known_fragments_are_those_of_a_picture_of_its_own() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata/materials");
        for material in ["car_paint", "ivy"] {
            let path = folder.join(material).with_extension("wgsl");
            let source = Source::read(&path).expect("it parses");
            let path = path.with_extension("toml");
            let text = std::fs::read_to_string(&path).expect("it is there");
            let lines = text.lines().filter(|line| !line.starts_with("resolution"));
            let lines: Vec<&str> = ["resolution = [48, 48]"].into_iter().chain(lines).collect();
            let scene = Scene::resolve(&source, Some((&path, &lines.join("\n"))));
            let scene = scene.unwrap_or_else(|e| panic!("{e}"));
            let base = normal_form(&source).expect("it is small");
            let original = fragment(&base, &[]).expect("it runs");
            let (vertex, _) = vertex(&base).expect("it runs").expect("it has one");
            let stand = Stand {
                base: &base,
                vertex: &vertex,
                scene: &scene,
            };
            let set = SampleSet::new(&stand, scene.nearest, Samples::Full).expect("it runs");
            let candidates = VertexMotion.candidates(&base, &set.facts(&base));
            assert!(candidates.len() > 3, "{material}: {candidates:?}");
            let mut seen = 0;
            for candidate in candidates.iter().step_by(candidates.len() / 4) {
                let shader = recipe::apply(&base, candidate).expect("it was offered");
                let own = Programs::of(&shader).expect("it runs");
                let (own_vertex, _) = own.vertex.as_ref().expect("it has one of its own");
                for frame in scene.frames(scene.nearest).into_iter().take(2) {
                    let frame = Frame {
                        offset: [0.25, -0.125],
                        ..frame
                    };
                    let alone = rasterize(own_vertex, &own.fragment, &frame);
                    let known = rasterize(&vertex, &original, &frame);
                    for part in [false, true] {
                        let keep = |(x, y): (u32, u32)| !part || (x + y) % 3 == 0;
                        let alone = alone.part(keep);
                        let known = known.part(keep);
                        let more = known.with_inputs_of(own_vertex, &own.fragment, &frame);
                        let [direct, added] = [&alone, &more]
                            .map(|coverage| shade(&own.fragment, coverage, &frame.bindings));
                        assert_eq!(direct.colours, added.colours, "{candidate}");
                        assert_eq!(direct.alive, added.alive, "{candidate}");
                        seen += added.colours.len();
                    }
                }
                let measured = set.measure(&shader).expect("it runs");
                let by_both = Programs::of(&shader).expect("it runs");
                let (own_vertex, _) = by_both.vertex.expect("it has one of its own");
                let by_both = Programs::new(own_vertex, by_both.fragment);
                assert_eq!(measured.error, set.measure_programs(&by_both).error);
                assert!(
                    measured.work.moved > own.handing_over,
                    "{candidate}: {measured:?}"
                );
            }
            assert!(seen > 1000, "{seen}");
        }
    }
}
