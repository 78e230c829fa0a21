//! What a shader binds, told from its text: the layouts of its groups, and buffers, textures and samplers to fill them.

use super::Result;
use lodc::eval::machine::{Bindings, Resource};
use lodc::eval::raster::{Attribute, Frame};
use lodc::eval::texture::{Dimension, Sampler, Texture, Wrap};
use lodc_passes::semantics::words::float_to_half;
use naga::{AddressSpace, GlobalVariable, ImageClass, ImageDimension, Module};
use naga::{ScalarKind, StorageAccess, TypeInner};
use std::collections::BTreeMap;
use wgpu::util::DeviceExt;
use wgpu::{
    BindingType, BufferBindingType, BufferUsages, SamplerBindingType, TextureSampleType,
    TextureViewDimension, VertexFormat,
};

/// The groups of a shader, bound. Textures and samplers stay; buffers are written for each draw.
pub(super) struct Groups {
    pub(super) layouts: Vec<wgpu::BindGroupLayout>,
    pub(super) groups: Vec<wgpu::BindGroup>,
    buffers: BTreeMap<(u32, u32), wgpu::Buffer>,
}

impl Groups {
    /// Binds everything that a module declares, to what a frame has there.
    ///
    /// A layout that is written out, rather than derived from a pipeline, does for all levels: none binds more than the original.
    ///
    /// # Errors
    /// When a variable is of a kind that this example does not bind, or the frame has nothing for it.
    pub(super) fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        module: &Module,
        bindings: &Bindings,
    ) -> Result<Self> {
        let mut declared: BTreeMap<u32, Vec<(u32, BindingType)>> = BTreeMap::new();
        for (_, variable) in module.global_variables.iter() {
            if let Some(at) = &variable.binding {
                let group = declared.entry(at.group).or_default();
                group.push((at.binding, kind(module, variable)?));
            }
        }
        let mut made = Self {
            layouts: Vec::new(),
            groups: Vec::new(),
            buffers: BTreeMap::new(),
        };
        let count = declared.keys().max().map_or(0, |last| last + 1);
        for group in 0..count {
            let declared = declared.remove(&group).unwrap_or_default();
            let entries: Vec<_> = declared
                .iter()
                .map(|(binding, ty)| wgpu::BindGroupLayoutEntry {
                    binding: *binding,
                    visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
                    ty: *ty,
                    count: None,
                })
                .collect();
            let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label: None,
                entries: &entries,
            });
            let mut bound = Vec::new();
            for (binding, ty) in declared {
                let resource = bindings.get(&(group, binding));
                let resource = resource.and_then(|resource| resource.of_draw(0));
                let made = match (resource, ty) {
                    (Some(Resource::Buffer(bytes)), BindingType::Buffer { .. }) => {
                        let buffer = buffer(device, bytes);
                        made.buffers.insert((group, binding), buffer.clone());
                        Bound::Buffer(buffer)
                    }
                    (Some(Resource::Texture(t)), BindingType::Texture { view_dimension, .. }) => {
                        Bound::Texture(texture(device, queue, t, view_dimension))
                    }
                    (Some(Resource::Sampler(sampler)), BindingType::Sampler(_)) => {
                        Bound::Sampler(device.create_sampler(&described(sampler)))
                    }
                    _ => {
                        return Err(format!(
                            "the scene has nothing for group {group}, binding {binding}: a lock whose host fills more than the \
                             source's own bindings is not drawn by this example"
                        )
                        .into());
                    }
                };
                bound.push((binding, made));
            }
            let entries: Vec<_> = bound.iter().map(|(at, bound)| bound.entry(*at)).collect();
            made.groups
                .push(device.create_bind_group(&wgpu::BindGroupDescriptor {
                    label: None,
                    layout: &layout,
                    entries: &entries,
                }));
            made.layouts.push(layout);
        }
        Ok(made)
    }

    /// Writes the uniforms of a frame: its camera, and what else is not always the same.
    pub(super) fn write(&self, queue: &wgpu::Queue, bindings: &Bindings) {
        for (at, buffer) in &self.buffers {
            let resource = bindings.get(at).and_then(|resource| resource.of_draw(0));
            if let Some(Resource::Buffer(bytes)) = resource {
                queue.write_buffer(buffer, 0, &padded(bytes));
            }
        }
    }
}

