//! The error of pictures against the reference: DESIGN's `E`, with its constants stated.
//!
//! ```text
//! fragment --display--> what a display shows of it
//! 4 x 4 fine pixels --pixel--> ReferencePixel      what it should show
//! reference x drawings --tally--> FrameError       one frame: sums, tiles, shimmer
//! [FrameError] x [FrameError] --figures--> ErrorFigures    a level against the original and the bound
//!                            --held_out--> HeldOut         the same on pictures that decided nothing
//! ```
//!
//! Colours are compared as a display shows them: sRGB-encoded, clamped to 0..1, premultiplied with
//! coverage, as the mean over a black and a white background and three channels. The sum runs over
//! the pixels that the reference or the picture covers, and is divided by the reference's coverage.
//! This is eq. 6 of Liang 2022; the RMSE is its root.

mod display;
mod figures;
mod flip;
mod held_out;
mod pixel;
mod shown;
mod tally;

pub use display::{displayed, encoded, held, through};
pub use figures::{Details, ErrorFigures};
pub use held_out::HeldOut;
pub(crate) use held_out::exceeds;
pub(crate) use pixel::{BACKGROUNDS, ReferencePixel, Shown};
#[cfg(feature = "mesh")]
pub(crate) use shown::Means;
pub(crate) use shown::{colours, over_black, reference_of};
pub use tally::ErrorSum;
pub(crate) use tally::{FrameError, Reference, TILE, Tally};

/// Samples of the reference in a pixel, along each axis.
pub(crate) const GRID: u32 = 4;
