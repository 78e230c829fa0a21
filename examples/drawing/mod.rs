//! What a renderer does with what lodc emits; `offscreen` and `viewer` draw with it.
//!
//! ```text
//! shader + lock --Material::replay--> text with all levels, thresholds, rho0
//! text --resources--> what it binds: layouts of the groups, buffers, textures, samplers; the vertex buffers
//! text x level --Renderer--> a pipeline with the constant `autoLOD`
//! distance --Material::level--> the level to draw
//! ```
//!
//! The scene stands for the engine here: it has the mesh, the camera's matrices, the uniforms and the textures.

mod renderer;
mod resources;

pub(crate) use renderer::{Renderer, instance, open};

use lodc::compile::{self, Request};
use lodc::emit::{Form, Lock, Target, Transition};
use lodc::eval::raster::Frame;
use lodc::front::Source;
use lodc::scene::{Draw, Output, Scene};
use lodc_passes::autolod::{self, HYSTERESIS, View};
use std::error::Error;
use std::path::{Path, PathBuf};

/// What goes wrong is printed.
pub(crate) type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// A shader with its levels, and all that is drawn with it.
pub(crate) struct Material {
    /// The emitted shader, as a host would load it: WGSL with `override autoLOD`.
    pub(crate) source: Source,
    /// The author's shader.
    pub(crate) original: Source,
    /// Mesh, camera, uniforms, textures.
    pub(crate) scene: Scene,
    /// The autoLOD from which each level is used, level 1 first.
    pub(crate) thresholds: Vec<f64>,
    /// Of each level, the original first, its error and the original's where it begins, as the search measured them.
    pub(crate) errors: Vec<[f64; 2]>,
    /// Pixels per object unit where autoLOD is 0.
    pub(crate) rho0: f64,
}

impl Material {
    /// Makes the levels from the lock; by default the one beside the shader. Nothing is searched.
    ///
    /// # Errors
    /// When the shader, its lock or its scene cannot be read, or the lock is stale.
    pub(crate) fn replay(shader: &Path, lock: Option<&Path>) -> Result<Self> {
        let request = Request {
            shader: shader.to_owned(),
            lock: lock.map(PathBuf::from),
            // One text for all levels, of which each becomes a pipeline of its own.
            form: Some(Form::Override),
            target: Some(Target::Wgsl),
            transition: Some(Transition::Pop),
            ..Request::default()
        };
        let made = compile::remade(&request)?;
        for warning in &made.warnings {
            eprintln!("{warning}");
        }
        let is_shader = |name: &Path| name.to_string_lossy().ends_with(".lod.wgsl");
        let emitted = made.files.into_iter().find(|(name, _)| is_shader(name));
        let (name, bytes) = emitted.ok_or("no shader was emitted")?;
        let source = Source::parse(&name.to_string_lossy(), &String::from_utf8(bytes)?)?;

        let lock = request.committed_lock();
        let (locked, _) = Lock::read(&lock)?;
        let original = Source::read(shader)?;
        let scene = locked.scene.map(|scene| lock.with_file_name(scene.file));
        let scene = Scene::read(&original, scene.as_deref())?;
        if scene.lighting.is_some() || scene.blends() || scene.mesh.draws().len() > 1 {
            return Err("this example draws opaque meshes of one material, forward".into());
        }
        if let Output::Linear { .. } = scene.output {
            return Err("this example does no tone mapping".into());
        }
        let levels = locked.levels.iter();
        Ok(Self {
            thresholds: levels.clone().map(|l| f64::from(l.autolod)).collect(),
            errors: std::iter::once([0.0; 2])
                .chain(levels.map(|l| [l.error, l.floor]))
                .collect(),
            rho0: locked.rho0,
            source,
            original,
            scene,
        })
    }

    /// How many levels there are, with the original.
    pub(crate) fn levels(&self) -> usize {
        self.thresholds.len() + 1
    }

    /// autoLOD, in pictures so many pixels high, from so far from the centre of the object's bounding sphere.
    pub(crate) fn auto_lod(&self, distance: f64, height: u32) -> f64 {
        let view = View {
            height: f64::from(height),
            ..self.scene.view(distance)
        };
        autolod::auto_lod(self.rho0, autolod::rho(&view))
    }

    /// The level to draw at an autoLOD. It is left only when autoLOD is clearly beyond a threshold, so that an object at that
    /// distance does not flicker: `before` is what was drawn in the last frame.
    pub(crate) fn level(&self, auto_lod: f64, before: Option<usize>) -> usize {
        autolod::level(&self.thresholds, auto_lod, before, HYSTERESIS)
    }

    /// What the pipeline constant `autoLOD` is for a level: the middle of its interval.
    pub(crate) fn constant(&self, level: usize) -> f64 {
        autolod::middle(&self.thresholds, level)
    }

    /// A distance at which a level is drawn: where autoLOD is in the middle of its interval, in pictures so many pixels high.
    pub(crate) fn distance(&self, level: usize, height: u32) -> f64 {
        let view = View {
            height: f64::from(height),
            ..self.scene.view(self.scene.nearest)
        };
        autolod::distance_of(self.constant(level), self.rho0, &view)
    }

    /// Everything that a draw reads, seen from a direction and a distance.
    pub(crate) fn frame(&self, direction: glam::DVec3, distance: f64) -> Frame {
        self.scene.frame(direction, distance, Draw::Listed(0))
    }
}
