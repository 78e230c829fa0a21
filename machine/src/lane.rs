//! Lane types: what a float is while a shader runs. `f32` is what a GPU computes.

use super::machine::Kernels;

/// Lanes in a block: 64 quads.
pub const LANES: usize = 256;

/// One 32-bit word a lane: the bits of an f32, an i32 or a u32; a bool is 0 or 1.
pub type Words = [u32; LANES];

/// A number that shaders compute with. Integers and bools are words whatever it is.
pub trait Lane: Kernels {
    /// A block as `f32`s, which textures are read with: in `scratch`, unless it is one already.
    fn floats<'a>(block: &'a [Self; LANES], scratch: &'a mut [f32; LANES]) -> &'a [f32; LANES];
}

impl Lane for f32 {
    fn floats<'a>(block: &'a [Self; LANES], _: &'a mut [f32; LANES]) -> &'a [f32; LANES] {
        block
    }
}

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

    /// All lanes.
    pub const ALL: Self = Self([u64::MAX; LANES / 64]);

    /// Whether there is no lane.
    pub fn is_empty(self) -> bool {
        self.0.iter().all(|&word| word == 0)
    }

    /// How many lanes there are.
    pub fn count(self) -> u32 {
        self.0.iter().map(|word| word.count_ones()).sum()
    }

    /// Whether a lane is there.
    pub fn has(self, lane: usize) -> bool {
        self.0[lane / 64] >> (lane % 64) & 1 == 1
    }

    /// The lanes of both.
    pub fn and(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] & other.0[i]))
    }

    /// The lanes of either.
    pub fn or(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] | other.0[i]))
    }

    /// The lanes that the other one has not.
    pub fn without(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] & !other.0[i]))
    }

    /// All lanes of the quads of which there is a lane.
    pub fn quads(self) -> Self {
        Self(self.0.map(|word| {
            let any = (word | word >> 1 | word >> 2 | word >> 3) & 0x1111_1111_1111_1111;
            any * 15
        }))
    }

    /// The lanes whose bool is true. A lane that does not run may hold any word where others hold a bool:
    /// it decides about itself alone.
    pub(crate) fn from_words(words: &Words) -> Self {
        let half = |words: &[u32]| {
            let mut bits = 0;
            for (i, &word) in words.iter().enumerate() {
                bits |= (word & 1) << i;
            }
            u64::from(bits)
        };
        Self(std::array::from_fn(|i| {
            let words = &words[i * 64..i * 64 + 64];
            half(&words[..32]) | half(&words[32..]) << 32
        }))
    }

    /// 1 for each lane that is there, else 0.
    pub(crate) fn to_words(self, words: &mut Words) {
        for (i, words) in words.chunks_exact_mut(32).enumerate() {
            let bits = (self.0[i / 2] >> (i % 2 * 32)) as u32;
            for (j, word) in words.iter_mut().enumerate() {
                *word = bits >> j & 1;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn masks_and_words_correspond() {
        let mask = Mask([1 << 63 | 5, 0, 0xFFFF_0000_0000_0001, 1 << 32]);
        let mut words = [9; LANES];
        mask.to_words(&mut words);
        assert_eq!(Mask::from_words(&words), mask);
        assert!((0..LANES).all(|lane| mask.has(lane) == (words[lane] == 1)));
        assert_eq!(mask.count(), words.iter().sum::<u32>());
    }

    #[test]
    fn words_that_are_no_bools_stay_with_their_lane() {
        for lane in [0, 31, 40, 255] {
            let mut words = [0; LANES];
            words[lane] = u32::MAX;
            let elsewhere = Mask::from_words(&words)
                .lanes()
                .find(|&other| other != lane);
            assert_eq!(elsewhere, None, "lane {lane}");
        }
    }

    #[test]
    fn quads_are_whole() {
        let mask = Mask([0b0100_0000_1000, 0, 0, 1 << 63]);
        assert_eq!(mask.quads(), Mask([0xF0F, 0, 0, 15 << 60]));
    }
}
