//! Pipelines of a shader in its scene, and pictures drawn with them.
//!
//! ```text
//! forward:   mesh --shader--> colour, coverage
//! deferred:  mesh --shader--> G-buffer, depth, coverage --lighting, where covered--> colour, coverage
//! ```

use super::adapter::Gpu;
use super::entry::{self, Colour, Place, Targets};
use super::resources::{self, Bound, Slot, Slots, Uploads};
use super::vertices::Layout;
use super::{lavapipe, opengl};
use crate::emit::control::pipeline_constant;
use crate::eval::draw::{Blend, Format, Plane};
use crate::eval::raster::Frame;
use crate::front::Source;
use crate::scene::{Scene, SceneLighting};
use crate::{Diagnostic, Result};
use lodc_passes::{Shader, Stage};
use naga::Module;
use naga::back::PipelineConstants;
use naga::back::pipeline_constants::process_overrides;
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use std::borrow::Cow;
use std::collections::BTreeMap;
use wgpu::{BufferBindingType, ShaderStages, TextureFormat, TextureUsages};

/// The format of colours: the bits of four floats, so that nothing is rounded away, on any device.
pub(super) const COLOUR: TextureFormat = TextureFormat::Rgba32Uint;
/// The format of coverage: 1 where something is drawn, else 0.
pub(super) const COVERED: TextureFormat = TextureFormat::R32Uint;
const DEPTH: TextureFormat = TextureFormat::Depth32Float;

/// The two stages that a picture is drawn with: modules, and the places of their entry points.
#[derive(Clone, Copy, Debug)]
pub struct Stages<'a> {
    /// The vertex stage.
    pub vertex: (&'a Module, usize),
    /// The fragment stage.
    pub fragment: (&'a Module, usize),
    /// What the override constant `autoLOD` is, where the fragment stage's module declares it; unset, its default.
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
pub struct Pipeline {
    material: Pass,
    lighting: Option<Pass>,
}

/// A picture on the device, in fine pixels: width and height are those of the frame times its grid.
#[derive(Debug)]
pub struct Drawn {
    /// What the shader returned at location 0, or the lighting made of it, 0 where nothing is drawn: `rgba32uint`,
    /// which holds the bits of floats. In WGSL it is `bitcast<vec4f>(textureLoad(colour, at, 0))`.
    pub(super) colour: wgpu::Texture,
    /// 1 where something is drawn, else 0: `r32uint`.
    pub(super) covered: wgpu::Texture,
}

/// Draws frames on a device, and keeps what it uploaded for them.
#[derive(Debug)]
pub struct Renderer<'g> {
    gpu: &'g Gpu,
    uploads: Uploads,
}

/// A pipeline of its own: the material's, or the lighting's.
#[derive(Debug)]
struct Pass {
    pipeline: wgpu::RenderPipeline,
    slots: Slots,
    groups: Vec<Option<wgpu::BindGroupLayout>>,
    /// Where the frame's place is bound.
    place: (u32, u32),
    layout: Layout,
    /// The formats that it draws to, in order; the coverage's behind them.
    formats: Vec<TextureFormat>,
    /// What it reads that was drawn before.
    reads: BTreeMap<(u32, u32), Before>,
    depth: bool,
}

/// What a lighting reads that the material drew.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Before {
    /// The colour at a place in the list of the material's.
    Colour(usize),
    Depth,
    Covered,
}

