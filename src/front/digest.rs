//! BLAKE3, the hash that locks and reports hold files by. Written out here, since a build script that replays a lock needs this much of
//! it, and crates for it bring a C compiler's driver and five more.
//!
//! ```text
//! bytes --chunks of 1024--> blocks of 64 --compress, one after another--> a chaining value a chunk
//! chaining values --compress, two by two--> the root's: the hash
//! ```
//!
//! This work is based on: Jack O'Connor, Jean-Philippe Aumasson, Samuel Neves, Zooko Wilcox-O'Hearn, "BLAKE3: one function, fast
//! everywhere", 2020, section 2.

/// Bytes of a chunk, a leaf of the tree.
const CHUNK: usize = 1024;

/// Bytes that are compressed at once.
const BLOCK: usize = 64;

/// How many rounds a compression has.
const ROUNDS: usize = 7;

/// The first chaining value: that of SHA-256.
const START: [u32; 8] = [
    0x6a09_e667,
    0xbb67_ae85,
    0x3c6e_f372,
    0xa54f_f53a,
    0x510e_527f,
    0x9b05_688c,
    0x1f83_d9ab,
    0x5be0_cd19,
];

/// Where the words of a block come from in the next round.
const PERMUTED: [usize; 16] = [2, 6, 3, 10, 7, 0, 4, 13, 1, 11, 12, 5, 9, 14, 15, 8];

/// The words of a block in the order in which each round takes them.
const ORDERS: [[usize; 16]; ROUNDS] = {
    let mut orders = [[0; 16]; ROUNDS];
    let mut round = 0;
    while round < ROUNDS {
        let mut at = 0;
        while at < 16 {
            orders[round][at] = match round {
                0 => at,
                _ => orders[round - 1][PERMUTED[at]],
            };
            at += 1;
        }
        round += 1;
    }
    orders
};

/// What a compression is of.
mod role {
    pub(super) const FIRST_OF_CHUNK: u32 = 1;
    pub(super) const LAST_OF_CHUNK: u32 = 2;
    pub(super) const PARENT: u32 = 4;
    pub(super) const ROOT: u32 = 8;
}

/// The hash of bytes, as 64 hexadecimal digits.
pub(crate) fn digest(bytes: &[u8]) -> String {
    let words = Last::of(bytes, 0).value(role::ROOT);
    let digits = words.iter().flat_map(|word| word.to_le_bytes());
    digits.map(|byte| format!("{byte:02x}")).collect()
}

/// The last compression of a subtree, which is another one where that is the root.
struct Last {
    chaining: [u32; 8],
    block: [u32; 16],
    length: u32,
    counter: u64,
    role: u32,
}

impl Last {
    /// Of bytes that begin with the chunk of this number.
    fn of(bytes: &[u8], chunk: u64) -> Self {
        if bytes.len() <= CHUNK {
            return Self::of_chunk(bytes, chunk);
        }
        // The left half is as large a power of two of chunks as leaves something for the right one.
        let left = bytes.len().div_ceil(CHUNK).next_power_of_two() / 2;
        let (before, behind) = bytes.split_at(left * CHUNK);
        let mut block = [0; 16];
        block[..8].copy_from_slice(&Self::of(before, chunk).value(0));
        block[8..].copy_from_slice(&Self::of(behind, chunk + left as u64).value(0));
        Self {
            chaining: START,
            block,
            length: BLOCK as u32,
            counter: 0,
            role: role::PARENT,
        }
    }

    fn of_chunk(bytes: &[u8], chunk: u64) -> Self {
        let mut last = Self {
            chaining: START,
            block: [0; 16],
            length: 0,
            counter: chunk,
            role: role::FIRST_OF_CHUNK,
        };
        for (number, part) in bytes.chunks(BLOCK).enumerate() {
            if number > 0 {
                last.chaining = last.value(0);
                last.role = 0;
            }
            let mut padded = [0; BLOCK];
            padded[..part.len()].copy_from_slice(part);
            let (words, _) = padded.as_chunks();
            for (to, word) in last.block.iter_mut().zip(words) {
                *to = u32::from_le_bytes(*word);
            }
            last.length = part.len() as u32;
        }
        last.role |= role::LAST_OF_CHUNK;
        last
    }

    /// Its chaining value, in a role besides its own.
    fn value(&self, role: u32) -> [u32; 8] {
        let mut state = [0; 16];
        state[..8].copy_from_slice(&self.chaining);
        state[8..12].copy_from_slice(&START[..4]);
        state[12] = self.counter as u32;
        state[13] = (self.counter >> 32) as u32;
        state[14] = self.length;
        state[15] = self.role | role;
        let block = &self.block;
        for order in &ORDERS {
            let word = |at: usize| block[order[at]];
            mix(&mut state, [0, 4, 8, 12], word(0), word(1));
            mix(&mut state, [1, 5, 9, 13], word(2), word(3));
            mix(&mut state, [2, 6, 10, 14], word(4), word(5));
            mix(&mut state, [3, 7, 11, 15], word(6), word(7));
            mix(&mut state, [0, 5, 10, 15], word(8), word(9));
            mix(&mut state, [1, 6, 11, 12], word(10), word(11));
            mix(&mut state, [2, 7, 8, 13], word(12), word(13));
            mix(&mut state, [3, 4, 9, 14], word(14), word(15));
        }
        std::array::from_fn(|i| state[i] ^ state[i + 8])
    }
}

/// Mixes two words of a block into four of the state. Written out: build scripts are not optimised.
fn mix(state: &mut [u32; 16], [a, b, c, d]: [usize; 4], first: u32, second: u32) {
    let (mut p, mut q, mut r, mut s) = (state[a], state[b], state[c], state[d]);
    p = p.wrapping_add(q).wrapping_add(first);
    s = (s ^ p).rotate_right(16);
    r = r.wrapping_add(s);
    q = (q ^ r).rotate_right(12);
    p = p.wrapping_add(q).wrapping_add(second);
    s = (s ^ p).rotate_right(8);
    r = r.wrapping_add(s);
    q = (q ^ r).rotate_right(7);
    (state[a], state[b], state[c], state[d]) = (p, q, r, s);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hashes_are_those_of_the_crate() {
        let bytes: Vec<u8> = (0..200_000_u32).map(|i| (i % 251) as u8).collect();
        let around = |at: usize| [at - 1, at, at + 1];
        let lengths = [BLOCK, CHUNK, 2 * CHUNK, 3 * CHUNK, 8 * CHUNK, 31 * CHUNK];
        let lengths = lengths.into_iter().flat_map(around);
        for length in lengths.chain([0, 1, 200_000]) {
            let wanted = blake3::hash(&bytes[..length]).to_hex();
            assert_eq!(digest(&bytes[..length]), wanted.as_str(), "{length}");
        }
    }
}
