//! Lane types: what a float is while a shader runs. `f32` is what a GPU computes.

/// Lanes in a block: 64 quads.
pub const LANES: usize = 256;

/// One 32-bit word a lane: the bits of an f32, an i32 or a u32; a bool is 0 or 1.
pub type Words = [u32; LANES];

/// Which lanes take part: one bit a lane, lane 0 in bit 0 of word 0. Lanes 4q..4q+3 are quad q:
/// top left, top right, bottom left, bottom right.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Mask(pub [u64; LANES / 64]);
