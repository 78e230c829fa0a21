//! Lane types: what a float is while a shader runs. `f32` is what a GPU computes.

/// Lanes in a block: 64 quads.
pub const LANES: usize = 256;

/// One 32-bit word a lane: the bits of an f32, an i32 or a u32; a bool is 0 or 1.
pub type Words = [u32; LANES];

/// Which lanes take part: one bit a lane, lane 0 in bit 0 of word 0. Lanes 4q..4q+3 are quad q:
/// top left, top right, bottom left, bottom right.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Mask(pub [u64; LANES / 64]);

impl Mask {
    /// The lanes that take part, in order.
    #[inline]
    pub fn lanes(self) -> impl Iterator<Item = usize> {
        let mut words = self.0;
        let mut i = 0;
        std::iter::from_fn(move || {
            while let Some(word) = words.get_mut(i) {
                if *word != 0 {
                    let lane = i * 64 + word.trailing_zeros() as usize;
                    *word &= *word - 1;
                    return Some(lane);
                }
                i += 1;
            }
            None
        })
    }
}
