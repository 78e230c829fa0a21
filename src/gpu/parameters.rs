//! Runs the parameter stage of a variant on a device, as a host would.

use super::adapter::Gpu;
use super::pass::validated;
use super::read::words_of;
use super::resources::{Bound, Slots, Uploads};
use crate::eval::raster::Frame;
use crate::{Diagnostic, Result};
use lodc_passes::{Shader, Stage};
use std::borrow::Cow;
use std::collections::BTreeMap;
use wgpu::{BufferUsages, ShaderStages};

/// The words of the parameter block that the compute entry point of a variant stores for a draw of a frame.
///
/// # Errors
/// When the shader has no parameters, the device cannot run the entry point, or the frame lacks what that reads.
pub fn parameters(gpu: &Gpu, shader: &Shader, frame: &Frame, draw: usize) -> Result<Vec<u32>> {
    let (Some(block), Some(entry)) = (shader.parameter_block(), shader.index(Stage::Parameter))
    else {
        return Err(Diagnostic::error("the shader has no parameters"));
    };
    let mut module = shader.module().clone();
    module.entry_points.swap(0, entry);
    module.entry_points.truncate(1);
    let name = module.entry_points[0].name.clone();
    let stored = module.global_variables[block.stored].binding;
    let stored = stored.map(|at| (at.group, at.binding));
    let size = module.types[block.ty].inner.size(module.to_ctx());
    let mut slots = Slots::default();
    let info = validated(&module)?;
    slots.add(gpu, &module, &info, ShaderStages::COMPUTE, &BTreeMap::new())?;
    let mut uploads = Uploads::default();
    let output = gpu.guarded("running the parameter stage", || {
        let device = gpu.device();
        let output = device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(size.next_multiple_of(16)),
            usage: BufferUsages::STORAGE | BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        let groups = slots.layouts(gpu);
        let layouts: Vec<_> = groups.iter().map(Option::as_ref).collect();
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &layouts,
            immediate_size: 0,
        });
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Naga(Cow::Owned(module)),
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: None,
            layout: Some(&layout),
            module: &module,
            entry_point: Some(&name),
            compilation_options: Default::default(),
            cache: None,
        });
        let mut encoder = device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&pipeline);
        for (group, layout) in (0..).zip(&groups) {
            let Some(layout) = layout else { continue };
            let mut bound: Vec<(u32, Bound)> = Vec::new();
            for (binding, slot) in slots.of_group(group) {
                let at = (group, binding);
                bound.push(match Some(at) == stored {
                    true => (binding, Bound::Buffer(output.clone())),
                    false => (binding, uploads.bound(gpu, frame, draw, at, slot)?),
                });
            }
            let entries: Vec<wgpu::BindGroupEntry<'_>> = bound
                .iter()
                .map(|(binding, bound)| wgpu::BindGroupEntry {
                    binding: *binding,
                    resource: bound.resource(),
                })
                .collect();
            let bound = device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: None,
                layout,
                entries: &entries,
            });
            pass.set_bind_group(group, &bound, &[]);
        }
        pass.dispatch_workgroups(1, 1, 1);
        drop(pass);
        gpu.queue().submit([encoder.finish()]);
        Ok(output)
    })?;
    words_of(gpu, &output)
}
