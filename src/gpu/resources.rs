//! What a shader reads of a scene, on the device: buffers, textures with all their levels, samplers, meshes.
//!
//! Textures hold the evaluator's own texels, in linear light and single precision, so that both renderers filter the
//! same numbers. Where the adapter cannot filter those, they are of half precision.

use super::adapter::Gpu;
use super::depth;
use super::vertices::{self, Layout};
use crate::eval::machine::Resource;
use crate::eval::raster::{Attribute, Frame};
use crate::eval::texture::{Comparison, Dimension, Sampler, Texture, Wrap};
use crate::scene::mesh::Mesh;
use crate::{Diagnostic, Result};
use lodc_passes::semantics::words::float_to_half;
use naga::valid::ModuleInfo;
use naga::{
    AddressSpace, GlobalVariable, ImageClass, ImageDimension, Module, ScalarKind, StorageAccess,
    TypeInner,
};
use std::collections::BTreeMap;
use std::sync::Arc;
use wgpu::util::DeviceExt;
use wgpu::{
    BindGroupLayoutEntry, BindingType, BufferBindingType, BufferUsages, SamplerBindingType,
    ShaderStages, TextureFormat, TextureSampleType, TextureUsages, TextureViewDimension,
};

/// What a shader declares at a group and binding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Slot {
    pub(super) ty: BindingType,
    pub(super) visibility: ShaderStages,
}

/// What a shader reads, by group and binding.
#[derive(Clone, Debug, Default)]
pub(super) struct Slots(pub(super) BTreeMap<(u32, u32), Slot>);

impl Slots {
    /// Adds what the one entry point of a module reads. `formats` are those of textures that are drawn to.
    ///
    /// # Errors
    /// When a variable is of a kind that no scene can fill, or both stages declare another one.
    pub(super) fn add(
        &mut self,
        gpu: &Gpu,
        module: &Module,
        info: &ModuleInfo,
        stage: ShaderStages,
        formats: &BTreeMap<(u32, u32), TextureFormat>,
    ) -> Result<()> {
        for (handle, global) in module.global_variables.iter() {
            let Some(at) = &global.binding else { continue };
            if info.get_entry_point(0)[handle].is_empty() {
                continue;
            }
            let at = (at.group, at.binding);
            let ty = binding_type(gpu, module, global, formats.get(&at))?;
            let slot = self.0.entry(at).or_insert(Slot {
                ty,
                visibility: stage,
            });
            if slot.ty != ty {
                return Err(Diagnostic::error(format!(
                    "the two stages declare different variables at group {}, binding {}",
                    at.0, at.1
                ))
                .with_note("a GPU draws both stages with the same bindings: give one of them another binding"));
            }
            slot.visibility |= stage;
        }
        Ok(())
    }

    /// The layouts of the groups, as many as the last that is used needs.
    pub(super) fn layouts(&self, gpu: &Gpu) -> Vec<Option<wgpu::BindGroupLayout>> {
        let groups = self.0.keys().map(|(group, _)| group + 1).max().unwrap_or(0);
        let layout = |group| {
            let entries: Vec<BindGroupLayoutEntry> = self
                .of_group(group)
                .map(|(binding, slot)| BindGroupLayoutEntry {
                    binding,
                    visibility: slot.visibility,
                    ty: slot.ty,
                    count: None,
                })
                .collect();
            let descriptor = wgpu::BindGroupLayoutDescriptor {
                label: None,
                entries: &entries,
            };
            (!entries.is_empty()).then(|| gpu.device().create_bind_group_layout(&descriptor))
        };
        (0..groups).map(layout).collect()
    }

    /// The slots of a group.
    pub(super) fn of_group(&self, group: u32) -> impl Iterator<Item = (u32, &Slot)> {
        let all = self.0.range((group, 0)..=(group, u32::MAX));
        all.map(|((_, binding), slot)| (*binding, slot))
    }
}