/// What a pass draws to.
struct Images {
    colours: Vec<wgpu::Texture>,
    covered: wgpu::Texture,
    depth: Option<wgpu::Texture>,
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
    /// When the scene blends, or the device cannot draw it: the driver rejects it, it needs more bindings than there are, a target's
    /// format cannot be drawn to, or it reads what no scene can fill.
    pub fn pipeline(&self, stages: Stages<'_>, scene: &Scene) -> Result<Pipeline> {
        let mut states = scene.states.iter();
        if states.any(|state| state.blend != Blend::Opaque) {
            return Err(Diagnostic::error("blended surfaces are not drawn on a GPU")
                .with_note("the evaluator draws them; or say `blend = \"opaque\"` in the scene"));
        }
        let what = "compiling the shader";
        self.gpu.guarded(what, || {
            let Some(lighting) = &scene.lighting else {
                let targets = Targets {
                    colours: vec![Colour {
                        location: 0,
                        kind: None,
                    }],
                    only_where: None,
                };
                let formats = vec![COLOUR];
                return Ok(Pipeline {
                    material: Pass::new(self.gpu, stages, targets, formats, &[], true)?,
                    lighting: None,
                });
            };
            let planes = planes(lighting);
            let colours = planes.iter().map(|(location, format)| Colour {
                location: *location,
                kind: Some(format.kind()),
            });
            let targets = Targets {
                colours: colours.collect(),
                only_where: None,
            };
            let formats = planes.iter().map(|(_, format)| self.target(*format));
            let formats: Vec<TextureFormat> = formats.collect::<Result<_>>()?;
            let reads: Vec<((u32, u32), Before, TextureFormat)> = lighting
                .reads()
                .iter()
                .filter_map(|(at, plane)| {
                    let (before, format) = match plane {
                        Plane::Depth => (Before::Depth, DEPTH),
                        Plane::Target(location, _) => {
                            let colour = planes.iter().position(|(l, _)| l == location)?;
                            (Before::Colour(colour), formats[colour])
                        }
                    };
                    Some((*at, before, format))
                })
                .collect();
            let light = Stages {
                vertex: lighting.vertex(),
                fragment: lighting.fragment(),
                auto_lod: None,
            };
            let lit = Targets {
                colours: vec![Colour {
                    location: 0,
                    kind: None,
                }],
                only_where: Some(free(&light, 1)),
            };
            Ok(Pipeline {
                material: Pass::new(self.gpu, stages, targets, formats, &[], true)?,
                lighting: Some(Pass::new(
                    self.gpu,
                    light,
                    lit,
                    vec![COLOUR],
                    &reads,
                    false,
                )?),
            })
        })
    }

