//! Pipelines of a shader in its scene, and pictures drawn with them.
//!
//! ```text
//! forward:   mesh --shader--> colour, coverage
//! deferred:  mesh --shader--> G-buffer, depth, coverage --lighting, where covered--> colour, coverage
//! blended:   see `blend`
//! ```

use super::adapter::Gpu;
use super::blend::Blended;
use super::entry::{Colour, Targets};
use super::pass::{COLOUR, COVERED, DEPTH, Drawing, Images, Pass, Views, free};
use super::resources::Uploads;
use crate::eval::draw::{Format, Plane};
use crate::eval::raster::Frame;
use crate::front::Source;
use crate::scene::{Scene, SceneLighting};
use crate::{Diagnostic, Result};
use lodc_passes::{Shader, Stage};
use naga::Module;
use std::collections::BTreeMap;
use wgpu::{TextureFormat, TextureUsages};

/// The two stages that a picture is drawn with: modules, and the places of their entry points.
#[derive(Clone, Copy, Debug)]
pub struct Stages<'a> {
    /// The vertex stage.
    pub vertex: (&'a Module, usize),
    /// The fragment stage.
    pub fragment: (&'a Module, usize),
    /// What the override constant `autoLOD` is, which the fragment stage's module declares then, and the vertex stage's may;
    /// unset, its default.
    pub auto_lod: Option<f64>,
}

impl<'a> Stages<'a> {
    /// A shader as it is written, with the vertex stage that the scene supplies where it has none.
    pub fn of_source(source: &'a Source, scene: &'a Scene) -> Option<Self> {
        let own = source.vertex_entry().map(|(at, _)| (&source.module, at));
        let supplied = scene.vertex_stage.as_ref().map(|s| (&s.module, 0));
        Some(Self {
            vertex: supplied.or(own)?,
            fragment: (&source.module, source.fragment_entry().0),
            auto_lod: None,
        })
    }

    /// The same of a shader in normal form.
    pub fn of_shader(shader: &'a Shader, scene: &'a Scene) -> Option<Self> {
        let stage = |stage| Some((shader.module(), shader.index(stage)?));
        let supplied = scene.vertex_stage.as_ref().map(|s| (&s.module, 0));
        Some(Self {
            vertex: supplied.or(stage(Stage::Vertex))?,
            fragment: stage(Stage::Fragment)?,
            auto_lod: None,
        })
    }
}

/// A shader in its scene, compiled for the device: draws any frame of that scene.
#[derive(Debug)]
pub struct Pipeline(Kind);

#[derive(Debug)]
enum Kind {
    Forward(Pass),
    Deferred {
        material: Pass,
        lighting: Pass,
        /// What the lighting reads.
        reads: BTreeMap<(u32, u32), Before>,
    },
    Blended(Blended),
}

/// A picture on the device, in fine pixels: width and height are those of the frame times its grid.
#[derive(Debug)]
pub struct Drawn {
    /// What the shader returned at location 0, or the lighting made of it, 0 where nothing is drawn: `rgba32uint`,
    /// which holds the bits of floats. In WGSL it is `bitcast<vec4f>(textureLoad(colour, at, 0))`.
    pub(super) colour: wgpu::Texture,
    /// 1 where something is drawn, else 0: `r32uint`.
    pub(super) covered: wgpu::Texture,
    /// Whether colours are premultiplied, with coverage: the scene blends.
    pub(super) blends: bool,
}

/// Draws frames on a device, and keeps what it uploaded for them.
#[derive(Debug)]
pub struct Renderer<'g> {
    pub(super) gpu: &'g Gpu,
    pub(super) uploads: Uploads,
}

/// What a lighting reads that the material drew.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Before {
    /// The colour at a place in the list of the material's.
    Colour(usize),
    Depth,
    Covered,
}

impl<'g> Renderer<'g> {
    /// A renderer that has uploaded nothing yet.
    pub fn new(gpu: &'g Gpu) -> Self {
        Self {
            gpu,
            uploads: Uploads::default(),
        }
    }

