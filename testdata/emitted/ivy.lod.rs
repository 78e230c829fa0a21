// What is computed once a draw for the levels of ivy.wgsl, by lodc (lock format 1). Made from the lock: change that,
// not this. It does on the CPU what the entry point `lod_parameters` of ivy.lod does on the GPU.

/// `Camera` as a buffer has it: 80 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(dead_code, missing_docs, non_camel_case_types, non_snake_case, unreachable_pub)]
pub struct Camera {
    pub view_proj: [[f32; 4]; 4],
    pub position: [f32; 3],
    pub _padding_0: [u32; 1],
}

/// `Sun` as a buffer has it: 64 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(dead_code, missing_docs, non_camel_case_types, non_snake_case, unreachable_pub)]
pub struct Sun {
    pub direction: [f32; 3],
    pub _padding_0: [u32; 1],
    pub colour: [f32; 3],
    pub _padding_1: [u32; 1],
    pub sky: [f32; 3],
    pub _padding_2: [u32; 1],
    pub ground: [f32; 3],
    pub _padding_3: [u32; 1],
}

/// `LodParameters` as a buffer has it: 48 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(dead_code, missing_docs, non_camel_case_types, non_snake_case, unreachable_pub)]
pub struct LodParameters {
    pub l: [f32; 3],
    pub _padding_0: [u32; 1],
    pub gloss_of_h: [f32; 3],
    pub _padding_1: [u32; 1],
    pub v: [f32; 3],
    pub _padding_2: [u32; 1],
}

impl LodParameters {
    /// What the buffer holds, in the order of bytes that GPUs have.
    #[allow(clippy::all, clippy::pedantic, dead_code, unreachable_pub)]
    pub fn to_bytes(self) -> [u8; 48] {
        let mut bytes = [0; 48];
        wgsl::put(&mut bytes, 0, self.l.map(f32::to_bits));
        wgsl::put(&mut bytes, 16, self.gloss_of_h.map(f32::to_bits));
        wgsl::put(&mut bytes, 32, self.v.map(f32::to_bits));
        bytes
    }
}

/// The parameters of a draw with these uniforms.
#[allow(clippy::all, clippy::pedantic, non_snake_case, unreachable_code, unused_assignments, unused_labels, unused_mut, unreachable_pub)]
pub fn lod_parameters(camera: &Camera, sun: &Sun) -> LodParameters {
    let mut parameters_stored = LodParameters::default();
    lod_one_parameters(sun, &mut parameters_stored);
    lod_two_parameters(camera, sun, &mut parameters_stored);
    lod_four_parameters(camera, &mut parameters_stored);
    parameters_stored
}

#[allow(clippy::all, clippy::pedantic, non_snake_case, unreachable_code, unused_assignments, unused_labels, unused_mut, unreachable_pub)]
fn lod_one_parameters(sun: &Sun, parameters_stored: &mut LodParameters) {
    parameters_stored.l = wgsl::normalize_3(sun.direction);
}

#[allow(clippy::all, clippy::pedantic, non_snake_case, unreachable_code, unused_assignments, unused_labels, unused_mut, unreachable_pub)]
fn lod_two_parameters(camera: &Camera, sun: &Sun, parameters_stored: &mut LodParameters) {
    let v = wgsl::normalize_3(wgsl::subtract_3(camera.position, [0.042845897, 0.4527219, -0.020062601]));
    parameters_stored.gloss_of_h = wgsl::normalize_3(wgsl::add_3(sun.direction, v));
}

#[allow(clippy::all, clippy::pedantic, non_snake_case, unreachable_code, unused_assignments, unused_labels, unused_mut, unreachable_pub)]
fn lod_four_parameters(camera: &Camera, parameters_stored: &mut LodParameters) {
    parameters_stored.v = wgsl::normalize_3(wgsl::subtract_3(camera.position, [-1.9397024, 8.478871, -3.5162716]));
}

/// What WGSL's operations mean, where Rust has none that means the same.
#[allow(dead_code, clippy::all, clippy::pedantic)]
mod wgsl {
    pub(super) fn add_3(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
        [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
    }

    pub(super) fn normalize_3(a: [f32; 3]) -> [f32; 3] {
        let t8 = 1.0 / libm::sqrtf(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
        [a[0] * t8, a[1] * t8, a[2] * t8]
    }

    /// Writes words into bytes, from a place on.
    pub(super) fn put<const N: usize>(bytes: &mut [u8], at: usize, words: [u32; N]) {
        for (i, word) in words.into_iter().enumerate() {
            bytes[at + 4 * i..][..4].copy_from_slice(&word.to_le_bytes());
        }
    }

    pub(super) fn subtract_3(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
        [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
    }
}