fn binding_type(
    gpu: &Gpu,
    module: &Module,
    global: &GlobalVariable,
    format: Option<&TextureFormat>,
) -> Result<BindingType> {
    let name = global.name.as_deref().unwrap_or_default();
    let refused = |what: &str| {
        Diagnostic::error(format!("`{name}` is {what}, which is not drawn on a GPU"))
            .with_note("a scene fills uniform and storage buffers, sampled textures and samplers")
    };
    let buffer = |ty| BindingType::Buffer {
        ty,
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    Ok(match (global.space, &module.types[global.ty].inner) {
        (AddressSpace::Uniform, _) => buffer(BufferBindingType::Uniform),
        (AddressSpace::Storage { access }, _) => buffer(BufferBindingType::Storage {
            read_only: !access.contains(StorageAccess::STORE),
        }),
        (_, TypeInner::Sampler { comparison }) => BindingType::Sampler(match comparison {
            true => SamplerBindingType::Comparison,
            false => SamplerBindingType::Filtering,
        }),
        (
            _,
            TypeInner::Image {
                dim,
                arrayed,
                class,
            },
        ) => BindingType::Texture {
            sample_type: match class {
                ImageClass::Sampled { multi: false, kind } => match kind {
                    ScalarKind::Uint => TextureSampleType::Uint,
                    ScalarKind::Sint => TextureSampleType::Sint,
                    _ => TextureSampleType::Float {
                        filterable: filterable(gpu, format),
                    },
                },
                ImageClass::Depth { multi: false } => TextureSampleType::Depth,
                ImageClass::Sampled { .. } | ImageClass::Depth { .. } => {
                    return Err(refused("a multisampled texture"));
                }
                ImageClass::Storage { .. } => return Err(refused("a storage texture")),
                ImageClass::External => return Err(refused("an external texture")),
            },
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
        _ => return Err(refused("an array of bindings")),
    })
}

/// Whether textures can be filtered: those of the scene always, those that are drawn to as their format is.
fn filterable(gpu: &Gpu, format: Option<&TextureFormat>) -> bool {
    let Some(format) = format else { return true };
    let sample = format.sample_type(None, Some(gpu.device().features()));
    sample == Some(TextureSampleType::Float { filterable: true })
}

/// The format of the scene's textures.
fn float_format(gpu: &Gpu) -> TextureFormat {
    let features = gpu.device().features();
    match features.contains(wgpu::Features::FLOAT32_FILTERABLE) {
        true => TextureFormat::Rgba32Float,
        false => TextureFormat::Rgba16Float,
    }
}

/// What is bound, ready for a bind group.
#[derive(Clone, Debug)]
pub(super) enum Bound {
    Buffer(wgpu::Buffer),
    Texture(wgpu::TextureView),
    Sampler(wgpu::Sampler),
}

impl Bound {
    pub(super) fn resource(&self) -> wgpu::BindingResource<'_> {
        match self {
            Self::Buffer(buffer) => buffer.as_entire_binding(),
            Self::Texture(view) => wgpu::BindingResource::TextureView(view),
            Self::Sampler(sampler) => wgpu::BindingResource::Sampler(sampler),
        }
    }
}

/// A mesh on the device.
#[derive(Clone, Debug)]
pub(super) struct Buffers {
    /// None when the vertex stage reads nothing of a mesh.
    pub(super) vertices: Option<wgpu::Buffer>,
    pub(super) indices: wgpu::Buffer,
}

/// A mesh that is there, and what its buffers were made of.
#[derive(Debug)]
struct Uploaded {
    mesh: Arc<Mesh>,
    attributes: BTreeMap<u32, Attribute>,
    layout: Layout,
    buffers: Buffers,
}

/// What was uploaded before. It is told by its address, which stays taken, since what is there is kept here too.
#[derive(Debug, Default)]
pub(super) struct Uploads {
    textures: BTreeMap<(usize, Kind), (Arc<Texture>, wgpu::TextureView)>,
    samplers: BTreeMap<(usize, bool), (Arc<Sampler>, wgpu::Sampler)>,
    meshes: Vec<Uploaded>,
}

/// How a texture is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    Float(View),
    Uint(View),
    Sint(View),
    Depth(View),
}

/// [`TextureViewDimension`], with an order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum View {
    D1,
    D2,
    D2Array,
    Cube,
    CubeArray,
    D3,
}

impl View {
    fn of(view: TextureViewDimension) -> Self {
        match view {
            TextureViewDimension::D1 => Self::D1,
            TextureViewDimension::D2 => Self::D2,
            TextureViewDimension::D2Array => Self::D2Array,
            TextureViewDimension::Cube => Self::Cube,
            TextureViewDimension::CubeArray => Self::CubeArray,
            TextureViewDimension::D3 => Self::D3,
        }
    }
}