    /// The device that it draws on.
    pub fn gpu(&self) -> &'g Gpu {
        self.gpu
    }

    /// Compiles a shader for the frames of a scene, with the scene's lighting where it is deferred.
    ///
    /// # Errors
    /// When the device cannot draw it: the driver rejects it, it needs more bindings than there are, a target's
    /// format cannot be drawn to, or it reads what no scene can fill.
    pub fn pipeline(&self, stages: Stages<'_>, scene: &Scene) -> Result<Pipeline> {
        let what = "compiling the shader";
        self.gpu.guarded(what, || {
            Ok(Pipeline(match &scene.lighting {
                _ if scene.blends() => Kind::Blended(Blended::new(self.gpu, stages, scene)?),
                Some(lighting) => self.deferred(stages, lighting)?,
                None => Kind::Forward(Pass::new(self.gpu, stages, Drawing::forward())?),
            }))
        })
    }

    fn deferred(&self, stages: Stages<'_>, lighting: &SceneLighting) -> Result<Kind> {
        let material = self.material(lighting)?;
        let planes = planes(lighting);
        let light = Stages {
            vertex: lighting.vertex(),
            fragment: lighting.fragment(),
            auto_lod: None,
        };
        let covered = free(&light, 1);
        let mut reads = BTreeMap::from([(covered, (Before::Covered, COVERED))]);
        reads.extend(lighting.reads().iter().filter_map(|(at, plane)| {
            let read = match plane {
                Plane::Depth => (Before::Depth, DEPTH),
                Plane::Target(location, _) => {
                    let colour = planes.iter().position(|(l, _)| l == location)?;
                    (Before::Colour(colour), material.formats[colour])
                }
            };
            Some((*at, read))
        }));
        let mut lit = Drawing::forward();
        lit.targets.only_where = Some(covered);
        lit.reads = reads
            .iter()
            .map(|(at, (_, format))| (*at, *format))
            .collect();
        lit.depth = None;
        Ok(Kind::Deferred {
            material: Pass::new(self.gpu, stages, material)?,
            lighting: Pass::new(self.gpu, light, lit)?,
            reads: reads
                .into_iter()
                .map(|(at, (before, _))| (at, before))
                .collect(),
        })
    }

    /// What a deferred material draws to: the colours that the lighting reads.
    ///
    /// # Errors
    /// When the device cannot draw to a target's format.
    pub(super) fn material(&self, lighting: &SceneLighting) -> Result<Drawing> {
        let planes = planes(lighting);
        let colours = planes.iter().map(|(location, format)| Colour {
            location: *location,
            kind: Some(format.kind()),
        });
        let formats = planes.iter().map(|(_, format)| self.target(*format));
        Ok(Drawing {
            targets: Targets {
                colours: colours.collect(),
                ..Targets::default()
            },
            formats: formats.collect::<Result<_>>()?,
            ..Drawing::forward()
        })
    }

    /// Draws a frame of the scene that the pipeline was made for, at its offset and grid.
    ///
    /// # Errors
    /// When the device cannot: its memory is full, it was lost, or the frame lacks what the shader reads.
    pub fn draw(&mut self, pipeline: &Pipeline, scene: &Scene, frame: &Frame) -> Result<Drawn> {
        let Self { gpu, uploads } = self;
        gpu.guarded("drawing", || {
            let material = match &pipeline.0 {
                Kind::Blended(blended) => return blended.draw(gpu, uploads, frame, scene.output),
                Kind::Forward(material) | Kind::Deferred { material, .. } => material,
            };
            let mut encoder = gpu.device().create_command_encoder(&Default::default());
            let mut images = material.images(gpu, frame);
            let opaque = (frame, false);
            material.draw((gpu, uploads), opaque, &Views::new(), &images, &mut encoder)?;
            if let Kind::Deferred {
                lighting, reads, ..
            } = &pipeline.0
            {
                let screen = scene
                    .lighting_frame(frame)
                    .ok_or_else(|| Diagnostic::error("a scene is drawn with its own pipelines"))?;
                let views = reads
                    .iter()
                    .filter_map(|(at, read)| Some((*at, read.of(&images)?)));
                let views: Views = views.collect();
                let lit = lighting.images(gpu, &screen);
                let opaque = (&screen, false);
                lighting.draw((gpu, uploads), opaque, &views, &lit, &mut encoder)?;
                images = lit;
            }
            gpu.queue().submit([encoder.finish()]);
            let [colour] = <[wgpu::Texture; 1]>::try_from(images.colours).map_err(|_| {
                Diagnostic::error("a scene with lighting is drawn with its own pipelines")
            })?;
            Ok(Drawn {
                colour,
                covered: images.covered,
                blends: false,
            })
        })
    }

    /// A target's format on this device.
    fn target(&self, format: Format) -> Result<TextureFormat> {
        let name = format.name();
        let found = FORMATS.iter().find(|(known, _)| *known == name);
        let usages = TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING;
        found
            .map(|(_, format)| *format)
            .filter(|format| self.gpu.allows(*format, usages))
            .ok_or_else(|| {
                Diagnostic::error(format!(
                    "`{}` cannot draw to the format `{name}`",
                    self.gpu.label()
                ))
                .with_note("the evaluator can; or give the target another format in `[targets]`")
            })
    }
}

