//! The picture that instances are drawn to for the clock, and how.

use super::clock::Stamps;
use super::tiles::{Part, Tiles};
use crate::gpu::adapter::Gpu;
use crate::gpu::pass::{DEPTH, Pass, Ready};
use std::ops::Range;
use wgpu::{CommandEncoder, TextureFormat, TextureUsages, TextureView};

/// The targets of a shader, as large as its tiles.
#[derive(Debug)]
pub(super) struct Canvas {
    /// By location.
    colours: Vec<Option<TextureView>>,
    depth: TextureView,
    tiles: Tiles,
}

/// A shader with what it draws in each view.
#[derive(Debug)]
pub(super) struct Prepared<'a> {
    pub(super) pass: &'a Pass,
    /// One for each view.
    pub(super) views: Vec<Ready>,
}

/// What all views have in common, and the part of each that is seen.
#[derive(Clone, Debug)]
pub(super) struct Views {
    /// Width and height of a frame.
    pub(super) frame: [u32; 2],
    pub(super) parts: Vec<Part>,
}

impl Canvas {
    pub(super) fn new(gpu: &Gpu, formats: &[Option<TextureFormat>], tiles: Tiles) -> Self {
        let image = |format: TextureFormat| {
            let texture = gpu.image(tiles.size(), format, TextureUsages::RENDER_ATTACHMENT);
            texture.create_view(&Default::default())
        };
        Self {
            colours: formats.iter().map(|format| format.map(image)).collect(),
            depth: image(DEPTH),
            tiles,
        }
    }

    /// Draws these instances, the views in turns, as many passes as their tiles need, each of which clears the picture.
    /// Without a shader the pictures are cleared all the same.
    pub(super) fn record(
        &self,
        views: &Views,
        shader: Option<&Prepared<'_>>,
        instances: Range<u32>,
        stamps: Option<Stamps<'_>>,
        encoder: &mut CommandEncoder,
    ) {
        let mut start = instances.start;
        while start < instances.end {
            let end = instances.end.min(start + self.tiles.count());
            let first = start == instances.start;
            let writes = Stamps::of_pass(&stamps, first, end == instances.end);
            let mut pass = self.cleared(writes, encoder);
            if let Some(shader) = shader {
                self.draw(views, shader, start..end, &mut pass);
            }
            start = end;
        }
    }

    /// Draws as many instances as there are tiles at most.
    pub(super) fn draw(
        &self,
        views: &Views,
        shader: &Prepared<'_>,
        instances: Range<u32>,
        pass: &mut wgpu::RenderPass<'_>,
    ) {
        let [width, height] = views.frame.map(|edge| edge as f32);
        for (tile, instance) in (0..).zip(instances) {
            let view = instance as usize % views.parts.len();
            let part = views.parts[view];
            let at = self.tiles.at(tile);
            let [x, y] = [0, 1].map(|i| at[i] as f32 - part.at[i] as f32);
            pass.set_viewport(x, y, width, height, 0.0, 1.0);
            pass.set_scissor_rect(at[0], at[1], part.size[0], part.size[1]);
            shader.pass.record(&shader.views[view], pass);
        }
    }

    /// A pass over the cleared picture.
    pub(super) fn cleared<'e>(
        &self,
        timestamp_writes: Option<wgpu::RenderPassTimestampWrites<'_>>,
        encoder: &'e mut CommandEncoder,
    ) -> wgpu::RenderPass<'e> {
        let colours: Vec<_> = self
            .colours
            .iter()
            .map(|view| {
                Some(wgpu::RenderPassColorAttachment {
                    view: view.as_ref()?,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                        store: wgpu::StoreOp::Store,
                    },
                })
            })
            .collect();
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: None,
            color_attachments: &colours,
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(1.0),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            timestamp_writes,
            ..Default::default()
        })
    }
}
