//! Error sums on the device: what pictures differ by from their reference, without reading pictures back.
//!
//! ```text
//! Drawn, 4 x 4 fine pixels a pixel --average--> Reference     stays on the device
//! Reference x Drawn, one for each offset --add--> totals of each pixel
//! totals --finish--> [TileSum] of the frame                    read back for all frames at once
//! ```
//!
//! A tile is a workgroup: its 64 pixels are summed as f32, in pairs, always the same ones, and everything beyond tiles is
//! summed by the host as f64. By then a sum is off by less than its hundred-thousandth part.

use super::adapter::Gpu;
use super::compute;
use super::read::words_of;
use super::render::Drawn;
use super::resources::buffer;
use crate::scene::{Output, ToneMapping};
use crate::{Diagnostic, Result};
use wgpu::{BufferBindingType, BufferUsages};

/// The edge of a tile in pixels, and of a workgroup.
pub const TILE: u32 = 8;

/// Bytes of a pixel of the reference, of a pixel's totals and of a tile's sums.
const OF_REFERENCE: u64 = 32;
const OF_TOTALS: u64 = 64;
const OF_TILE: u64 = 16;

/// What the drawings of a frame differ by from the reference in a tile.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TileSum {
    /// The sum over pixels and drawings of squared differences, each the mean over channels and backgrounds.
    pub squares: f64,
    /// The reference's coverage in pixels.
    pub coverage: f64,
    /// The largest difference of one channel of one pixel, 0..1.
    pub max: f32,
    /// The sum over pixels of the variance from drawing to drawing, each the mean over channels and backgrounds.
    pub variance: f64,
}

/// The pipelines that add up errors.
#[derive(Debug)]
pub struct ErrorPass<'g> {
    gpu: &'g Gpu,
    layout: wgpu::BindGroupLayout,
    average: wgpu::ComputePipeline,
    add: wgpu::ComputePipeline,
    finish: wgpu::ComputePipeline,
}

/// The reference of a frame, on the device.
#[derive(Debug)]
pub struct Reference {
    size: [u32; 2],
    pixels: wgpu::Buffer,
}

/// A pixel of a reference: means over its samples, in linear light as a display shows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mean {
    /// Over a black background, 0..1, or NaN.
    pub black: [f32; 3],
    /// How much more over a white one.
    pub more: [f32; 3],
    /// The share of samples where anything is drawn.
    pub coverage: f32,
}

/// Error sums of frames of one size, on the device.
#[derive(Debug)]
pub struct Tally {
    size: [u32; 2],
    totals: wgpu::Buffer,
    tiles: wgpu::Buffer,
    /// How many frames there is room for.
    room: u32,
    /// For each frame, how many drawings it has.
    frames: Vec<u32>,
    /// Drawings of the frame that is not finished yet.
    drawings: u32,
}

/// What a dispatch is told: `Picture` of the shader.
#[derive(Clone, Copy, Debug, Default)]
struct Told {
    size: [u32; 2],
    grid: u32,
    output: Output,
    drawings: u32,
    first_tile: u32,
    blends: bool,
}

impl Told {
    fn bytes(self) -> Vec<u8> {
        let (output, tone_mapping, exposure) = match self.output {
            Output::Display => (0, 0, 1.0),
            Output::Encoded => (1, 0, 1.0),
            Output::Linear {
                exposure,
                tone_mapping,
            } => {
                let tone_mapping = match tone_mapping {
                    ToneMapping::None => 0,
                    ToneMapping::Reinhard => 1,
                    ToneMapping::Aces => 2,
                };
                (2, tone_mapping, exposure)
            }
        };
        let [width, height] = self.size;
        let words = [
            width,
            height,
            self.grid,
            output,
            tone_mapping,
            exposure.to_bits(),
            self.drawings,
            self.first_tile,
            self.blends.into(),
        ];
        words.iter().flat_map(|word| word.to_le_bytes()).collect()
    }
}