impl Drawing {
    /// The colour at location 0, with its depth.
    pub(super) fn forward() -> Self {
        Self {
            targets: Targets {
                colours: vec![Colour {
                    location: 0,
                    kind: None,
                }],
                ..Targets::default()
            },
            formats: vec![COLOUR],
            depth: Some(wgpu::CompareFunction::Less),
            ..Self::default()
        }
    }
}

impl Before {
    fn of(self, images: &Images) -> Option<wgpu::TextureView> {
        let texture = match self {
            Self::Colour(at) => images.colours.get(at)?,
            Self::Depth => images.depth.as_ref()?,
            Self::Covered => &images.covered,
        };
        Some(texture.create_view(&Default::default()))
    }
}

/// The colours of a material that a lighting reads, by location.
fn planes(lighting: &SceneLighting) -> Vec<(u32, Format)> {
    let planes = lighting
        .reads()
        .iter()
        .filter_map(|(_, plane)| match plane {
            Plane::Target(location, format) => Some((*location, *format)),
            Plane::Depth => None,
        });
    let planes: BTreeMap<u32, Format> = planes.collect();
    planes.into_iter().collect()
}

/// The formats of targets, by WebGPU's names.
const FORMATS: [(&str, TextureFormat); 35] = [
    ("r8unorm", TextureFormat::R8Unorm),
    ("r8snorm", TextureFormat::R8Snorm),
    ("r8uint", TextureFormat::R8Uint),
    ("r8sint", TextureFormat::R8Sint),
    ("r16unorm", TextureFormat::R16Unorm),
    ("r16snorm", TextureFormat::R16Snorm),
    ("r16uint", TextureFormat::R16Uint),
    ("r16sint", TextureFormat::R16Sint),
    ("r16float", TextureFormat::R16Float),
    ("rg8unorm", TextureFormat::Rg8Unorm),
    ("rg8snorm", TextureFormat::Rg8Snorm),
    ("rg8uint", TextureFormat::Rg8Uint),
    ("rg8sint", TextureFormat::Rg8Sint),
    ("r32float", TextureFormat::R32Float),
    ("rg16unorm", TextureFormat::Rg16Unorm),
    ("rg16snorm", TextureFormat::Rg16Snorm),
    ("rg16uint", TextureFormat::Rg16Uint),
    ("rg16sint", TextureFormat::Rg16Sint),
    ("rg16float", TextureFormat::Rg16Float),
    ("rgba8unorm", TextureFormat::Rgba8Unorm),
    ("rgba8unorm-srgb", TextureFormat::Rgba8UnormSrgb),
    ("rgba8snorm", TextureFormat::Rgba8Snorm),
    ("rgba8uint", TextureFormat::Rgba8Uint),
    ("rgba8sint", TextureFormat::Rgba8Sint),
    ("bgra8unorm", TextureFormat::Bgra8Unorm),
    ("bgra8unorm-srgb", TextureFormat::Bgra8UnormSrgb),
    ("rgb10a2unorm", TextureFormat::Rgb10a2Unorm),
    ("rg11b10ufloat", TextureFormat::Rg11b10Ufloat),
    ("rg32float", TextureFormat::Rg32Float),
    ("rgba16unorm", TextureFormat::Rgba16Unorm),
    ("rgba16snorm", TextureFormat::Rgba16Snorm),
    ("rgba16uint", TextureFormat::Rgba16Uint),
    ("rgba16sint", TextureFormat::Rgba16Sint),
    ("rgba16float", TextureFormat::Rgba16Float),
    ("rgba32float", TextureFormat::Rgba32Float),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_format_of_a_scene_is_one_of_the_device() {
        let known: Vec<&str> = FORMATS.iter().map(|(name, _)| *name).collect();
        assert_eq!(known, Format::names().collect::<Vec<_>>());
    }
}
