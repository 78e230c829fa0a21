// What is computed once a draw for the levels of loops.wgsl, by lodc (lock format 1). Made from the lock: change that,
// not this. It does on the CPU what the entry point `lod_parameters` of loops.lod does on the GPU.

/// `Given` as a buffer has it: 144 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(dead_code, missing_docs, non_camel_case_types, non_snake_case, unreachable_pub)]
pub struct Given {
    pub points: [[f32; 4]; 8],
    pub count: u32,
    pub other: u32,
    pub kind: u32,
    pub gain: f32,
}

/// `LodParameters` as a buffer has it: 64 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(dead_code, missing_docs, non_camel_case_types, non_snake_case, unreachable_pub)]
pub struct LodParameters {
    pub before_3: f32,
    pub behind_3: f32,
    pub enough_5: f32,
    pub left_3: f32,
    pub more_3: f32,
    pub others_3: f32,
    pub _padding_0: [u32; 2],
    pub sums_vec4: [f32; 4],
    pub wide_3: [f32; 4],
}

impl LodParameters {
    /// What the buffer holds, in the order of bytes that GPUs have.
    #[allow(clippy::all, clippy::pedantic, dead_code, unreachable_pub)]
    pub fn to_bytes(self) -> [u8; 64] {
        let mut bytes = [0; 64];
        wgsl::put(&mut bytes, 0, [self.before_3].map(f32::to_bits));
        wgsl::put(&mut bytes, 4, [self.behind_3].map(f32::to_bits));
        wgsl::put(&mut bytes, 8, [self.enough_5].map(f32::to_bits));
        wgsl::put(&mut bytes, 12, [self.left_3].map(f32::to_bits));
        wgsl::put(&mut bytes, 16, [self.more_3].map(f32::to_bits));
        wgsl::put(&mut bytes, 20, [self.others_3].map(f32::to_bits));
        wgsl::put(&mut bytes, 32, self.sums_vec4.map(f32::to_bits));
        wgsl::put(&mut bytes, 48, self.wide_3.map(f32::to_bits));
        bytes
    }
}

/// The parameters of a draw with these uniforms.
#[allow(clippy::all, clippy::pedantic, non_snake_case, unreachable_code, unused_assignments, unused_labels, unused_mut, unreachable_pub)]
pub fn lod_parameters(given: &Given) -> LodParameters {
    let mut parameters_stored = LodParameters::default();
    lod_one_parameters(given, &mut parameters_stored);
    parameters_stored
}

