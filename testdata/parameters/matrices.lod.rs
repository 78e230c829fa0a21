// What is computed once a draw for the levels of matrices.wgsl, by lodc (lock format 1). Made from the lock: change that,
// not this. It does on the CPU what the entry point `lod_parameters` of matrices.lod does on the GPU.

/// `Bone` as a buffer has it: 64 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(dead_code, missing_docs, non_camel_case_types, non_snake_case, unreachable_pub)]
pub struct Bone {
    pub turn: [[f32; 4]; 3],
    pub at: [f32; 3],
    pub _padding_0: [u32; 1],
}

/// `Pose` as a buffer has it: 80 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(dead_code, missing_docs, non_camel_case_types, non_snake_case, unreachable_pub)]
pub struct Pose {
    pub count: i32,
    pub r#box: f32,
    pub r#dyn: [f32; 2],
    pub tilt: [[f32; 2]; 2],
    pub edges: [[f32; 4]; 3],
}

/// `Object` as a buffer has it: 272 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(dead_code, missing_docs, non_camel_case_types, non_snake_case, unreachable_pub)]
pub struct Object {
    pub model: [[f32; 4]; 4],
    pub normal: [[f32; 4]; 3],
    pub flat: [[f32; 4]; 4],
    pub pairs: [[[f32; 4]; 3]; 2],
}

/// `LodParameters` as a buffer has it: 16 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(dead_code, missing_docs, non_camel_case_types, non_snake_case, unreachable_pub)]
pub struct LodParameters {
    pub return_dot: f32,
    pub _padding_0: [u32; 1],
    pub tilted: [f32; 2],
}

impl LodParameters {
    /// What the buffer holds, in the order of bytes that GPUs have.
    #[allow(clippy::all, clippy::pedantic, dead_code, unreachable_pub)]
    pub fn to_bytes(self) -> [u8; 16] {
        let mut bytes = [0; 16];
        wgsl::put(&mut bytes, 0, [self.return_dot].map(f32::to_bits));
        wgsl::put(&mut bytes, 8, self.tilted.map(f32::to_bits));
        bytes
    }
}

#[allow(non_upper_case_globals)]
const corners: [[f32; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]];

/// The parameters of a draw with these uniforms.
#[allow(clippy::all, clippy::pedantic, non_snake_case, unreachable_code, unused_assignments, unused_labels, unused_mut, unreachable_pub)]
pub fn lod_parameters(object: &Object, pose: &Pose, pose_bones: &[Bone], weights: &[f32]) -> LodParameters {
    let mut parameters_stored = LodParameters::default();
    lod_one_parameters(object, pose, pose_bones, weights, &mut parameters_stored);
    parameters_stored
}

