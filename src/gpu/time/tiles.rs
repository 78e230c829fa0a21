//! Many instances in one picture, each at the size that it has on screen, on pixels of its own.
//!
//! A host draws an object among others, so what counts is how long one more takes. One small object alone would measure how
//! long it takes to begin: so as many are drawn as fill the time of a batch. Were they drawn over each other, the depth
//! test would hide all but the first; so each gets a tile. Its viewport is the whole frame, moved so that the object
//! falls into the tile, and what is seen there is what the frame shows, to the same quads of pixels.

use crate::eval::lane::LANES;
use crate::eval::program::Program;
use crate::eval::raster::{Coverage, Frame, rasterize};
use crate::gpu::render::Stages;

/// What tiles are aligned to, in pixels: quads and small blocks of pixels stay what they are in the frame.
const ALIGNED: u32 = 8;

/// The pixels of a frame that an object covers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Part {
    pub(super) at: [u32; 2],
    pub(super) size: [u32; 2],
}

impl Part {
    /// Those that a shader's own stages cover, before it discards any; where the evaluator cannot tell, the whole frame.
    pub(super) fn of(programs: Option<&(Program, Program)>, frame: &Frame) -> Self {
        let whole = Self {
            at: [0; 2],
            size: [frame.width, frame.height],
        };
        let Some((vertex, fragment)) = programs else {
            return whole;
        };
        let covered = covered(&rasterize(vertex, fragment, frame));
        let Some([low, high]) = covered else {
            // Its vertices take their time all the same.
            return Self {
                at: [0; 2],
                size: whole.size.map(|edge| edge.min(ALIGNED)),
            };
        };
        let at = low.map(|edge| edge / ALIGNED * ALIGNED);
        let end = [0, 1].map(|i| (high[i] + 1).next_multiple_of(ALIGNED).min(whole.size[i]));
        Self {
            at,
            size: [end[0] - at[0], end[1] - at[1]],
        }
    }

    /// The programs of a shader's stages, where the evaluator has them.
    pub(super) fn programs(stages: Stages<'_>) -> Option<(Program, Program)> {
        let compile = |(module, at)| Program::compile(module, at, &[]).ok();
        Some((compile(stages.vertex)?, compile(stages.fragment)?))
    }
}

/// The least and the largest pixel that is covered, along each axis.
fn covered(coverage: &Coverage) -> Option<[[u32; 2]; 2]> {
    let mut found: Option<[[u32; 2]; 2]> = None;
    for block in &coverage.blocks {
        for pixel in (0..LANES).map(|lane| block.pixels[lane]) {
            if pixel == u32::MAX {
                continue;
            }
            let at = [pixel % coverage.width, pixel / coverage.width];
            let [low, high] = found.get_or_insert([at, at]);
            for i in 0..2 {
                low[i] = low[i].min(at[i]);
                high[i] = high[i].max(at[i]);
            }
        }
    }
    found
}

/// Tiles of one size in a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Tiles {
    tile: [u32; 2],
    columns: u32,
    rows: u32,
}

impl Tiles {
    /// Tiles that hold any of these parts, so many of them or as many as a picture of so many pixels along each edge has
    /// room for.
    pub(super) fn new(parts: &[Part], count: u32, edge: u32) -> Self {
        let tile = [0, 1].map(|i| parts.iter().map(|p| p.size[i]).max().unwrap_or(1));
        let fit = tile.map(|own| (edge / own).max(1));
        // As square as may be.
        let wanted = f64::from(count) * f64::from(tile[1]) / f64::from(tile[0]);
        let columns = (wanted.sqrt().ceil() as u32).clamp(1, fit[0]);
        let rows = count.div_ceil(columns).clamp(1, fit[1]);
        Self {
            tile,
            columns,
            rows,
        }
    }

    /// How many there are.
    pub(super) fn count(&self) -> u32 {
        self.columns * self.rows
    }

    /// The picture's width and height.
    pub(super) fn size(&self) -> [u32; 2] {
        [self.columns * self.tile[0], self.rows * self.tile[1]]
    }

    /// Where a tile begins.
    pub(super) fn at(&self, tile: u32) -> [u32; 2] {
        let [width, height] = self.tile;
        [
            tile % self.columns * width,
            tile / self.columns % self.rows * height,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(size: [u32; 2]) -> Part {
        Part { at: [0; 2], size }
    }

    #[test]
    fn tiles_lie_apart_and_within_the_picture() {
        let parts = [part([24, 40]), part([32, 8])];
        for count in [1, 5, 100, 5000] {
            let tiles = Tiles::new(&parts, count, 512);
            let [width, height] = tiles.size();
            assert!(width <= 512 && height <= 512 && tiles.count() >= count.min(192));
            let mut all: Vec<[u32; 2]> = (0..tiles.count()).map(|tile| tiles.at(tile)).collect();
            assert!(all.iter().all(|[x, y]| x + 32 <= width && y + 40 <= height));
            all.sort_unstable();
            all.dedup();
            assert_eq!(all.len(), tiles.count() as usize);
        }
        // One that is larger than the picture should be has it alone.
        assert_eq!(Tiles::new(&[part([600, 8])], 9, 512).size(), [600, 72]);
    }
}