    /// Draws a frame of the scene that the pipeline was made for, at its offset and grid.
    ///
    /// # Errors
    /// When the device cannot: its memory is full, it was lost, or the frame lacks what the shader reads.
    pub fn draw(&mut self, pipeline: &Pipeline, scene: &Scene, frame: &Frame) -> Result<Drawn> {
        let Self { gpu, uploads } = self;
        gpu.guarded("drawing", || {
            let mut encoder = gpu.device().create_command_encoder(&Default::default());
            let drawn = pipeline
                .material
                .draw(gpu, uploads, frame, None, &mut encoder)?;
            let drawn = match (&pipeline.lighting, scene.lighting_frame(frame)) {
                (Some(lighting), Some(screen)) => {
                    lighting.draw(gpu, uploads, &screen, Some(&drawn), &mut encoder)?
                }
                _ => drawn,
            };
            gpu.queue().submit([encoder.finish()]);
            let [colour] = <[wgpu::Texture; 1]>::try_from(drawn.colours).map_err(|_| {
                Diagnostic::error("a scene with lighting is drawn with its own pipelines")
            })?;
            Ok(Drawn {
                colour,
                covered: drawn.covered,
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

/// A binding of group 0 that neither stage declares: the `nth` of those.
fn free(stages: &Stages<'_>, nth: u32) -> (u32, u32) {
    let modules = [stages.vertex.0, stages.fragment.0];
    let globals = modules.iter().flat_map(|m| m.global_variables.iter());
    let taken = globals.filter_map(|(_, global)| {
        let at = global.binding.as_ref()?;
        (at.group == 0).then_some(at.binding + 1)
    });
    (0, taken.max().unwrap_or(0) + nth)
}

impl Pass {
    fn new(
        gpu: &Gpu,
        stages: Stages<'_>,
        targets: Targets,
        formats: Vec<TextureFormat>,
        reads: &[((u32, u32), Before, TextureFormat)],
        depth: bool,
    ) -> Result<Self> {
        let place = free(&stages, 0);
        let (module, at) = stages.vertex;
        let (module, at) = settled(gpu, (module, at), None, place)?;
        let layout = Layout::new(&module, at)?;
        let vertex = entry::vertex(&module, at, place);
        let (module, at) = stages.fragment;
        let (module, at) = settled(gpu, (module, at), stages.auto_lod, place)?;
        let fragment = entry::fragment(&module, at, place, &targets);

        let mut of_reads: BTreeMap<(u32, u32), TextureFormat> =
            reads.iter().map(|(at, _, format)| (*at, *format)).collect();
        let mut before: BTreeMap<(u32, u32), Before> =
            reads.iter().map(|(at, before, _)| (*at, *before)).collect();
        if let Some(at) = targets.only_where {
            of_reads.insert(at, COVERED);
            before.insert(at, Before::Covered);
        }
        let mut slots = Slots::default();
        for (module, stage) in [
            (&vertex, ShaderStages::VERTEX),
            (&fragment, ShaderStages::FRAGMENT),
        ] {
            slots.add(gpu, module, &validated(module)?, stage, &of_reads)?;
        }
        let groups = slots.layouts(gpu);
        let device = gpu.device();
        let bind_group_layouts: Vec<_> = groups.iter().map(Option::as_ref).collect();
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &bind_group_layouts,
            immediate_size: 0,
        });
        let compiled = [vertex, fragment].map(|module| {
            device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: None,
                source: wgpu::ShaderSource::Naga(Cow::Owned(module)),
            })
        });
        let attributes = layout.attributes();
        let buffers = [Some(wgpu::VertexBufferLayout {
            array_stride: layout.stride(),
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &attributes,
        })];
        let targets: Vec<Option<wgpu::ColorTargetState>> = formats
            .iter()
            .chain([&COVERED])
            .map(|format| Some((*format).into()))
            .collect();
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: None,
            layout: Some(&pipeline_layout),
            vertex: wgpu::VertexState {
                module: &compiled[0],
                entry_point: Some(entry::NAME),
                compilation_options: Default::default(),
                buffers: match layout.stride() {
                    0 => &[],
                    _ => &buffers,
                },
            },
            primitive: Default::default(),
            depth_stencil: depth.then(|| wgpu::DepthStencilState {
                format: DEPTH,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Less),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &compiled[1],
                entry_point: Some(entry::NAME),
                compilation_options: Default::default(),
                targets: &targets,
            }),
            multiview_mask: None,
            cache: None,
        });
        Ok(Self {
            pipeline,
            slots,
            groups,
            place,
            layout,
            formats,
            reads: before,
            depth,
        })
    }

    /// Draws a frame to new images. `before` is what was drawn that this pass reads.
    fn draw(
        &self,
        gpu: &Gpu,
        uploads: &mut Uploads,
        frame: &Frame,
        before: Option<&Images>,
        encoder: &mut wgpu::CommandEncoder,
    ) -> Result<Images> {
        let mesh = uploads.mesh(gpu, frame, &self.layout);
        let place = Place::new([frame.width, frame.height], frame.offset, frame.grid);
        let place = resources::buffer(gpu, &place.bytes(), BufferBindingType::Uniform);
        let draws = frame.mesh.draws();
        let mut bound = Vec::new();
        for draw in 0..draws.len() {
            let bind = |at: (u32, u32), slot: &Slot| match self.reads.get(&at) {
                _ if at == self.place => Ok(Bound::Buffer(place.clone())),
                Some(read) => before
                    .and_then(|before| before.view(*read))
                    .ok_or_else(|| Diagnostic::error("nothing was drawn before the lighting")),
                None => uploads.bound(gpu, frame, draw, at, slot),
            };
            bound.push(self.bind_groups(gpu, bind)?);
        }
        let images = self.images(gpu, frame);
        let view = |texture: &wgpu::Texture| texture.create_view(&Default::default());
        let colours = images.colours.iter().chain([&images.covered]);
        let colours: Vec<wgpu::TextureView> = colours.map(view).collect();
        let attachments: Vec<_> = colours
            .iter()
            .map(|view| {
                Some(wgpu::RenderPassColorAttachment {
                    view,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                        store: wgpu::StoreOp::Store,
                    },
                })
            })
            .collect();
        let depth = images.depth.as_ref().map(view);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: None,
            color_attachments: &attachments,
            depth_stencil_attachment: depth.as_ref().map(|view| {
                wgpu::RenderPassDepthStencilAttachment {
                    view,
                    depth_ops: Some(wgpu::Operations {
                        load: wgpu::LoadOp::Clear(1.0),
                        store: wgpu::StoreOp::Store,
                    }),
                    stencil_ops: None,
                }
            }),
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_index_buffer(mesh.indices.slice(..), wgpu::IndexFormat::Uint32);
        for (draw, groups) in draws.iter().zip(&bound) {
            if let Some(vertices) = &mesh.vertices {
                let [first, end] = [draw.vertices.start, draw.vertices.end]
                    .map(|vertex| vertex as u64 * self.layout.stride());
                pass.set_vertex_buffer(0, vertices.slice(first..end));
            }
            for (group, bound) in (0..).zip(groups) {
                if let Some(bound) = bound {
                    pass.set_bind_group(group, bound, &[]);
                }
            }
            let [first, end] =
                [draw.triangles.start, draw.triangles.end].map(|triangle| 3 * triangle as u32);
            pass.draw_indexed(first..end, 0, 0..1);
        }
        drop(pass);
        Ok(images)
    }

    fn bind_groups(
        &self,
        gpu: &Gpu,
        mut bind: impl FnMut((u32, u32), &Slot) -> Result<Bound>,
    ) -> Result<Vec<Option<wgpu::BindGroup>>> {
        let mut groups = Vec::new();
        for (group, layout) in (0..).zip(&self.groups) {
            let Some(layout) = layout else {
                groups.push(None);
                continue;
            };
            let mut bound = Vec::new();
            for (binding, slot) in self.slots.of_group(group) {
                bound.push((binding, bind((group, binding), slot)?));
            }
            let entries: Vec<wgpu::BindGroupEntry<'_>> = bound
                .iter()
                .map(|(binding, bound)| wgpu::BindGroupEntry {
                    binding: *binding,
                    resource: bound.resource(),
                })
                .collect();
            groups.push(Some(gpu.device().create_bind_group(
                &wgpu::BindGroupDescriptor {
                    label: None,
                    layout,
                    entries: &entries,
                },
            )));
        }
        Ok(groups)
    }

    /// The images of a frame, to be drawn to.
    fn images(&self, gpu: &Gpu, frame: &Frame) -> Images {
        let image = |format: TextureFormat, usage: TextureUsages| {
            gpu.device().create_texture(&wgpu::TextureDescriptor {
                label: None,
                size: wgpu::Extent3d {
                    width: frame.width * frame.grid,
                    height: frame.height * frame.grid,
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING | usage,
                view_formats: &[],
            })
        };
        let colour = |format: &TextureFormat| match *format {
            COLOUR => image(COLOUR, TextureUsages::COPY_SRC),
            other => image(other, TextureUsages::empty()),
        };
        Images {
            colours: self.formats.iter().map(colour).collect(),
            covered: image(COVERED, TextureUsages::COPY_SRC),
            depth: self.depth.then(|| image(DEPTH, TextureUsages::empty())),
        }
    }
}