#[allow(clippy::all, clippy::pedantic, non_snake_case, unreachable_code, unused_assignments, unused_labels, unused_mut, unreachable_pub)]
fn lod_one_parameters(given: &Given, parameters_stored: &mut LodParameters) {
    let mut wide: [f32; 4] = [0.0; 4];
    let mut i: u32 = 0u32;
    let mut inner: f32 = 0.0;
    let mut j: u32 = 0u32;
    let mut narrow: f32 = 0.0;
    let mut seen: [f32; 3] = [0.0; 3];
    let mut left: f32 = 1.0;
    let mut before: f32 = 0.0;
    let mut i_2: u32 = 0u32;
    let mut behind: f32 = 0.0;
    let mut others: f32 = 0.0;
    let mut enough: f32 = 0.0;
    let mut more: f32 = 0.0;
    let mut i_3: u32 = 0u32;
    let mut i_4: u32 = 0u32;
    let mut i_5: u32 = 0u32;
    let mut i_6: u32 = 0u32;
    if given.kind != 3u32 {
        'rounds_1: loop {
            if !(i < given.count.min(8u32)) {
                break 'rounds_1;
            }
            inner = 0.0;
            j = 0u32;
            'rounds_2: loop {
                if !(j <= i) {
                    break 'rounds_2;
                }
                inner = inner + wgsl::dot_4(given.points[wgsl::at(j, 8)], given.points[wgsl::at(i, 8)]);
                j = j.wrapping_add(1u32);
            }
            let inner_4 = inner;
            'switch_3: {
                match given.kind.wrapping_add(i) {
                    1 => {
                        inner = inner_4 * 2.0;
                    }
                    2 | 3 | 4 => {
                        let inner_2 = libm::sqrtf(inner_4);
                        inner = inner_2;
                        if (2.0 as f32) < inner_2 {
                            break 'switch_3;
                        }
                        inner = inner_2 + 1.0;
                    }
                    _ => {
                        inner = inner_4 * 0.5;
                    }
                }
            }
            let points_at_3_3 = given.points[wgsl::at(i, 8)];
            wide = wgsl::add_4(wide, wgsl::multiply_4_1(points_at_3_3, inner));
            narrow = wgsl::max(narrow, inner - points_at_3_3[3]);
            i = i.wrapping_add(1u32);
        }
    }
    'rounds_4: loop {
        if !(i_3 < 8u32) {
            break 'rounds_4;
        }
        let points_at_4_3 = given.points[wgsl::at(i_3, 8)];
        let thick = 1.0 / (1.0 + libm::fabsf(points_at_4_3[3]));
        seen = wgsl::add_3(seen, wgsl::multiply_3_1(wgsl::pick(points_at_4_3, [0, 1, 2]), left * thick));
        let left_2 = left * (1.0 - thick);
        left = left_2;
        if left_2 < 0.125 {
            break 'rounds_4;
        }
        i_3 = i_3.wrapping_add(1u32);
    }
    'rounds_5: loop {
        if !(i_2 < 8u32) {
            break 'rounds_5;
        }
        behind = before;
        before = before + given.gain;
        if (1.0 as f32) < given.points[wgsl::at(i_2, 8)][0] {
            break 'rounds_5;
        }
        behind = before;
        i_2 = i_2.wrapping_add(1u32);
    }
    'rounds_6: loop {
        if !(i_4 < given.other.min(8u32)) {
            break 'rounds_6;
        }
        others = others + given.points[wgsl::at(i_4, 8)][1];
        i_4 = i_4.wrapping_add(1u32);
    }
    'rounds_7: loop {
        'round_8: {
            if !(i_5 < given.count.min(8u32)) {
                break 'rounds_7;
            }
            let enough_2 = enough + given.points[wgsl::at(i_5, 8)][1];
            enough = enough_2;
            if (2.0 as f32) < enough_2 {
                break 'round_8;
            }
            enough = enough_2 * 1.5;
        }
        i_5 = i_5.wrapping_add(1u32);
    }
    'rounds_9: loop {
        if !(i_6 < wgsl::u32_from(wgsl::clamp(enough, 0.0, 8.0)).min(8u32)) {
            break 'rounds_9;
        }
        more = more - given.points[wgsl::at(i_6, 8)][2];
        i_6 = i_6.wrapping_add(1u32);
    }
    parameters_stored.before_3 = before;
    parameters_stored.behind_3 = behind;
    parameters_stored.enough_5 = enough;
    parameters_stored.left_3 = left;
    parameters_stored.more_3 = more;
    parameters_stored.others_3 = others;
    parameters_stored.sums_vec4 = wgsl::join_3_1(seen, narrow);
    parameters_stored.wide_3 = wide;
}

/// What WGSL's operations mean, where Rust has none that means the same.
#[allow(dead_code, clippy::all, clippy::pedantic)]
mod wgsl {
    pub(super) fn add_3(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
        [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
    }

    pub(super) fn add_4(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
        [a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3]]
    }

    /// A place in a list, or the last.
    pub(super) fn at(index: u32, length: usize) -> usize {
        (index as usize).min(length - 1)
    }

    pub(super) fn clamp(a: f32, low: f32, high: f32) -> f32 {
        min(max(a, low), high)
    }

    pub(super) fn dot_4(a: [f32; 4], b: [f32; 4]) -> f32 {
        a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
    }

    pub(super) fn join_3_1<T: Copy>(a: [T; 3], b: T) -> [T; 4] {
        [a[0], a[1], a[2], b]
    }

    /// The larger; where one is not a number, the other.
    pub(super) fn max(a: f32, b: f32) -> f32 {
        if a < b || a.is_nan() { b } else { a }
    }

    /// The smaller; where one is not a number, the other.
    pub(super) fn min(a: f32, b: f32) -> f32 {
        if b < a || a.is_nan() { b } else { a }
    }

    pub(super) fn multiply_3_1(a: [f32; 3], b: f32) -> [f32; 3] {
        [a[0] * b, a[1] * b, a[2] * b]
    }

    pub(super) fn multiply_4_1(a: [f32; 4], b: f32) -> [f32; 4] {
        [a[0] * b, a[1] * b, a[2] * b, a[3] * b]
    }

    /// Some components of a vector, in another order.
    pub(super) fn pick<T: Copy, const N: usize, const M: usize>(a: [T; N], at: [usize; M]) -> [T; M] {
        at.map(|at| a[at])
    }

    /// Writes words into bytes, from a place on.
    pub(super) fn put<const N: usize>(bytes: &mut [u8], at: usize, words: [u32; N]) {
        for (i, word) in words.into_iter().enumerate() {
            bytes[at + 4 * i..][..4].copy_from_slice(&word.to_le_bytes());
        }
    }

    /// Truncated to the nearest that is both an integer and a float.
    pub(super) fn u32_from(a: f32) -> u32 {
        (if a > 4294967000.0 { 4294967000.0 } else { a }) as u32
    }
}
