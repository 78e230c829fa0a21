//! Numbers by chance that are the same always: each is a function of a seed alone.

/// SplitMix64's finaliser (Steele, Lea, Flood 2014): a hash of one word.
pub fn mix(word: u64) -> u64 {
    finalise(word.wrapping_add(0x9e37_79b9_7f4a_7c15))
}

/// The same without its increment.
pub fn finalise(word: u64) -> u64 {
    let word = (word ^ word >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let word = (word ^ word >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    word ^ word >> 31
}

/// A number of 0 to below 1.
pub fn unit(seed: u64) -> f64 {
    (mix(seed) >> 11) as f64 / (1u64 << 53) as f64
}

/// The seed of a thing that is numbered below a seed.
pub fn child(seed: u64, number: u64) -> u64 {
    mix(seed ^ mix(number))
}