impl Images {
    /// What a later pass reads.
    fn view(&self, read: Before) -> Option<Bound> {
        let texture = match read {
            Before::Colour(at) => self.colours.get(at)?,
            Before::Depth => self.depth.as_ref()?,
            Before::Covered => &self.covered,
        };
        Some(Bound::Texture(texture.create_view(&Default::default())))
    }
}

/// The module as the device takes it, with its override constants settled, and the place of the entry point in it.
fn settled(
    gpu: &Gpu,
    (module, at): (&Module, usize),
    auto_lod: Option<f64>,
    place: (u32, u32),
) -> Result<(Module, usize)> {
    let (mut module, at) = without_overrides(module, at, auto_lod)?;
    if gpu.is_opengl() {
        opengl::load_depths(&mut module);
    }
    if gpu.inlines_uniforms() {
        lavapipe::hide_uniforms(&mut module, place);
    }
    Ok((module, at))
}

fn without_overrides(module: &Module, at: usize, auto_lod: Option<f64>) -> Result<(Module, usize)> {
    if module.overrides.is_empty() && auto_lod.is_none() {
        return Ok((module.clone(), at));
    }
    let entry = &module.entry_points[at];
    let (stage, name) = (entry.stage, &*entry.name);
    let mut constants = PipelineConstants::default();
    if let Some(value) = auto_lod {
        let (_, key) = pipeline_constant(module).ok_or_else(|| {
            Diagnostic::error("the shader has no override constant `autoLOD`")
                .with_note("`--form override` writes one")
        })?;
        constants.insert(key, value);
    }
    let info = validated(module)?;
    let settled = process_overrides(module, &info, Some((stage, name)), &constants);
    let (settled, _) = settled.map_err(|error| {
        Diagnostic::error("an override constant of the shader has no value")
            .with_reason(error)
            .with_note("give it a default in the shader")
    })?;
    let mut entries = settled.entry_points.iter();
    let found = entries.position(|entry| entry.stage == stage && entry.name == name);
    let found = found.ok_or_else(|| Diagnostic::error(format!("the shader has no `{name}`")))?;
    Ok((settled.into_owned(), found))
}

fn validated(module: &Module) -> Result<ModuleInfo> {
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::all());
    validator.validate(module).map_err(|error| {
        Diagnostic::error("a shader cannot be drawn as it is")
            .with_reason(error.emit_to_string(""))
            .with_note("this is a bug in lodc; the evaluator draws it")
    })
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