impl Uploads {
    /// What a draw of a frame binds at a slot.
    ///
    /// # Errors
    /// When the frame has nothing there, or something else than the shader reads.
    pub(super) fn bound(
        &mut self,
        gpu: &Gpu,
        frame: &Frame,
        draw: usize,
        at: (u32, u32),
        slot: &Slot,
    ) -> Result<Bound> {
        let resource = frame.bindings.get(&at).and_then(|r| r.of_draw(draw));
        Ok(match (resource, slot.ty) {
            (Some(Resource::Buffer(bytes)), BindingType::Buffer { ty, .. }) => {
                Bound::Buffer(buffer(gpu, bytes, ty))
            }
            (
                Some(Resource::Texture(texture)),
                BindingType::Texture {
                    sample_type,
                    view_dimension,
                    ..
                },
            ) => Bound::Texture(self.texture(gpu, texture, sample_type, view_dimension)),
            (Some(Resource::Sampler(sampler)), BindingType::Sampler(ty)) => {
                Bound::Sampler(self.sampler(gpu, sampler, ty == SamplerBindingType::Comparison))
            }
            (found, _) => {
                let found = found.map_or("nothing", |_| "something else");
                return Err(Diagnostic::error(format!(
                    "the scene has {found} for the shader's group {}, binding {}",
                    at.0, at.1
                ))
                .with_note("a scene is made for one shader: draw others that have its bindings"));
            }
        })
    }

    /// The same of a buffer in which a number is set, at an offset in bytes. Where the scene has no buffer there, one that
    /// is 0 but for the number.
    ///
    /// # Errors
    /// When something else than a buffer is bound there.
    pub(super) fn with_number(
        &mut self,
        gpu: &Gpu,
        (frame, draw, at, slot): (&Frame, usize, (u32, u32), &Slot),
        (offset, value): (u32, f32),
    ) -> Result<Bound> {
        let mut bytes = match frame.bindings.get(&at).and_then(|r| r.of_draw(draw)) {
            Some(Resource::Buffer(bytes)) => bytes.to_vec(),
            Some(_) => return self.bound(gpu, frame, draw, at, slot),
            None => Vec::new(),
        };
        let BindingType::Buffer { ty, .. } = slot.ty else {
            return self.bound(gpu, frame, draw, at, slot);
        };
        let offset = offset as usize;
        let end = offset + 4;
        bytes.resize(bytes.len().max(end), 0);
        bytes[offset..end].copy_from_slice(&value.to_le_bytes());
        Ok(Bound::Buffer(buffer(gpu, &bytes, ty)))
    }

    fn texture(
        &mut self,
        gpu: &Gpu,
        texture: &Arc<Texture>,
        sample: TextureSampleType,
        view: TextureViewDimension,
    ) -> wgpu::TextureView {
        let of_view = View::of(view);
        let kind = match sample {
            TextureSampleType::Uint => Kind::Uint(of_view),
            TextureSampleType::Sint => Kind::Sint(of_view),
            TextureSampleType::Depth => Kind::Depth(of_view),
            TextureSampleType::Float { .. } => Kind::Float(of_view),
        };
        let key = (Arc::as_ptr(texture).addr(), kind);
        if let Some((_, view)) = self.textures.get(&key) {
            return view.clone();
        }
        let made = upload(gpu, texture, kind, view);
        self.textures.insert(key, (texture.clone(), made.clone()));
        made
    }

    fn sampler(&mut self, gpu: &Gpu, sampler: &Arc<Sampler>, compares: bool) -> wgpu::Sampler {
        let key = (Arc::as_ptr(sampler).addr(), compares);
        let made = self.samplers.entry(key).or_insert_with(|| {
            let made = gpu.device().create_sampler(&descriptor(sampler, compares));
            (sampler.clone(), made)
        });
        made.1.clone()
    }

    /// The buffers of a frame's mesh for a vertex stage.
    pub(super) fn mesh(&mut self, gpu: &Gpu, frame: &Frame, layout: &Layout) -> Buffers {
        let known = self.meshes.iter().find(|known| {
            Arc::ptr_eq(&known.mesh, &frame.mesh)
                && known.attributes == frame.attributes
                && known.layout == *layout
        });
        if let Some(known) = known {
            return known.buffers.clone();
        }
        let make = |bytes: Vec<u8>, usage| {
            gpu.device()
                .create_buffer_init(&wgpu::util::BufferInitDescriptor {
                    label: None,
                    contents: &bytes,
                    usage,
                })
        };
        let buffers = Buffers {
            vertices: (layout.stride() > 0)
                .then(|| make(layout.bytes(frame), BufferUsages::VERTEX)),
            indices: make(
                vertices::indices(frame, gpu.is_opengl()),
                BufferUsages::INDEX,
            ),
        };
        self.meshes.push(Uploaded {
            mesh: frame.mesh.clone(),
            attributes: frame.attributes.clone(),
            layout: layout.clone(),
            buffers: buffers.clone(),
        });
        buffers
    }
}

