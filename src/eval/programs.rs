//! The programs that draw a variant: of its fragment stage, of its vertex stage where it has one of its own, and of its
//! parameter stage.

use super::generated::GeneratedTextures;
use super::parameters::ParameterStage;
use super::program::{Program, Refused};
use super::raster::Frame;
use crate::scene::Scene;
use lodc_passes::goal::active_textures;
use lodc_passes::{Fingerprint, Shader, Stage};
use naga::{Expression, Handle};
use std::borrow::Cow;
use std::collections::BTreeSet;

/// What variants are drawn beside.
pub struct Stand<'a> {
    /// The original in normal form.
    pub base: &'a Shader,
    /// The vertex program that every variant is drawn with.
    pub vertex: &'a Program,
    /// What errors are measured over. With another mesh in the scene, sets of it measure the same shaders on that: what a
    /// level with values at the vertices adds on a finer one, or, by [`crate::search::SampleSet::of_two`], against the first mesh's pictures.
    pub scene: &'a Scene,
}

/// What draws a variant over fragments that its original was rasterised to.
#[derive(Debug)]
pub struct Programs {
    pub(crate) fragment: Program,
    /// The vertex stage, and its identity where it is known; none where it is the original's.
    pub(crate) vertex: Option<(Program, Option<Fingerprint>)>,
    /// What handing over costs a fragment beside what it costs the original's, in full-rate scalar operations.
    pub(crate) handing_over: f64,
    /// What fills the block that the others read.
    pub(crate) parameters: Option<ParameterStage>,
    /// Group and binding of the textures that they read, where that is known.
    pub(crate) textures: BTreeSet<(u32, u32)>,
    /// The textures that were made for it.
    pub(crate) generated: GeneratedTextures,
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
    pub(crate) fn with(shader: &Shader, fragment: Program) -> Result<Self, Refused> {
        let handing_over = shader.handing_over();
        Ok(Self {
            fragment,
            vertex: match handing_over {
                Some(_) => vertex(shader)?,
                None => None,
            },
            handing_over: handing_over.unwrap_or(0.0),
            parameters: ParameterStage::of(shader)?,
            textures: active_textures(shader),
            generated: GeneratedTextures::of(shader)?,
        })
    }

    /// Those of any shader with the original's inputs and positions, such as one that was emitted and read again: its
    /// vertex stage is run, whatever it hands over.
    pub fn new(vertex: Program, fragment: Program) -> Self {
        Self {
            fragment,
            vertex: Some((vertex, None)),
            handing_over: 0.0,
            parameters: None,
            textures: BTreeSet::new(),
            generated: GeneratedTextures::default(),
        }
    }

    /// The same with what fills the block that they read.
    #[must_use]
    pub fn with_parameters(self, parameters: ParameterStage) -> Self {
        Self {
            parameters: Some(parameters),
            ..self
        }
    }

    /// A frame with the parameters and the generated textures bound, and the work of the parameter stage for all of its
    /// draws, in full-rate scalar operations. What makes a texture works once and for all, so that it is not in it.
    pub(crate) fn bound<'f>(&self, frame: &'f Frame) -> (Cow<'f, Frame>, f64) {
        if self.parameters.is_none() && self.generated.is_empty() {
            return (Cow::Borrowed(frame), 0.0);
        }
        let mut frame = frame.clone();
        let mut work = 0.0;
        if let Some(parameters) = &self.parameters {
            let draws = frame.mesh.draws().len();
            work = parameters.bind(&mut frame.bindings, draws);
        }
        self.generated.bind(&mut frame.bindings, &frame.baked);
        (Cow::Owned(frame), work)
    }
}

/// The program of a shader's fragment stage, with probes.
pub(crate) fn fragment(shader: &Shader, probes: &[Handle<Expression>]) -> Result<Program, Refused> {
    // A shader always has a fragment stage.
    let entry = shader.index(Stage::Fragment).unwrap_or(0);
    Program::compile(shader.module(), entry, probes)
}

/// The program of its vertex stage, and its identity.
pub(crate) fn vertex(shader: &Shader) -> Result<Option<(Program, Option<Fingerprint>)>, Refused> {
    let Some(entry) = shader.index(Stage::Vertex) else {
        return Ok(None);
    };
    let program = Program::compile(shader.module(), entry, &[])?;
    // What reads parameters is not known by itself.
    let identity = match shader.parameter_block() {
        Some(_) => Some(shader.fingerprint()),
        None => shader.stage_fingerprint(Stage::Vertex),
    };
    Ok(Some((program, identity)))
}
