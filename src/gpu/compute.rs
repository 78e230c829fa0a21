//! Compute pipelines over one group of bindings.

use wgpu::{
    BindGroupLayout, BindingType, BufferBindingType, ComputePipeline, Device, ShaderModule,
    ShaderStages, TextureSampleType, TextureViewDimension,
};

/// A texture whose words are read.
pub(super) const WORDS: BindingType = BindingType::Texture {
    sample_type: TextureSampleType::Uint,
    view_dimension: TextureViewDimension::D2,
    multisampled: false,
};

/// A buffer of any size.
pub(super) const fn buffer(ty: BufferBindingType) -> BindingType {
    BindingType::Buffer {
        ty,
        has_dynamic_offset: false,
        min_binding_size: None,
    }
}

/// A group of bindings of these types, numbered from 0, and the pipelines of some entry points of a module over it.
pub(super) fn pipelines<const N: usize>(
    device: &Device,
    module: &ShaderModule,
    types: &[BindingType],
    entry_points: [&str; N],
) -> (BindGroupLayout, [ComputePipeline; N]) {
    let entries: Vec<wgpu::BindGroupLayoutEntry> = (0..)
        .zip(types)
        .map(|(binding, ty)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: ShaderStages::COMPUTE,
            ty: *ty,
            count: None,
        })
        .collect();
    let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: None,
        entries: &entries,
    });
    let of_all = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &[Some(&layout)],
        immediate_size: 0,
    });
    let pipelines = entry_points.map(|name| {
        device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: None,
            layout: Some(&of_all),
            module,
            entry_point: Some(name),
            compilation_options: Default::default(),
            cache: None,
        })
    });
    (layout, pipelines)
}