/// How many tiles a picture has across and down.
fn tiles([width, height]: [u32; 2]) -> [u32; 2] {
    [width.div_ceil(TILE), height.div_ceil(TILE)]
}

impl<'g> ErrorPass<'g> {
    /// Compiles the pipelines.
    ///
    /// # Errors
    /// When the device has no compute shaders, or the driver rejects these.
    pub fn new(gpu: &'g Gpu) -> Result<Self> {
        gpu.guarded("compiling the sums of errors", || {
            let device = gpu.device();
            let module = device.create_shader_module(wgpu::include_wgsl!("error.wgsl"));
            let storage = compute::buffer(BufferBindingType::Storage { read_only: false });
            let uniform = compute::buffer(BufferBindingType::Uniform);
            let texture = compute::WORDS;
            let types = [uniform, texture, texture, storage, storage, storage];
            let (layout, [average, add, finish]) =
                compute::pipelines(device, &module, &types, ["average", "add", "finish"]);
            Ok(Self {
                gpu,
                average,
                add,
                finish,
                layout,
            })
        })
    }

    /// The reference of a frame: what is drawn with `grid` fine pixels to a pixel along each axis, box-filtered in linear
    /// light as a display shows it. Each fine pixel that nothing was drawn to is background.
    ///
    /// # Errors
    /// When the device's memory is full, or it was lost.
    pub fn reference(&self, fine: &Drawn, grid: u32, output: Output) -> Result<Reference> {
        let size = fine.size().map(|edge| edge / grid);
        let pixels = self.room(u64::from(size[0]) * u64::from(size[1]) * OF_REFERENCE)?;
        let told = Told {
            size,
            grid,
            output,
            blends: fine.blends,
            ..Told::default()
        };
        let reference = Reference { size, pixels };
        self.gpu.guarded("averaging the reference", || {
            let unused = self.storage(OF_TOTALS);
            self.run(
                &self.average,
                told,
                fine,
                &reference,
                [&unused, &self.storage(OF_TILE)],
            );
            Ok(())
        })?;
        Ok(reference)
    }

    /// Sums of no drawing yet, with room for the tiles of so many frames of a size in pixels.
    ///
    /// # Errors
    /// When the device has no buffers of that size.
    pub fn tally(&self, size: [u32; 2], frames: u32) -> Result<Tally> {
        let pixels = u64::from(size[0]) * u64::from(size[1]);
        let [across, down] = tiles(size).map(u64::from);
        Ok(Tally {
            size,
            totals: self.room(pixels * OF_TOTALS)?,
            tiles: self.room(across * down * u64::from(frames) * OF_TILE)?,
            room: frames,
            frames: Vec::new(),
            drawings: 0,
        })
    }

    /// Adds a drawing to the frame that is being summed: one sample a pixel.
    ///
    /// # Errors
    /// When the device was lost.
    ///
    /// # Panics
    /// When the sizes differ.
    pub fn add(
        &self,
        tally: &mut Tally,
        reference: &Reference,
        drawn: &Drawn,
        output: Output,
    ) -> Result<()> {
        assert_eq!([reference.size, drawn.size()], [tally.size; 2]);
        tally.drawings += 1;
        let told = Told {
            size: tally.size,
            output,
            blends: drawn.blends,
            drawings: tally.drawings,
            ..Told::default()
        };
        self.gpu.guarded("adding up differences", || {
            self.run(
                &self.add,
                told,
                drawn,
                reference,
                [&tally.totals, &self.storage(OF_TILE)],
            );
            Ok(())
        })
    }

    /// Ends a frame: its sums are those of the drawings since the last one. `drawn` is any of them.
    ///
    /// # Errors
    /// When the device was lost.
    ///
    /// # Panics
    /// When there is no room for it.
    pub fn finish(&self, tally: &mut Tally, reference: &Reference, drawn: &Drawn) -> Result<()> {
        let at = tally.frames.len() as u32;
        assert!(at < tally.room, "no room for another frame");
        let [across, down] = tiles(tally.size);
        let told = Told {
            size: tally.size,
            drawings: tally.drawings,
            first_tile: at * across * down,
            ..Told::default()
        };
        self.gpu.guarded("adding up differences", || {
            self.run(
                &self.finish,
                told,
                drawn,
                reference,
                [&tally.totals, &tally.tiles],
            );
            Ok(())
        })?;
        tally.frames.push(tally.drawings);
        tally.drawings = 0;
        Ok(())
    }