/// A buffer of these bytes. Uniform buffers are filled up to whole vectors, as some drivers have them.
pub(super) fn buffer(gpu: &Gpu, bytes: &[u8], ty: BufferBindingType) -> wgpu::Buffer {
    let (unit, usage) = match ty {
        BufferBindingType::Uniform => (16, BufferUsages::UNIFORM),
        BufferBindingType::Storage { .. } => (4, BufferUsages::STORAGE),
    };
    let mut contents = bytes.to_vec();
    let length = bytes.len().max(1).next_multiple_of(unit);
    contents.resize(length, 0);
    if ty == BufferBindingType::Uniform && gpu.inlines_uniforms() {
        // There it is the first of two, see `lavapipe`.
        contents.resize(2 * length, 0);
    }
    gpu.device()
        .create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: None,
            contents: &contents,
            usage,
        })
}

fn descriptor(sampler: &Sampler, compares: bool) -> wgpu::SamplerDescriptor<'static> {
    let filter = |linear| match linear {
        true => wgpu::FilterMode::Linear,
        false => wgpu::FilterMode::Nearest,
    };
    let [u, v, w] = sampler.wrap.map(|wrap| match wrap {
        Wrap::Repeat => wgpu::AddressMode::Repeat,
        Wrap::ClampToEdge => wgpu::AddressMode::ClampToEdge,
        Wrap::MirrorRepeat => wgpu::AddressMode::MirrorRepeat,
    });
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
        compare: compares.then_some(match sampler.comparison {
            Comparison::Never => wgpu::CompareFunction::Never,
            Comparison::Less => wgpu::CompareFunction::Less,
            Comparison::Equal => wgpu::CompareFunction::Equal,
            Comparison::LessEqual => wgpu::CompareFunction::LessEqual,
            Comparison::Greater => wgpu::CompareFunction::Greater,
            Comparison::NotEqual => wgpu::CompareFunction::NotEqual,
            Comparison::GreaterEqual => wgpu::CompareFunction::GreaterEqual,
            Comparison::Always => wgpu::CompareFunction::Always,
        }),
        ..Default::default()
    }
}

/// A texture with the texels of all its levels.
fn upload(
    gpu: &Gpu,
    texture: &Texture,
    kind: Kind,
    view: TextureViewDimension,
) -> wgpu::TextureView {
    let format = match kind {
        Kind::Float(_) => float_format(gpu),
        Kind::Uint(_) => TextureFormat::Rgba32Uint,
        Kind::Sint(_) => TextureFormat::Rgba32Sint,
        Kind::Depth(_) => TextureFormat::Depth32Float,
    };
    let first = &texture.levels()[0];
    // Of one dimension there is one level only.
    let levels = match view {
        TextureViewDimension::D1 => 1,
        _ => texture.level_count(),
    };
    let of_view = wgpu::TextureViewDescriptor {
        dimension: Some(view),
        array_layer_count: match view {
            TextureViewDimension::D2 => Some(1),
            TextureViewDimension::Cube => Some(6),
            _ => None,
        },
        ..Default::default()
    };
    if let Kind::Depth(_) = kind {
        return depth::texture(gpu, texture, levels).create_view(&of_view);
    }
    let made = gpu.device().create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d {
            width: first.width,
            height: first.height,
            depth_or_array_layers: first.layers,
        },
        mip_level_count: levels,
        sample_count: 1,
        dimension: match (texture.dimension(), view) {
            (_, TextureViewDimension::D1) => wgpu::TextureDimension::D1,
            (Dimension::D2 | Dimension::Cube, _) => wgpu::TextureDimension::D2,
            (Dimension::D3, _) => wgpu::TextureDimension::D3,
        },
        format,
        usage: TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST,
        view_formats: &[],
    });
    for (i, level) in (0..levels).zip(texture.levels()) {
        let texels = level.texels.iter().flatten();
        let bytes: Vec<u8> = match format {
            TextureFormat::Rgba16Float => texels
                .flat_map(|t| (float_to_half(*t) as u16).to_le_bytes())
                .collect(),
            TextureFormat::Rgba32Uint => texels.flat_map(|t| (*t as u32).to_le_bytes()).collect(),
            TextureFormat::Rgba32Sint => texels.flat_map(|t| (*t as i32).to_le_bytes()).collect(),
            _ => texels.flat_map(|t| t.to_le_bytes()).collect(),
        };
        let texel = match format {
            TextureFormat::Rgba16Float => 8,
            _ => 16,
        };
        gpu.queue().write_texture(
            wgpu::TexelCopyTextureInfo {
                texture: &made,
                mip_level: i,
                origin: wgpu::Origin3d::ZERO,
                aspect: wgpu::TextureAspect::All,
            },
            &bytes,
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(texel * level.width),
                rows_per_image: Some(level.height),
            },
            wgpu::Extent3d {
                width: level.width,
                height: level.height,
                depth_or_array_layers: level.layers,
            },
        );
    }
    made.create_view(&of_view)
}