#[allow(clippy::all, clippy::pedantic, non_snake_case, unreachable_code, unused_assignments, unused_labels, unused_mut, unreachable_pub)]
fn lod_one_parameters(object: &Object, pose: &Pose, pose_bones: &[Bone], weights: &[f32], parameters_stored: &mut LodParameters) {
    let mut total: f32 = 0.0;
    let mut columns: [[f32; 3]; 3] = [[0.0; 3]; 3];
    let mut i: u32 = 0u32;
    let mut columns_2: [[f32; 3]; 3] = [[0.0; 3]; 3];
    let at = pose.count;
    let at_turn_2 = wgsl::element(pose_bones, at as u32, Bone::default()).turn.map(wgsl::three);
    columns = object.pairs[1].map(wgsl::three);
    let columns_load = columns[wgsl::at(at as u32, 3)];
    'rounds_1: loop {
        if !(i < weights.len() as u32) {
            break 'rounds_1;
        }
        total = total + wgsl::element(weights, i, 0.0) * corners[wgsl::at(i, 4)][0];
        i = i.wrapping_add(1u32);
    }
    let tilted = wgsl::add_2(wgsl::multiply_2_1(wgsl::multiply_2x2_2(pose.tilt, pose.r#dyn), total), wgsl::multiply_2_1(corners[wgsl::at(at as u32, 4)], pose.r#box));
    let spread = wgsl::multiply_3x3(object.normal.map(wgsl::three), at_turn_2);
    let turned = wgsl::add_3(wgsl::multiply_3x3_3(spread, wgsl::three(pose.edges[wgsl::at(at.wrapping_add(1i32) as u32, 3)])), wgsl::element(pose_bones, at as u32, Bone::default()).at);
    let moved = wgsl::multiply_4x4_4(object.model, wgsl::join_3_1(turned, 1.0));
    let flattened = wgsl::multiply_4x3_4(object.flat.map(wgsl::three), wgsl::multiply_4_4x4(moved, object.model));
    columns_2 = object.pairs[1].map(wgsl::three);
    columns_2[wgsl::at(at as u32, 3)] = wgsl::add_3(columns_load, wgsl::multiply_3_1(wgsl::transpose_3x3(object.normal.map(wgsl::three))[2], wgsl::determinant_3x3(at_turn_2)));
    let mixed = wgsl::multiply_3x3_3(columns_2, flattened);
    parameters_stored.return_dot = wgsl::dot_3(mixed, wgsl::pick(turned, [1, 2, 0]));
    parameters_stored.tilted = tilted;
}

/// What WGSL's operations mean, where Rust has none that means the same.
#[allow(dead_code, clippy::all, clippy::pedantic)]
mod wgsl {
    pub(super) fn add_2(a: [f32; 2], b: [f32; 2]) -> [f32; 2] {
        [a[0] + b[0], a[1] + b[1]]
    }

    pub(super) fn add_3(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
        [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
    }

    /// A place in a list, or the last.
    pub(super) fn at(index: u32, length: usize) -> usize {
        (index as usize).min(length - 1)
    }

    pub(super) fn determinant_3x3(a: [[f32; 3]; 3]) -> f32 {
        a[0][0] * (a[1][1] * a[2][2] - a[2][1] * a[1][2]) - a[0][1] * (a[1][0] * a[2][2] - a[2][0] * a[1][2]) + a[0][2] * (a[1][0] * a[2][1] - a[2][0] * a[1][1])
    }

    pub(super) fn dot_3(a: [f32; 3], b: [f32; 3]) -> f32 {
        a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    }

    /// An element of a list, or the last, or `none` of an empty one.
    pub(super) fn element<T: Copy>(list: &[T], index: u32, none: T) -> T {
        list.get(index as usize).or(list.last()).copied().unwrap_or(none)
    }

    pub(super) fn join_3_1<T: Copy>(a: [T; 3], b: T) -> [T; 4] {
        [a[0], a[1], a[2], b]
    }

    pub(super) fn multiply_2_1(a: [f32; 2], b: f32) -> [f32; 2] {
        [a[0] * b, a[1] * b]
    }

    pub(super) fn multiply_2x2_2(a: [[f32; 2]; 2], b: [f32; 2]) -> [f32; 2] {
        [a[0][0] * b[0] + a[1][0] * b[1], a[0][1] * b[0] + a[1][1] * b[1]]
    }

    pub(super) fn multiply_3_1(a: [f32; 3], b: f32) -> [f32; 3] {
        [a[0] * b, a[1] * b, a[2] * b]
    }

    pub(super) fn multiply_3x3(a: [[f32; 3]; 3], b: [[f32; 3]; 3]) -> [[f32; 3]; 3] {
        [
            [a[0][0] * b[0][0] + a[1][0] * b[0][1] + a[2][0] * b[0][2], a[0][1] * b[0][0] + a[1][1] * b[0][1] + a[2][1] * b[0][2], a[0][2] * b[0][0] + a[1][2] * b[0][1] + a[2][2] * b[0][2]],
            [a[0][0] * b[1][0] + a[1][0] * b[1][1] + a[2][0] * b[1][2], a[0][1] * b[1][0] + a[1][1] * b[1][1] + a[2][1] * b[1][2], a[0][2] * b[1][0] + a[1][2] * b[1][1] + a[2][2] * b[1][2]],
            [a[0][0] * b[2][0] + a[1][0] * b[2][1] + a[2][0] * b[2][2], a[0][1] * b[2][0] + a[1][1] * b[2][1] + a[2][1] * b[2][2], a[0][2] * b[2][0] + a[1][2] * b[2][1] + a[2][2] * b[2][2]],
        ]
    }

    pub(super) fn multiply_3x3_3(a: [[f32; 3]; 3], b: [f32; 3]) -> [f32; 3] {
        [
            a[0][0] * b[0] + a[1][0] * b[1] + a[2][0] * b[2],
            a[0][1] * b[0] + a[1][1] * b[1] + a[2][1] * b[2],
            a[0][2] * b[0] + a[1][2] * b[1] + a[2][2] * b[2],
        ]
    }

    pub(super) fn multiply_4_4x4(a: [f32; 4], b: [[f32; 4]; 4]) -> [f32; 4] {
        [
            a[0] * b[0][0] + a[1] * b[0][1] + a[2] * b[0][2] + a[3] * b[0][3],
            a[0] * b[1][0] + a[1] * b[1][1] + a[2] * b[1][2] + a[3] * b[1][3],
            a[0] * b[2][0] + a[1] * b[2][1] + a[2] * b[2][2] + a[3] * b[2][3],
            a[0] * b[3][0] + a[1] * b[3][1] + a[2] * b[3][2] + a[3] * b[3][3],
        ]
    }

    pub(super) fn multiply_4x3_4(a: [[f32; 3]; 4], b: [f32; 4]) -> [f32; 3] {
        [
            a[0][0] * b[0] + a[1][0] * b[1] + a[2][0] * b[2] + a[3][0] * b[3],
            a[0][1] * b[0] + a[1][1] * b[1] + a[2][1] * b[2] + a[3][1] * b[3],
            a[0][2] * b[0] + a[1][2] * b[1] + a[2][2] * b[2] + a[3][2] * b[3],
        ]
    }

    pub(super) fn multiply_4x4_4(a: [[f32; 4]; 4], b: [f32; 4]) -> [f32; 4] {
        [
            a[0][0] * b[0] + a[1][0] * b[1] + a[2][0] * b[2] + a[3][0] * b[3],
            a[0][1] * b[0] + a[1][1] * b[1] + a[2][1] * b[2] + a[3][1] * b[3],
            a[0][2] * b[0] + a[1][2] * b[1] + a[2][2] * b[2] + a[3][2] * b[3],
            a[0][3] * b[0] + a[1][3] * b[1] + a[2][3] * b[2] + a[3][3] * b[3],
        ]
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

    /// A vector of three without its padding.
    pub(super) fn three<T: Copy>(padded: [T; 4]) -> [T; 3] {
        [padded[0], padded[1], padded[2]]
    }

    pub(super) fn transpose_3x3(a: [[f32; 3]; 3]) -> [[f32; 3]; 3] {
        [[a[0][0], a[1][0], a[2][0]], [a[0][1], a[1][1], a[2][1]], [a[0][2], a[1][2], a[2][2]]]
    }
}