enum Bound {
    Buffer(wgpu::Buffer),
    Texture(wgpu::TextureView),
    Sampler(wgpu::Sampler),
}

impl Bound {
    fn entry(&self, binding: u32) -> wgpu::BindGroupEntry<'_> {
        let resource = match self {
            Self::Buffer(buffer) => buffer.as_entire_binding(),
            Self::Texture(view) => wgpu::BindingResource::TextureView(view),
            Self::Sampler(sampler) => wgpu::BindingResource::Sampler(sampler),
        };
        wgpu::BindGroupEntry { binding, resource }
    }
}

/// What a variable is to a layout.
fn kind(module: &Module, variable: &GlobalVariable) -> Result<BindingType> {
    let buffer = |ty| BindingType::Buffer {
        ty,
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    Ok(match (variable.space, &module.types[variable.ty].inner) {
        (AddressSpace::Uniform, _) => buffer(BufferBindingType::Uniform),
        (AddressSpace::Storage { access }, _) if !access.contains(StorageAccess::STORE) => {
            buffer(BufferBindingType::Storage { read_only: true })
        }
        (_, TypeInner::Sampler { comparison: false }) => {
            BindingType::Sampler(SamplerBindingType::Filtering)
        }
        (
            _,
            TypeInner::Image {
                dim,
                arrayed,
                class:
                    ImageClass::Sampled {
                        kind: ScalarKind::Float,
                        multi: false,
                    },
            },
        ) => BindingType::Texture {
            sample_type: TextureSampleType::Float { filterable: true },
            view_dimension: match (dim, arrayed) {
                (ImageDimension::D1, _) => TextureViewDimension::D1,
                (ImageDimension::D2, false) => TextureViewDimension::D2,
                (ImageDimension::D2, true) => TextureViewDimension::D2Array,
                (ImageDimension::D3, _) => TextureViewDimension::D3,
                (ImageDimension::Cube, false) => TextureViewDimension::Cube,
                (ImageDimension::Cube, true) => TextureViewDimension::CubeArray,
            },
            multisampled: false,
        },
        _ => {
            let name = variable.name.as_deref().unwrap_or_default();
            return Err(format!("this example does not bind what `{name}` is").into());
        }
    })
}

/// Uniform buffers are whole vectors.
fn padded(bytes: &[u8]) -> Vec<u8> {
    let mut padded = bytes.to_vec();
    padded.resize(bytes.len().max(1).next_multiple_of(16), 0);
    padded
}

fn buffer(device: &wgpu::Device, bytes: &[u8]) -> wgpu::Buffer {
    device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: None,
        contents: &padded(bytes),
        usage: BufferUsages::UNIFORM | BufferUsages::STORAGE | BufferUsages::COPY_DST,
    })
}

/// A texture with all its levels, of half precision. The scene has its texels in linear light, so that the format is no sRGB one;
/// an engine uploads its own textures as ever.
fn texture(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    texture: &Texture,
    view: TextureViewDimension,
) -> wgpu::TextureView {
    let (first, dimension) = match (texture.dimension(), view) {
        (_, TextureViewDimension::D1) => (&texture.levels()[..1], wgpu::TextureDimension::D1),
        (Dimension::D3, _) => (texture.levels(), wgpu::TextureDimension::D3),
        _ => (texture.levels(), wgpu::TextureDimension::D2),
    };
    let (levels, first) = (first, &first[0]);
    let half = |texel: &f32| (float_to_half(*texel) as u16).to_le_bytes();
    let texels = levels
        .iter()
        .flat_map(|level| level.texels.iter().flatten());
    let made = device.create_texture_with_data(
        queue,
        &wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d {
                width: first.width,
                height: first.height,
                depth_or_array_layers: first.layers,
            },
            mip_level_count: levels.len() as u32,
            sample_count: 1,
            dimension,
            format: wgpu::TextureFormat::Rgba16Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        },
        wgpu::util::TextureDataOrder::MipMajor,
        &texels.flat_map(half).collect::<Vec<u8>>(),
    );
    made.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(view),
        ..Default::default()
    })
}

