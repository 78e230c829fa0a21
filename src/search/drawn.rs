//! The same figures from pictures that a device drew: two shaders at a distance, without an evaluator.
//!
//! ```text
//! shader x Scene --renderer--> pictures on the device --error pass--> sums of tiles --> Details --> ErrorFigures
//! ```
//!
//! Frames, seeds and offsets are those of [`super::SampleSet`], all pixels of each; what is added up beyond tiles is
//! added up by the same code.

use super::samples::{OverBlack, offsets};
use crate::Result;
use crate::error::{
    BACKGROUNDS, Details, ErrorFigures, FrameError, GRID, Reference, ReferencePixel, Shown,
    displayed, encoded, through,
};
use crate::eval::image::Picture;
use crate::eval::raster::Frame;
use crate::gpu::error::{self, ErrorPass, Mean, TileSum};
use crate::gpu::{Drawn, Gpu, Pipeline, Renderer, Stages};
use crate::scene::{Output, Scene, chance::child};

/// Draws and measures on a device.
#[derive(Debug)]
pub struct Device<'g> {
    renderer: Renderer<'g>,
    errors: ErrorPass<'g>,
}

/// A shader on the device, and the scene as it is for that shader.
#[derive(Debug)]
pub struct Compiled<'a> {
    pipeline: Pipeline,
    scene: &'a Scene,
}

impl<'g> Device<'g> {
    /// A device that nothing has been drawn on yet.
    ///
    /// # Errors
    /// When it has no compute shaders.
    pub fn new(gpu: &'g Gpu) -> Result<Self> {
        Ok(Self {
            renderer: Renderer::new(gpu),
            errors: ErrorPass::new(gpu)?,
        })
    }

    /// The device itself.
    pub fn gpu(&self) -> &'g Gpu {
        self.renderer.gpu()
    }

    /// Compiles a shader for its scene.
    ///
    /// # Errors
    /// When the device cannot draw it.
    pub fn compile<'a>(&self, stages: Stages<'_>, scene: &'a Scene) -> Result<Compiled<'a>> {
        Ok(Compiled {
            pipeline: self.renderer.pipeline(stages, scene)?,
            scene,
        })
    }

    /// The error figures of the second shader against the first, the original, and its FLIP, over all samples of their
    /// scene at a distance. `drawn` is called after each picture.
    ///
    /// # Errors
    /// When the device cannot: its memory is full, it was lost, or a frame lacks what a shader reads.
    pub fn compare(
        &mut self,
        shaders: [&Compiled<'_>; 2],
        distance: f64,
        drawn: &dyn Fn(),
    ) -> Result<(ErrorFigures, f64)> {
        let scene = shaders[0].scene;
        let frames = scene.frames(distance);
        let mut tallies = Vec::new();
        for _ in shaders {
            tallies.push(self.errors.tally(scene.resolution, frames.len() as u32)?);
        }
        let (mut flip, mut looked_at) = (0.0, 0);
        for (index, frame) in frames.iter().enumerate() {
            let fine = self.draw(shaders[0], frame, [0.0; 2], GRID)?;
            let reference = self.errors.reference(&fine, GRID, scene.output)?;
            drop(fine);
            drawn();
            let offsets = offsets(scene.offsets, child(scene.seed, index as u64));
            for (which, (shader, tally)) in shaders.iter().zip(&mut tallies).enumerate() {
                let mut last = None;
                for (at, offset) in offsets.iter().enumerate() {
                    let picture = self.draw(shader, frame, *offset, 1)?;
                    self.errors.add(tally, &reference, &picture, scene.output)?;
                    if (which, at) == (1, 0) {
                        let pixels = self.errors.pixels(&reference)?;
                        let picture = picture.picture(self.gpu())?;
                        let (sum, count) = flip_of(&pixels, &picture, scene);
                        flip += sum;
                        looked_at += count;
                    }
                    drawn();
                    last = Some(picture);
                }
                if let Some(last) = last {
                    self.errors.finish(tally, &reference, &last)?;
                }
            }
        }
        let drawings = scene.offsets as u32;
        let mut details = Vec::new();
        for tally in &tallies {
            let sums = self.errors.sums(tally)?;
            let of_frame = sums.iter().enumerate().map(|(index, tiles)| {
                let view = index / scene.uniform_samples();
                (view, FrameError::of_tiles(tiles, drawings))
            });
            details.push(Details::new(of_frame));
        }
        let bound = (scene.bound(distance), scene.reading);
        let figures = ErrorFigures::new(&details[1], &details[0], bound);
        Ok((figures, flip / looked_at.max(1) as f64))
    }

    /// A shader's pictures, as [`super::SampleSet::pictures`] has them.
    ///
    /// # Errors
    /// As [`Device::compare`].
    pub fn pictures(
        &mut self,
        shader: &Compiled<'_>,
        distance: f64,
        drawn: &dyn Fn(),
    ) -> Result<Vec<OverBlack>> {
        let scene = shader.scene;
        let frames = scene.frames(distance);
        let mut pictures = Vec::new();
        for frame in frames.iter().step_by(scene.uniform_samples()) {
            let picture = self.draw(shader, frame, [0.0; 2], 1)?;
            let picture = picture.picture(self.gpu())?;
            drawn();
            pictures.push(OverBlack {
                width: picture.width,
                height: picture.height,
                pixels: shown(&picture, (scene.output, scene.blends()))
                    .map(|[black, _]| black)
                    .collect(),
            });
        }
        Ok(pictures)
    }

    /// Draws a frame as the shader's own scene has it.
    fn draw(
        &mut self,
        shader: &Compiled<'_>,
        frame: &Frame,
        offset: [f32; 2],
        grid: u32,
    ) -> Result<Drawn> {
        let frame = Frame {
            offset,
            grid,
            ..shader.scene.again(frame)
        };
        self.renderer.draw(&shader.pipeline, shader.scene, &frame)
    }
}

