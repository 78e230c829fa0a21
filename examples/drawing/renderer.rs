//! Pipelines, one a level, and what is drawn with them.

use super::resources::{Groups, Mesh};
use super::{Material, Result};
use lodc::eval::raster::Frame;
use lodc::front::Source;
use wgpu::{TextureFormat, TextureUsages};

/// The format of depths.
const DEPTH: TextureFormat = TextureFormat::Depth32Float;

/// A device, and what work is handed to it by.
pub(crate) type Device = (wgpu::Device, wgpu::Queue);

/// The interfaces to adapters of this machine; `WGPU_BACKEND=gl` and the like choose one.
pub(crate) fn instance() -> wgpu::Instance {
    wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env())
}

/// Opens the best adapter, of those that can show pictures on a surface when there is one.
///
/// # Errors
/// When there is none, or its driver gives no device.
pub(crate) fn open(
    instance: &wgpu::Instance,
    surface: Option<&wgpu::Surface<'_>>,
) -> Result<(wgpu::Adapter, Device)> {
    let options = wgpu::RequestAdapterOptions {
        power_preference: wgpu::PowerPreference::HighPerformance,
        compatible_surface: surface,
        ..Default::default()
    };
    let adapter = pollster::block_on(instance.request_adapter(&options))?;
    let descriptor = wgpu::DeviceDescriptor {
        required_limits: adapter.limits(),
        ..Default::default()
    };
    let device = pollster::block_on(adapter.request_device(&descriptor))?;
    Ok((adapter, device))
}

/// Draws a material's levels to targets of one format.
pub(crate) struct Renderer {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    mesh: Mesh,
    groups: Groups,
    pipelines: Vec<wgpu::RenderPipeline>,
}

impl Renderer {
    /// Compiles all levels, and uploads what they read.
    ///
    /// # Errors
    /// When the device cannot draw it, or this example does not feed what the shader reads.
    pub(crate) fn new(device: Device, material: &Material, format: TextureFormat) -> Result<Self> {
        let constants = (0..material.levels()).map(|level| Some(material.constant(level)));
        Self::of(device, material, (&material.source, constants), format)
    }

    /// The same of the author's shader, which has no levels: to compare with.
    ///
    /// # Errors
    /// As [`Renderer::new`].
    pub(crate) fn of_original(
        device: Device,
        material: &Material,
        format: TextureFormat,
    ) -> Result<Self> {
        let one = std::iter::once(None);
        Self::of(device, material, (&material.original, one), format)
    }