fn described(sampler: &Sampler) -> wgpu::SamplerDescriptor<'static> {
    let [u, v, w] = sampler.wrap.map(|wrap| match wrap {
        Wrap::Repeat => wgpu::AddressMode::Repeat,
        Wrap::ClampToEdge => wgpu::AddressMode::ClampToEdge,
        Wrap::MirrorRepeat => wgpu::AddressMode::MirrorRepeat,
    });
    let filter = |linear| match linear {
        true => wgpu::FilterMode::Linear,
        false => wgpu::FilterMode::Nearest,
    };
    wgpu::SamplerDescriptor {
        address_mode_u: u,
        address_mode_v: v,
        address_mode_w: w,
        mag_filter: filter(sampler.linear_magnification),
        min_filter: filter(sampler.linear_minification),
        mipmap_filter: match sampler.linear_mip {
            true => wgpu::MipmapFilterMode::Linear,
            false => wgpu::MipmapFilterMode::Nearest,
        },
        ..Default::default()
    }
}

/// A mesh on the device: a buffer for each vertex input, and the indices.
pub(super) struct Mesh {
    pub(super) inputs: Vec<Input>,
    pub(super) indices: wgpu::Buffer,
    pub(super) corners: u32,
}

/// A vertex input.
pub(super) struct Input {
    pub(super) attribute: [wgpu::VertexAttribute; 1],
    pub(super) stride: u64,
    pub(super) buffer: wgpu::Buffer,
}

impl Mesh {
    /// Uploads what the vertex stage of a frame reads. Every level goes with it.
    ///
    /// # Errors
    /// When it reads what this example does not feed.
    pub(super) fn new(device: &wgpu::Device, frame: &Frame) -> Result<Self> {
        let upload = |bytes: &[u8], usage| {
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: None,
                contents: bytes,
                usage,
            })
        };
        let mesh = &frame.mesh;
        let mut inputs = Vec::new();
        for (location, attribute) in &frame.attributes {
            let (format, numbers) = match attribute {
                Attribute::Position => (VertexFormat::Float32x3, mesh.positions.as_flattened()),
                Attribute::Normal => (VertexFormat::Float32x3, mesh.normals.as_flattened()),
                Attribute::Uv => (VertexFormat::Float32x2, mesh.uvs.as_flattened()),
                Attribute::Tangent => (VertexFormat::Float32x4, mesh.tangents.as_flattened()),
                Attribute::Colour => (VertexFormat::Float32x4, mesh.colours.as_flattened()),
                other => return Err(format!("this example feeds no {other:?}").into()),
            };
            let bytes: Vec<u8> = numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
            if bytes.len() as u64 != format.size() * mesh.positions.len() as u64 {
                return Err(format!("the mesh has no {attribute:?}").into());
            }
            inputs.push(Input {
                attribute: [wgpu::VertexAttribute {
                    format,
                    offset: 0,
                    shader_location: *location,
                }],
                stride: format.size(),
                buffer: upload(&bytes, BufferUsages::VERTEX),
            });
        }
        let indices = mesh.indices.iter().flat_map(|index| index.to_le_bytes());
        Ok(Self {
            inputs,
            indices: upload(&indices.collect::<Vec<u8>>(), BufferUsages::INDEX),
            corners: mesh.indices.len() as u32,
        })
    }
}
