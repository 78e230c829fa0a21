//! Pictures read back from the device, as the evaluator gives them.

use super::adapter::Gpu;
use super::render::{COLOUR, Drawn};
use crate::eval::image::Picture;
use crate::{Diagnostic, Result};

/// What rows are aligned to in a copy, in bytes.
const ROW: u32 = wgpu::COPY_BYTES_PER_ROW_ALIGNMENT;

impl Drawn {
    /// Width and height in fine pixels.
    pub fn size(&self) -> [u32; 2] {
        [self.colour.width(), self.colour.height()]
    }

    /// The picture in fine pixels: colours where something is drawn, 0 elsewhere.
    ///
    /// # Errors
    /// When the device was lost, or its memory is full.
    pub fn picture(&self, gpu: &Gpu) -> Result<Picture> {
        let colours = words(gpu, &self.colour)?;
        let covered = words(gpu, &self.covered)?;
        let colours = colours.as_chunks::<4>().0.iter();
        let [width, height] = self.size();
        Ok(Picture {
            width,
            height,
            pixels: colours.map(|bits| bits.map(f32::from_bits)).collect(),
            covered: covered.into_iter().map(|covered| covered as f32).collect(),
        })
    }
}

/// All components of all texels, row by row, of a texture of words.
fn words(gpu: &Gpu, texture: &wgpu::Texture) -> Result<Vec<u32>> {
    gpu.guarded("reading a picture", || {
        let texel = if texture.format() == COLOUR { 16 } else { 4 };
        let bytes = texel * texture.width();
        let row = bytes.next_multiple_of(ROW);
        let buffer = gpu.device().create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(row) * u64::from(texture.height()),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = gpu.device().create_command_encoder(&Default::default());
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(row),
                    rows_per_image: None,
                },
            },
            texture.size(),
        );
        gpu.queue().submit([encoder.finish()]);
        let failed = |error: &dyn std::fmt::Display| {
            Diagnostic::error("a picture cannot be read from the device").with_reason(error)
        };
        let slice = buffer.slice(..);
        let (send, receive) = std::sync::mpsc::channel();
        slice.map_async(wgpu::MapMode::Read, move |mapped| {
            // Whoever waits has not gone away.
            let _ = send.send(mapped);
        });
        let waited = gpu.device().poll(wgpu::PollType::wait_indefinitely());
        waited.map_err(|error| failed(&error))?;
        let mapped = receive.recv().map_err(|error| failed(&error))?;
        mapped.map_err(|error| failed(&error))?;
        let mapped = slice.get_mapped_range().map_err(|error| failed(&error))?;
        let mut all = Vec::new();
        for row in mapped.chunks_exact(row as usize) {
            let words = row[..bytes as usize].as_chunks::<4>().0;
            all.extend(words.iter().map(|word| u32::from_le_bytes(*word)));
        }
        Ok(all)
    })
}