    fn of(
        (device, queue): Device,
        material: &Material,
        (source, constants): (&Source, impl Iterator<Item = Option<f64>>),
        format: TextureFormat,
    ) -> Result<Self> {
        // What a driver refuses comes back here, not in a callback.
        let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
        let scene = &material.scene;
        let frame = material.frame(glam::DVec3::Z, scene.nearest);
        let mesh = Mesh::new(&device, &frame)?;
        let groups = Groups::new(&device, &queue, &source.module, &frame.bindings)?;
        let layouts: Vec<_> = groups.layouts.iter().map(Some).collect();
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &layouts,
            immediate_size: 0,
        });
        let shader = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(&source.name),
            source: wgpu::ShaderSource::Wgsl(source.text.as_str().into()),
        });
        let buffers: Vec<_> = mesh
            .inputs
            .iter()
            .map(|input| {
                Some(wgpu::VertexBufferLayout {
                    array_stride: input.stride,
                    step_mode: wgpu::VertexStepMode::Vertex,
                    attributes: &input.attribute,
                })
            })
            .collect();
        let vertex = source.vertex.as_deref();
        let vertex = vertex.ok_or("this example draws shaders with a vertex stage of their own")?;
        let pipeline = |auto_lod: Option<f64>| {
            // The one thing that is lodc's: which level this pipeline is. Unset, it is the original.
            let constants: Vec<(&str, f64)> =
                auto_lod.map(|is| ("autoLOD", is)).into_iter().collect();
            let compilation_options = wgpu::PipelineCompilationOptions {
                constants: &constants,
                ..Default::default()
            };
            device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: None,
                layout: Some(&layout),
                vertex: wgpu::VertexState {
                    module: &shader,
                    entry_point: Some(vertex),
                    compilation_options: compilation_options.clone(),
                    buffers: &buffers,
                },
                primitive: Default::default(),
                depth_stencil: Some(wgpu::DepthStencilState {
                    format: DEPTH,
                    depth_write_enabled: Some(true),
                    depth_compare: Some(wgpu::CompareFunction::Less),
                    stencil: Default::default(),
                    bias: Default::default(),
                }),
                multisample: Default::default(),
                fragment: Some(wgpu::FragmentState {
                    module: &shader,
                    entry_point: Some(&source.fragment),
                    compilation_options,
                    targets: &[Some(wgpu::ColorTargetState {
                        format,
                        blend: Some(TINTED),
                        write_mask: wgpu::ColorWrites::ALL,
                    })],
                }),
                multiview_mask: None,
                cache: None,
            })
        };
        let pipelines = constants.map(pipeline).collect();
        if let Some(error) = pollster::block_on(scope.pop()) {
            return Err(error.into());
        }
        Ok(Self {
            device,
            queue,
            mesh,
            groups,
            pipelines,
        })
    }

    /// Draws a level over a cleared target. Colours are multiplied by `tint`: white is as the shader has it.
    pub(crate) fn draw(&self, frame: &Frame, level: usize, target: &wgpu::Texture, tint: [f64; 3]) {
        self.groups.write(&self.queue, &frame.bindings);
        let depth = self.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: target.size(),
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: DEPTH,
            usage: TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        });
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &target.create_view(&Default::default()),
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &depth.create_view(&Default::default()),
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(1.0),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_pipeline(&self.pipelines[level.min(self.pipelines.len() - 1)]);
        pass.set_blend_constant(wgpu::Color {
            r: tint[0],
            g: tint[1],
            b: tint[2],
            a: 1.0,
        });
        for (index, group) in (0..).zip(&self.groups.groups) {
            pass.set_bind_group(index, group, &[]);
        }
        for (slot, input) in (0..).zip(&self.mesh.inputs) {
            pass.set_vertex_buffer(slot, input.buffer.slice(..));
        }
        pass.set_index_buffer(self.mesh.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..self.mesh.corners, 0, 0..1);
        drop(pass);
        self.queue.submit([encoder.finish()]);
    }

    /// A texture to draw to, of which pictures can be read.
    pub(crate) fn target(&self, [width, height]: [u32; 2], format: TextureFormat) -> wgpu::Texture {
        self.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d {
                width,
                height,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_SRC,
            view_formats: &[],
        })
    }

    /// The pixels of a target of 8 bits a channel, row by row from the top, as the target has them.
    ///
    /// # Errors
    /// When the device was lost.
    pub(crate) fn pixels(&self, target: &wgpu::Texture) -> Result<Vec<[u8; 4]>> {
        let row = 4 * target.width();
        // Rows of a copy begin at multiples of this.
        let apart = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(apart) * u64::from(target.height()),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&Default::default());
        encoder.copy_texture_to_buffer(
            target.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(apart),
                    rows_per_image: None,
                },
            },
            target.size(),
        );
        self.queue.submit([encoder.finish()]);
        let (send, receive) = std::sync::mpsc::channel();
        buffer.map_async(wgpu::MapMode::Read, .., move |mapped| {
            let _ = send.send(mapped);
        });
        self.device.poll(wgpu::PollType::wait_indefinitely())?;
        receive.recv()??;
        let bytes = buffer.get_mapped_range(..)?;
        let rows = bytes.chunks_exact(apart as usize);
        let pixels = rows.flat_map(|bytes| bytes[..row as usize].as_chunks::<4>().0);
        Ok(pixels.copied().collect())
    }
}

/// Colours times the pass's constant, in the place of what was there: a tint that asks nothing of the shader.
const TINTED: wgpu::BlendState = wgpu::BlendState {
    color: wgpu::BlendComponent {
        src_factor: wgpu::BlendFactor::Constant,
        dst_factor: wgpu::BlendFactor::Zero,
        operation: wgpu::BlendOperation::Add,
    },
    alpha: wgpu::BlendComponent::REPLACE,
};
