// What is computed once a draw for the levels of lights.wgsl, by lodc (lock format 1). Made from the lock: change that,
// not this. It does on the CPU what the entry point `lod_parameters` of lights.lod does on the GPU.

/// `Camera` as a buffer has it: 80 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(dead_code, missing_docs, non_camel_case_types, non_snake_case, unreachable_pub)]
pub struct Camera {
    pub view: [[f32; 4]; 4],
    pub eye: [f32; 3],
    pub _padding_0: [u32; 1],
}

/// `Light` as a buffer has it: 32 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(dead_code, missing_docs, non_camel_case_types, non_snake_case, unreachable_pub)]
pub struct Light {
    pub position: [f32; 3],
    pub range: f32,
    pub colour: [f32; 3],
    pub kind: u32,
}

/// `Lights` as a buffer has it: 1296 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(dead_code, missing_docs, non_camel_case_types, non_snake_case, unreachable_pub)]
pub struct Lights {
    pub ambient: [f32; 3],
    pub count: u32,
    pub all: [Light; 40],
}

impl Default for Lights {
    fn default() -> Self {
        Self {
            ambient: [0.0; 3],
            count: 0u32,
            all: [Light::default(); 40],
        }
    }
}

/// `LodParameters` as a buffer has it: 48 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(dead_code, missing_docs, non_camel_case_types, non_snake_case, unreachable_pub)]
pub struct LodParameters {
    pub return_div: f32,
    pub _padding_0: [u32; 3],
    pub towards: [f32; 3],
    pub _padding_1: [u32; 1],
    pub type_of_light: [f32; 3],
    pub _padding_2: [u32; 1],
}

impl LodParameters {
    /// What the buffer holds, in the order of bytes that GPUs have.
    #[allow(clippy::all, clippy::pedantic, dead_code, unreachable_pub)]
    pub fn to_bytes(self) -> [u8; 48] {
        let mut bytes = [0; 48];
        wgsl::put(&mut bytes, 0, [self.return_div].map(f32::to_bits));
        wgsl::put(&mut bytes, 16, self.towards.map(f32::to_bits));
        wgsl::put(&mut bytes, 32, self.type_of_light.map(f32::to_bits));
        bytes
    }
}

/// The parameters of a draw with these uniforms.
#[allow(clippy::all, clippy::pedantic, non_snake_case, unreachable_code, unused_assignments, unused_labels, unused_mut, unreachable_pub)]
pub fn lod_parameters(camera: &Camera, lights: &Lights) -> LodParameters {
    let mut parameters_stored = LodParameters::default();
    lod_one_parameters(camera, lights, &mut parameters_stored);
    parameters_stored
}

#[allow(clippy::all, clippy::pedantic, non_snake_case, unreachable_code, unused_assignments, unused_labels, unused_mut, unreachable_pub)]
fn lod_one_parameters(camera: &Camera, lights: &Lights, parameters_stored: &mut LodParameters) {
    let mut hits: u32 = 0u32;
    let mut radiance: [f32; 3] = [0.0; 3];
    let mut i: u32 = 0u32;
    let mut local: bool = false;
    radiance = lights.ambient;
    'rounds_1: loop {
        'round_2: {
            if !(i < lights.count.min(40u32)) {
                break 'rounds_1;
            }
            let away = wgsl::subtract_3(lights.all[wgsl::at(i, 40)].position, camera.eye);
            let squared = wgsl::dot_3(away, away);
            let at_range = lights.all[wgsl::at(i, 40)].range;
            if at_range * at_range < squared {
                break 'round_2;
            }
            let hits_2 = hits.wrapping_add(1u32);
            hits = hits_2;
            let at_kind = lights.all[wgsl::at(i, 40)].kind;
            'switch_3: {
                match at_kind {
                    0 => {
                        radiance = wgsl::add_3(radiance, wgsl::divide_3(lights.all[wgsl::at(i, 40)].colour, [1.0 + squared; 3]));
                    }
                    1 | 2 => {
                        if at_range < 0.5 {
                            break 'switch_3;
                        }
                        let radiance_4 = wgsl::add_3(radiance, wgsl::multiply_3_1(wgsl::max_3(lights.all[wgsl::at(i, 40)].colour, [0.25; 3]), at_kind as f32));
                        radiance = radiance_4;
                    }
                    _ => {
                        radiance = wgsl::mix_3_3_1(radiance, lights.all[wgsl::at(i, 40)].colour, 0.5);
                    }
                }
            }
            if hits_2 == 7u32 {
                break 'rounds_1;
            }
        }
        i = i.wrapping_add(1u32);
    }
    parameters_stored.return_div = (hits as f32) / 8.0;
    parameters_stored.towards = wgsl::normalize_3(wgsl::subtract_3(camera.eye, lights.ambient));
    let value = radiance;
    let value_2 = radiance;
    if 3u32 < hits {
        local = radiance[2] < radiance[0];
    } else {
        local = false;
    }
    parameters_stored.type_of_light = wgsl::select_1b_3_3(local, wgsl::pick(value_2, [2, 1, 0]), value);
}

/// What WGSL's operations mean, where Rust has none that means the same.
#[allow(dead_code, clippy::all, clippy::pedantic)]
mod wgsl {
    pub(super) fn add_3(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
        [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
    }

    /// A place in a list, or the last.
    pub(super) fn at(index: u32, length: usize) -> usize {
        (index as usize).min(length - 1)
    }

    pub(super) fn divide_3(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
        [a[0] / b[0], a[1] / b[1], a[2] / b[2]]
    }

    pub(super) fn dot_3(a: [f32; 3], b: [f32; 3]) -> f32 {
        a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    }

    /// The larger; where one is not a number, the other.
    pub(super) fn max(a: f32, b: f32) -> f32 {
        if a < b || a.is_nan() { b } else { a }
    }

    pub(super) fn max_3(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
        [max(a[0], b[0]), max(a[1], b[1]), max(a[2], b[2])]
    }

    pub(super) fn mix(a: f32, b: f32, t: f32) -> f32 {
        a * (1.0 - t) + b * t
    }

    pub(super) fn mix_3_3_1(a: [f32; 3], b: [f32; 3], c: f32) -> [f32; 3] {
        [mix(a[0], b[0], c), mix(a[1], b[1], c), mix(a[2], b[2], c)]
    }

    pub(super) fn multiply_3_1(a: [f32; 3], b: f32) -> [f32; 3] {
        [a[0] * b, a[1] * b, a[2] * b]
    }

    pub(super) fn normalize_3(a: [f32; 3]) -> [f32; 3] {
        let t8 = 1.0 / libm::sqrtf(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
        [a[0] * t8, a[1] * t8, a[2] * t8]
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

    pub(super) fn select_1b_3_3(a: bool, b: [f32; 3], c: [f32; 3]) -> [f32; 3] {
        [if a { b[0] } else { c[0] }, if a { b[1] } else { c[1] }, if a { b[2] } else { c[2] }]
    }

    pub(super) fn subtract_3(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
        [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
    }
}
