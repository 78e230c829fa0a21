//! Pictures read back from the device, as the evaluator gives them.

use super::adapter::Gpu;
use super::pass::COLOUR;
use super::render::Drawn;
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

#[cfg(test)]
impl Drawn {
    /// A picture on the device, as if it had been drawn there.
    pub(crate) fn of_picture(gpu: &Gpu, picture: &Picture, blends: bool) -> Self {
        use super::pass::COVERED;
        use wgpu::util::DeviceExt;
        let texture = |format, words: Vec<u32>| {
            let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
            let descriptor = wgpu::TextureDescriptor {
                label: None,
                size: wgpu::Extent3d {
                    width: picture.width,
                    height: picture.height,
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC,
                view_formats: &[],
            };
            let order = wgpu::util::TextureDataOrder::LayerMajor;
            let device = gpu.device();
            device.create_texture_with_data(gpu.queue(), &descriptor, order, &bytes)
        };
        let colours = picture.pixels.iter().flatten();
        let covered = picture.covered.iter();
        Self {
            colour: texture(COLOUR, colours.map(|c| c.to_bits()).collect()),
            covered: texture(COVERED, covered.map(|c| u32::from(*c > 0.0)).collect()),
            blends,
        }
    }
}

/// All components of all texels, row by row, of a texture of words.
fn words(gpu: &Gpu, texture: &wgpu::Texture) -> Result<Vec<u32>> {
    gpu.guarded("reading a picture", || {
        let texel = if texture.format() == COLOUR { 16 } else { 4 };
        let bytes = texel * texture.width();
        let row = bytes.next_multiple_of(ROW);
        let size = u64::from(row) * u64::from(texture.height());
        let all = mapped(gpu, size, |encoder, buffer| {
            encoder.copy_texture_to_buffer(
                texture.as_image_copy(),
                wgpu::TexelCopyBufferInfo {
                    buffer,
                    layout: wgpu::TexelCopyBufferLayout {
                        offset: 0,
                        bytes_per_row: Some(row),
                        rows_per_image: None,
                    },
                },
                texture.size(),
            );
        })?;
        let rows = all.chunks_exact((row / 4) as usize);
        Ok(rows
            .flat_map(|row| &row[..(bytes / 4) as usize])
            .copied()
            .collect())
    })
}

/// All words of a buffer.
pub(super) fn words_of(gpu: &Gpu, buffer: &wgpu::Buffer) -> Result<Vec<u32>> {
    gpu.guarded("reading sums", || {
        mapped(gpu, buffer.size(), |encoder, copy| {
            encoder.copy_buffer_to_buffer(buffer, 0, copy, 0, buffer.size());
        })
    })
}

/// The words that a copy to a buffer of so many bytes leaves there.
fn mapped(
    gpu: &Gpu,
    size: u64,
    copy: impl FnOnce(&mut wgpu::CommandEncoder, &wgpu::Buffer),
) -> Result<Vec<u32>> {
    let buffer = gpu.device().create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size,
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device().create_command_encoder(&Default::default());
    copy(&mut encoder, &buffer);
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
    let words = mapped.as_chunks::<4>().0.iter();
    Ok(words.map(|word| u32::from_le_bytes(*word)).collect())
}