    /// The sums of every finished frame, tile by tile, row by row.
    ///
    /// # Errors
    /// When the device was lost.
    pub fn sums(&self, tally: &Tally) -> Result<Vec<Vec<TileSum>>> {
        let [across, down] = tiles(tally.size);
        let of_frame = (across * down) as usize;
        let words = words_of(self.gpu, &tally.tiles)?;
        let sums = words.as_chunks::<4>().0.iter().map(|words| {
            let [squares, coverage, max, variance] = words.map(f32::from_bits);
            TileSum {
                squares: squares.into(),
                coverage: coverage.into(),
                max,
                variance: variance.into(),
            }
        });
        let sums: Vec<TileSum> = sums.collect();
        let frames = sums.chunks_exact(of_frame.max(1)).take(tally.frames.len());
        Ok(frames.map(<[TileSum]>::to_vec).collect())
    }

    /// Each pixel of a reference, row by row.
    ///
    /// # Errors
    /// When the device was lost.
    pub fn pixels(&self, reference: &Reference) -> Result<Vec<Mean>> {
        let words = words_of(self.gpu, &reference.pixels)?;
        let pixels = words.as_chunks::<8>().0.iter();
        Ok(pixels
            .map(|words| {
                let [r, g, b, coverage, more @ .., _] = words.map(f32::from_bits);
                Mean {
                    black: [r, g, b],
                    more,
                    coverage,
                }
            })
            .collect())
    }

    /// Runs a pipeline over all pixels of a picture.
    fn run(
        &self,
        pipeline: &wgpu::ComputePipeline,
        told: Told,
        drawn: &Drawn,
        reference: &Reference,
        [totals, tiles_of]: [&wgpu::Buffer; 2],
    ) {
        let device = self.gpu.device();
        let told_bytes = buffer(self.gpu, &told.bytes(), BufferBindingType::Uniform);
        let views = [&drawn.colour, &drawn.covered].map(|t| t.create_view(&Default::default()));
        let resources = [
            told_bytes.as_entire_binding(),
            wgpu::BindingResource::TextureView(&views[0]),
            wgpu::BindingResource::TextureView(&views[1]),
            reference.pixels.as_entire_binding(),
            totals.as_entire_binding(),
            tiles_of.as_entire_binding(),
        ];
        let entries: Vec<wgpu::BindGroupEntry<'_>> = (0..)
            .zip(resources)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        let bound = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &self.layout,
            entries: &entries,
        });
        let mut encoder = device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &bound, &[]);
        let [across, down] = tiles(told.size);
        pass.dispatch_workgroups(across, down, 1);
        drop(pass);
        self.gpu.queue().submit([encoder.finish()]);
    }

    /// A buffer that the shaders write to, of a size that the device has.
    fn room(&self, bytes: u64) -> Result<wgpu::Buffer> {
        let limits = self.gpu.device().limits();
        let most = limits
            .max_storage_buffer_binding_size
            .min(limits.max_buffer_size);
        if bytes > most {
            return Err(Diagnostic::error(format!(
                "the pictures are too large for `{}`: their sums want a buffer of {bytes} bytes, and it has {most}",
                self.gpu.label()
            ))
            .with_note("a smaller `resolution` in the scene does, or the evaluator"));
        }
        self.gpu
            .guarded("making room for sums", || Ok(self.storage(bytes)))
    }

    fn storage(&self, bytes: u64) -> wgpu::Buffer {
        self.gpu.device().create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: bytes.max(OF_TOTALS),
            usage: BufferUsages::STORAGE | BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        })
    }
}