/// What a display shows of a picture's pixels, row by row.
fn shown(picture: &Picture, (output, blends): (Output, bool)) -> impl Iterator<Item = Shown> + '_ {
    let pixels = picture.pixels.iter().zip(&picture.covered);
    pixels.map(move |(colour, covered)| {
        if *covered == 0.0 {
            return BACKGROUNDS;
        }
        let black = displayed(output, *colour);
        let more = match blends {
            true => through(output, *colour),
            false => [0.0; 3],
        };
        let white = std::array::from_fn(|i| black[i] + more[i]);
        [black, white].map(encoded)
    })
}

/// The sum of FLIP over the pixels that a reference or a picture covers, and how many those are.
fn flip_of(reference: &[Mean], picture: &Picture, scene: &Scene) -> (f64, usize) {
    let width = picture.width;
    let shown: Vec<Shown> = shown(picture, (scene.output, scene.blends())).collect();
    let pixels = reference.iter().zip(&picture.covered).enumerate();
    let seen: Vec<usize> = pixels
        .filter(|(_, (pixel, covered))| pixel.coverage > 0.0 || **covered > 0.0)
        .map(|(at, _)| at)
        .collect();
    let reference = Reference::new(seen.iter().map(|&at| {
        let mean = reference[at];
        let place = [at as u32 % width, at as u32 / width];
        (
            place,
            ReferencePixel::new(mean.black, mean.more),
            mean.coverage,
        )
    }));
    let colours: Vec<Shown> = seen.iter().map(|&at| shown[at]).collect();
    reference.flip(&colours, scene.pixels_per_degree)
}

// Tiles are the same ones, or the worst of them would be another.
const _: () = assert!(error::TILE == crate::error::TILE);

