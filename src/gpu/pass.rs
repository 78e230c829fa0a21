//! A pipeline of its own, the material's or the lighting's, and pictures drawn with it.

use super::adapter::Gpu;
use super::entry::{self, Place, Targets};
use super::render::Stages;
use super::resources::{self, Bound, Buffers, Slot, Slots, Uploads};
use super::vertices::Layout;
use super::{blend, lavapipe, opengl};
use crate::emit::control::{in_buffer, pipeline_constant};
use crate::eval::draw::{Blend, DrawState, state_of};
use crate::eval::raster::Frame;
use crate::{Diagnostic, Result};
use naga::Module;
use naga::back::PipelineConstants;
use naga::back::pipeline_constants::process_overrides;
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ops::Range;
use wgpu::{BufferBindingType, CompareFunction, ShaderStages, TextureFormat, TextureUsages};

/// The format of colours: the bits of four floats, so that nothing is rounded away, on any device.
pub(super) const COLOUR: TextureFormat = TextureFormat::Rgba32Uint;
/// The format of coverage: 1 where something is drawn, else 0.
pub(super) const COVERED: TextureFormat = TextureFormat::R32Uint;
/// The format of depths, 0 near to 1 far.
pub(super) const DEPTH: TextureFormat = TextureFormat::Depth32Float;

/// A shader with what it draws to, compiled.
#[derive(Debug)]
pub(super) struct Pass {
    /// One for each way in which a draw gets to the targets.
    pipelines: Vec<(DrawState, wgpu::RenderPipeline)>,
    bare: bool,
    slots: Slots,
    groups: Vec<Option<wgpu::BindGroupLayout>>,
    /// Where the frame's place is bound.
    place: (u32, u32),
    /// Where autoLOD is in a buffer, and what it is.
    auto_lod: Option<(InBuffer, f32)>,
    layout: Layout,
    /// The formats that it draws to, in order; the coverage's behind them.
    formats: Vec<TextureFormat>,
    depth: bool,
}

/// What a pass draws to, and what it reads that was drawn before.
#[derive(Clone, Debug, Default)]
pub(super) struct Drawing {
    pub(super) targets: Targets,
    /// The formats of its colours, in order.
    pub(super) formats: Vec<TextureFormat>,
    /// The formats of the images that it reads.
    pub(super) reads: BTreeMap<(u32, u32), TextureFormat>,
    /// Which fragments hide which; `None` without a depth.
    pub(super) depth: Option<CompareFunction>,
    /// Whether some of its draws are without their back faces.
    pub(super) fronts: bool,
    /// As an engine draws it: the shader's own entry points, whose colours alone are drawn, at their own locations, and
    /// draws of these states, blended by the device.
    pub(super) bare: Option<Vec<DrawState>>,
}

/// The buffer that holds a number, by group and binding, and the place there, in bytes.
type InBuffer = ((u32, u32), u32);

/// What a pass reads of a frame, ready to be drawn as often as wanted.
#[derive(Debug)]
pub(super) struct Ready {
    mesh: Buffers,
    draws: Vec<ReadyDraw>,
}

#[derive(Debug)]
struct ReadyDraw {
    state: DrawState,
    groups: Vec<Option<wgpu::BindGroup>>,
    /// In bytes.
    vertices: Range<u64>,
    indices: Range<u32>,
}

/// The images that it reads, by group and binding.
pub(super) type Views = BTreeMap<(u32, u32), wgpu::TextureView>;

/// What a pass draws to.
#[derive(Debug)]
pub(super) struct Images {
    pub(super) colours: Vec<wgpu::Texture>,
    pub(super) covered: wgpu::Texture,
    pub(super) depth: Option<wgpu::Texture>,
}

/// A binding of group 0 that neither stage declares: the `nth` of those.
pub(super) fn free(stages: &Stages<'_>, nth: u32) -> (u32, u32) {
    let modules = [stages.vertex.0, stages.fragment.0];
    let globals = modules.iter().flat_map(|m| m.global_variables.iter());
    let taken = globals.filter_map(|(_, global)| {
        let at = global.binding.as_ref()?;
        (at.group == 0).then_some(at.binding + 1)
    });
    (0, taken.max().unwrap_or(0) + nth)
}

impl Drawing {
    /// The formats of what is drawn bare, by location.
    pub(super) fn formats_by_location(&self) -> Vec<Option<TextureFormat>> {
        let targets = self.states_of_targets().into_iter();
        targets.map(|target| Some(target?.format)).collect()
    }