impl FrameError {
    /// From the sums of a frame's tiles over so many drawings.
    fn of_tiles(tiles: &[TileSum], drawings: u32) -> Self {
        let mut frame = Self::default();
        for tile in tiles {
            frame.add_tile(tile.squares, tile.coverage, drawings);
            frame.sum.max = frame.sum.max.max(tile.max);
            frame.variance += tile.variance;
        }
        frame
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Tally;
    use crate::gpu::AdapterLabel;
    use crate::scene::ToneMapping;

    /// Pictures of so many fine pixels a pixel, of any light that a shader can return; alpha is that of a target.
    fn picture(seed: u64, [width, height]: [u32; 2]) -> Picture {
        let mut picture = Picture::empty(width, height);
        let odd = [
            f32::NAN,
            f32::INFINITY,
            f32::NEG_INFINITY,
            f32::MAX,
            -0.25,
            1e-6,
            0.0,
            1.5,
        ];
        for (at, (pixel, covered)) in picture
            .pixels
            .iter_mut()
            .zip(&mut picture.covered)
            .enumerate()
        {
            let number = |i: u64| crate::scene::chance::unit(child(child(seed, at as u64), i));
            if number(0) < 0.3 {
                continue;
            }
            *covered = 1.0;
            *pixel = [1, 2, 3, 4].map(|i| match number(10 + i) < 0.02 && i < 4 {
                true => odd[(number(20 + i) * odd.len() as f64) as usize],
                false => number(i) as f32,
            });
        }
        picture
    }

    /// What the evaluator's own code makes of the same pictures.
    fn on_the_host(
        fine: &Picture,
        drawings: &[Picture],
        (output, blends): (Output, bool),
    ) -> FrameError {
        let (mut linear, mut more) = (fine.clone(), fine.clone());
        for (at, covered) in fine.covered.iter().enumerate() {
            let colour = fine.pixels[at];
            more.pixels[at] = [1.0; 4];
            if *covered > 0.0 {
                let [r, g, b] = displayed(output, colour);
                linear.pixels[at] = [r, g, b, 1.0];
                more.pixels[at] = [0.0; 4];
                if blends {
                    let [r, g, b] = through(output, colour);
                    more.pixels[at] = [r, g, b, 1.0];
                }
            }
        }
        let (mean, more) = (linear.box_filtered(GRID), more.box_filtered(GRID));
        let reference = Reference::new((0..mean.pixels.len()).map(|at| {
            let [r, g, b, _] = mean.pixels[at];
            let [more @ .., _] = more.pixels[at];
            let place = [at as u32 % mean.width, at as u32 / mean.width];
            let pixel = ReferencePixel::new([r, g, b], more);
            (place, pixel, mean.covered[at])
        }));
        let mut tally = Tally::new(&reference);
        for drawing in drawings {
            tally.add(&shown(drawing, (output, blends)).collect::<Vec<_>>());
        }
        tally.finish()
    }

    fn assert_close(found: &FrameError, host: &FrameError, what: &str) {
        // Sums of a tile are rounded to f32 at each of some hundred steps.
        let close = |found: f64, host: f64, what: &str| {
            let off = (found - host).abs();
            assert!(
                off <= 1e-5 * host.abs() + 1e-7,
                "{what}: {found}, not {host}"
            );
        };
        close(found.sum.squares, host.sum.squares, what);
        close(found.sum.coverage, host.sum.coverage, what);
        close(found.sum.max.into(), host.sum.max.into(), what);
        close(found.coverage, host.coverage, what);
        close(found.variance, host.variance, what);
        assert_eq!(found.tiles.len(), host.tiles.len(), "{what}");
        for (found, host) in found.tiles.iter().zip(&host.tiles) {
            close(*found, *host, what);
        }
    }

    /// Every device of this machine. Where there is none and need not be one, a word about it.
    fn devices() -> Vec<Gpu> {
        let labels = crate::gpu::list();
        if labels.is_empty() {
            let absent = Gpu::open(None).unwrap_err();
            assert!(std::env::var_os("CI").is_none(), "{absent}");
            eprintln!("SKIPPED: sums of errors on a device: {absent}");
        }
        if std::env::var_os("CI").is_some() {
            for backend in ["Vulkan", "OpenGL"] {
                let found = labels.iter().any(|label| label.backend == backend);
                assert!(found, "no adapter of {backend} among {labels:?}");
            }
        }
        let open = |label: &AdapterLabel| Gpu::open(Some(&label.to_string())).unwrap();
        labels.iter().map(open).collect()
    }

    #[test]
    fn sums_on_a_device_are_those_of_the_host() {
        for gpu in devices() {
            compare_sums(&gpu);
        }
    }

    fn compare_sums(gpu: &Gpu) {
        let errors = ErrorPass::new(gpu).unwrap();
        let light = |tone_mapping| Output::Linear {
            exposure: 1.7,
            tone_mapping,
        };
        let outputs = [
            (Output::Display, false),
            (Output::Encoded, false),
            (light(ToneMapping::None), false),
            (light(ToneMapping::Reinhard), false),
            (light(ToneMapping::Aces), false),
            (Output::Display, true),
            (Output::Encoded, true),
            (light(ToneMapping::Reinhard), true),
        ];
        // No whole number of tiles in either direction.
        let size = [21, 13];
        for (seed, (output, blends)) in (0..).zip(outputs) {
            let mut tally = errors.tally(size, 3).unwrap();
            let mut host = Vec::new();
            for (frame, count) in [4, 1, 3].into_iter().enumerate() {
                let seed = child(seed, frame as u64);
                let fine = picture(seed, size.map(|edge| edge * GRID));
                let drawings: Vec<Picture> =
                    (0..count).map(|i| picture(child(seed, i), size)).collect();
                host.push(on_the_host(&fine, &drawings, (output, blends)));
                let fine = Drawn::of_picture(gpu, &fine, blends);
                let reference = errors.reference(&fine, GRID, output).unwrap();
                let drawn: Vec<Drawn> = drawings
                    .iter()
                    .map(|d| Drawn::of_picture(gpu, d, blends))
                    .collect();
                for drawn in &drawn {
                    errors.add(&mut tally, &reference, drawn, output).unwrap();
                }
                errors.finish(&mut tally, &reference, &drawn[0]).unwrap();
            }
            let found = errors.sums(&tally).unwrap();
            assert_eq!(found.len(), host.len());
            for ((tiles, host), count) in found.iter().zip(&host).zip([4, 1, 3]) {
                let what = format!(
                    "{output:?}, blended {blends}, {count} drawings, on {}",
                    gpu.label()
                );
                assert_close(&FrameError::of_tiles(tiles, count), host, &what);
            }
            assert!(host[0].variance > 0.0 && host[1].variance == 0.0 && host[0].sum.max == 1.0);
            // The same bits each time.
            assert_eq!(errors.sums(&tally).unwrap(), found);
        }
    }

    #[test]
    fn what_does_not_vary_does_not_shimmer() {
        let Some(gpu) = devices().into_iter().next() else {
            return;
        };
        let errors = ErrorPass::new(&gpu).unwrap();
        let size = [16, 16];
        let (fine, same) = (picture(1, size.map(|edge| edge * GRID)), picture(2, size));
        let reference = errors
            .reference(
                &Drawn::of_picture(&gpu, &fine, false),
                GRID,
                Output::Display,
            )
            .unwrap();
        let drawn = Drawn::of_picture(&gpu, &same, false);
        let mut tally = errors.tally(size, 1).unwrap();
        for _ in 0..4 {
            errors
                .add(&mut tally, &reference, &drawn, Output::Display)
                .unwrap();
        }
        errors.finish(&mut tally, &reference, &drawn).unwrap();
        let found = FrameError::of_tiles(&errors.sums(&tally).unwrap()[0], 4);
        assert!(found.variance == 0.0 && found.sum.squares > 0.0);
    }
}