    /// The targets, by location.
    fn states_of_targets(&self) -> Vec<Option<wgpu::ColorTargetState>> {
        let formats = self.formats.iter().map(|format| Some((*format).into()));
        if self.bare.is_none() {
            return formats.chain([Some(COVERED.into())]).collect();
        }
        let mut targets = Vec::new();
        for (colour, format) in self.targets.colours.iter().zip(formats) {
            let at = colour.location as usize;
            targets.resize(targets.len().max(at + 1), None);
            targets[at] = format;
        }
        targets
    }
}

impl Pass {
    /// Compiles a shader.
    ///
    /// # Errors
    /// When the device cannot draw it.
    pub(super) fn new(gpu: &Gpu, stages: Stages<'_>, drawing: Drawing) -> Result<Self> {
        let place = free(&stages, 0);
        let bare = drawing.bare.is_some();
        let in_buffer = [stages.fragment.0, stages.vertex.0]
            .into_iter()
            .find_map(in_buffer)
            .filter(|_| bare);
        let (module, at) = stages.vertex;
        let auto_lod = (stages.auto_lod).filter(|_| pipeline_constant(module).is_some());
        let (module, at) = settled(gpu, (module, at), auto_lod, place)?;
        let layout = Layout::new(&module, at)?;
        let vertex = match bare {
            true => entry::alone(&module, at),
            false => entry::vertex(&module, at, place),
        };
        let (module, at) = stages.fragment;
        let auto_lod = (stages.auto_lod).filter(|_| in_buffer.is_none());
        let (module, at) = settled(gpu, (module, at), auto_lod, place)?;
        let fragment = match bare {
            true => entry::bare(&module, at, place, &drawing.targets),
            false => entry::fragment(&module, at, place, &drawing.targets),
        };

        let mut slots = Slots::default();
        for (module, stage) in [
            (&vertex, ShaderStages::VERTEX),
            (&fragment, ShaderStages::FRAGMENT),
        ] {
            slots.add(gpu, module, &validated(module)?, stage, &drawing.reads)?;
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
        let targets = drawing.states_of_targets();
        let descriptor = wgpu::RenderPipelineDescriptor {
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
            depth_stencil: drawing.depth.map(|compare| wgpu::DepthStencilState {
                format: DEPTH,
                depth_write_enabled: Some(true),
                depth_compare: Some(compare),
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
        };
        let opaque = |front_only| DrawState {
            blend: Blend::Opaque,
            front_only,
        };
        let states = match &drawing.bare {
            Some(states) => states.clone(),
            None if drawing.fronts => vec![opaque(false), opaque(true)],
            None => vec![opaque(false)],
        };
        let pipelines = states.into_iter().map(|state| {
            let mut descriptor = descriptor.clone();
            let mut targets = targets.clone();
            if state.front_only {
                descriptor.primitive.cull_mode = Some(wgpu::Face::Back);
            }
            if state.blend != Blend::Opaque {
                if let Some(Some(first)) = targets.first_mut() {
                    first.blend = blend::by_device(state.blend);
                }
                if let Some(depth) = &mut descriptor.depth_stencil {
                    depth.depth_write_enabled = Some(false);
                }
            }
            if let Some(fragment) = &mut descriptor.fragment {
                fragment.targets = &targets;
            }
            (state, device.create_render_pipeline(&descriptor))
        });
        Ok(Self {
            pipelines: pipelines.collect(),
            bare,
            slots,
            groups,
            place,
            auto_lod: in_buffer.zip(stages.auto_lod.map(|value| value as f32)),
            layout,
            depth: drawing.depth.is_some(),
            formats: drawing.formats,
        })
    }

    /// Draws those of a frame's draws that are blended, or those that are not, to images that are cleared before. `before`
    /// is what was drawn that this pass reads.
    ///
    /// # Errors
    /// When the frame lacks what the shader reads.
    pub(super) fn draw(
        &self,
        (gpu, uploads): (&Gpu, &mut Uploads),
        (frame, blended): (&Frame, bool),
        before: &Views,
        images: &Images,
        encoder: &mut wgpu::CommandEncoder,
    ) -> Result<()> {
        let ready = self.ready((gpu, uploads), (frame, Some(blended)), before)?;
        let mut pass = images.cleared(wgpu::Color::TRANSPARENT, 1.0, encoder);
        self.record(&ready, &mut pass);
        Ok(())
    }

    /// Binds what a frame's draws read: those that are blended, those that are not, or all, the blended ones last.
    ///
    /// # Errors
    /// When the frame lacks what the shader reads.
    pub(super) fn ready(
        &self,
        (gpu, uploads): (&Gpu, &mut Uploads),
        (frame, blended): (&Frame, Option<bool>),
        before: &Views,
    ) -> Result<Ready> {
        let mesh = uploads.mesh(gpu, frame, &self.layout);
        let place = Place::new([frame.width, frame.height], frame.offset, frame.grid);
        let mut draws = Vec::new();
        for (number, draw) in frame.mesh.draws().into_iter().enumerate() {
            let state = state_of(&frame.states, number);
            if blended.is_some_and(|blended| (state.blend != Blend::Opaque) != blended) {
                continue;
            }
            let place = place.of_draw(draw.triangles.start as u32, blend::number(state.blend));
            let bind = |at: (u32, u32), slot: &Slot| match (before.get(&at), self.auto_lod) {
                _ if at == self.place => {
                    let ty = BufferBindingType::Uniform;
                    Ok(Bound::Buffer(resources::buffer(gpu, &place.bytes(), ty)))
                }
                (Some(view), _) => Ok(Bound::Texture(view.clone())),
                (None, Some((((group, binding), offset), value))) if at == (group, binding) => {
                    uploads.with_number(gpu, (frame, number, at, slot), (offset, value))
                }
                (None, _) => uploads.bound(gpu, frame, number, at, slot),
            };
            let groups = self.bind_groups(gpu, bind)?;
            let stride = self.layout.stride();
            draws.push(ReadyDraw {
                // To pictures all is drawn as if it were opaque.
                state: match self.bare {
                    true => state,
                    false => DrawState {
                        blend: Blend::Opaque,
                        ..state
                    },
                },
                groups,
                vertices: draw.vertices.start as u64 * stride..draw.vertices.end as u64 * stride,
                indices: 3 * draw.triangles.start as u32..3 * draw.triangles.end as u32,
            });
        }
        draws.sort_by_key(|draw| draw.state.blend != Blend::Opaque);
        Ok(Ready { mesh, draws })
    }

    /// Draws what is ready, in a pass over targets of the same formats.
    pub(super) fn record(&self, ready: &Ready, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_index_buffer(ready.mesh.indices.slice(..), wgpu::IndexFormat::Uint32);
        for draw in &ready.draws {
            // Its own, or of all draws where no pipeline is.
            let own = self
                .pipelines
                .iter()
                .find(|(state, _)| *state == draw.state);
            let Some((_, pipeline)) = own.or(self.pipelines.first()) else {
                continue;
            };
            pass.set_pipeline(pipeline);
            if let Some(vertices) = &ready.mesh.vertices {
                pass.set_vertex_buffer(0, vertices.slice(draw.vertices.clone()));
            }
            for (group, bound) in (0..).zip(&draw.groups) {
                if let Some(bound) = bound {
                    pass.set_bind_group(group, bound, &[]);
                }
            }
            pass.draw_indexed(draw.indices.clone(), 0, 0..1);
        }
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
    pub(super) fn images(&self, gpu: &Gpu, frame: &Frame) -> Images {
        let size = [frame.width, frame.height].map(|edge| edge * frame.grid);
        let image = |format: TextureFormat, usage: TextureUsages| {
            let always = TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING;
            gpu.image(size, format, always | usage)
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
    /// A pass that draws to them, its colours 0 at first, its coverage and depth as said.
    pub(super) fn cleared<'e>(
        &self,
        covered: wgpu::Color,
        depth: f32,
        encoder: &'e mut wgpu::CommandEncoder,
    ) -> wgpu::RenderPass<'e> {
        let view = |texture: &wgpu::Texture| texture.create_view(&Default::default());
        let colours: Vec<wgpu::TextureView> = self.colours.iter().map(view).collect();
        let coverage = view(&self.covered);
        let colours = colours.iter().map(|view| (view, wgpu::Color::TRANSPARENT));
        let attachments: Vec<_> = colours
            .chain([(&coverage, covered)])
            .map(|(view, clear)| {
                Some(wgpu::RenderPassColorAttachment {
                    view,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(clear),
                        store: wgpu::StoreOp::Store,
                    },
                })
            })
            .collect();
        let of_depth = self.depth.as_ref().map(view);
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: None,
            color_attachments: &attachments,
            depth_stencil_attachment: of_depth.as_ref().map(|view| {
                wgpu::RenderPassDepthStencilAttachment {
                    view,
                    depth_ops: Some(wgpu::Operations {
                        load: wgpu::LoadOp::Clear(depth),
                        store: wgpu::StoreOp::Store,
                    }),
                    stencil_ops: None,
                }
            }),
            ..Default::default()
        })
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
        let info = validated(&module)?;
        opengl::divide_whole_numbers(&mut module, &info);
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

pub(super) fn validated(module: &Module) -> Result<ModuleInfo> {
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::all());
    validator.validate(module).map_err(|error| {
        Diagnostic::error("a shader cannot be drawn as it is")
            .with_reason(error.emit_to_string(""))
            .with_note("this is a bug in lodc; the evaluator draws it")
    })
}
