// What is computed once a draw for the levels of functions.wgsl, by lodc (lock format 1). Made from the lock: change that,
// not this. It does on the CPU what the entry point `lod_parameters` of functions.lod does on the GPU.

/// `Given` as a buffer has it: 80 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(dead_code, missing_docs, non_camel_case_types, non_snake_case, unreachable_pub)]
pub struct Given {
    pub a: [f32; 4],
    pub b: [f32; 4],
    pub c: [f32; 4],
    pub n: [f32; 3],
    pub _padding_0: [u32; 1],
    pub m: [f32; 3],
    pub _padding_1: [u32; 1],
}

/// `LodParameters` as a buffer has it: 256 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(dead_code, missing_docs, non_camel_case_types, non_snake_case, unreachable_pub)]
pub struct LodParameters {
    pub angles: [f32; 4],
    pub areas: [f32; 4],
    pub exact_bends: [f32; 3],
    pub _padding_0: [u32; 1],
    pub exact_blends: [f32; 4],
    pub exact_bounds: [f32; 4],
    pub exact_roots: [f32; 4],
    pub exact_steps: [f32; 4],
    pub exact_tests: [f32; 4],
    pub exact_ways: [f32; 3],
    pub _padding_1: [u32; 1],
    pub hyperbolas: [f32; 4],
    pub logarithms: [f32; 4],
    pub powers: [f32; 4],
    pub quadrants: [f32; 4],
    pub raised: [f32; 4],
    pub slopes: [f32; 4],
    pub turns: [f32; 4],
}

impl LodParameters {
    /// What the buffer holds, in the order of bytes that GPUs have.
    #[allow(clippy::all, clippy::pedantic, dead_code, unreachable_pub)]
    pub fn to_bytes(self) -> [u8; 256] {
        let mut bytes = [0; 256];
        wgsl::put(&mut bytes, 0, self.angles.map(f32::to_bits));
        wgsl::put(&mut bytes, 16, self.areas.map(f32::to_bits));
        wgsl::put(&mut bytes, 32, self.exact_bends.map(f32::to_bits));
        wgsl::put(&mut bytes, 48, self.exact_blends.map(f32::to_bits));
        wgsl::put(&mut bytes, 64, self.exact_bounds.map(f32::to_bits));
        wgsl::put(&mut bytes, 80, self.exact_roots.map(f32::to_bits));
        wgsl::put(&mut bytes, 96, self.exact_steps.map(f32::to_bits));
        wgsl::put(&mut bytes, 112, self.exact_tests.map(f32::to_bits));
        wgsl::put(&mut bytes, 128, self.exact_ways.map(f32::to_bits));
        wgsl::put(&mut bytes, 144, self.hyperbolas.map(f32::to_bits));
        wgsl::put(&mut bytes, 160, self.logarithms.map(f32::to_bits));
        wgsl::put(&mut bytes, 176, self.powers.map(f32::to_bits));
        wgsl::put(&mut bytes, 192, self.quadrants.map(f32::to_bits));
        wgsl::put(&mut bytes, 208, self.raised.map(f32::to_bits));
        wgsl::put(&mut bytes, 224, self.slopes.map(f32::to_bits));
        wgsl::put(&mut bytes, 240, self.turns.map(f32::to_bits));
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
    let mut local: bool = false;
    let a = given.a;
    let b = given.b;
    let c = given.c;
    let exact_steps_add_2 = wgsl::add_4(wgsl::subtract_4(wgsl::add_4(wgsl::floor_4(a), wgsl::ceil_4(b)), wgsl::multiply_4(wgsl::round_4(a), wgsl::trunc_4(b))), wgsl::multiply_4(wgsl::fract_4(c), wgsl::sign_4(a)));
    let exact_bounds_add = wgsl::add_4(wgsl::min_4(a, b), wgsl::multiply_4(wgsl::max_4(b, c), wgsl::clamp_4(a, b, c)));
    let exact_blends_sub = wgsl::subtract_4(wgsl::add_4(wgsl::mix_4(a, b, c), wgsl::mix_4_4_1(b, c, a[0])), wgsl::smooth_step_4(a, b, c));
    let exact_blends = wgsl::subtract_4(wgsl::add_4(wgsl::add_4(exact_blends_sub, wgsl::fma_4(a, b, c)), wgsl::radians_4(a)), wgsl::degrees_4(b));
    let exact_roots_vec4 = [wgsl::modf_1(a[0]).0, wgsl::modf_1(b[1]).1, libm::fabsf(c[0]), wgsl::distance_4(a, b)];
    let exact_ways_add = wgsl::add_3(wgsl::reflect_3(given.n, given.m), wgsl::multiply_3_1(wgsl::cross_3(given.n, given.m), wgsl::dot_3(given.n, given.m)));
    let exact_bends_add = wgsl::add_3(wgsl::refract_3_3_1(given.n, given.m, a[0]), wgsl::face_forward_3(given.n, given.m, wgsl::pick(c, [0, 1, 2])));
    if b[0] <= a[0] {
        local = !(c[0] != a[1]);
    } else {
        local = false;
    }
    let exact_tests_select_2 = wgsl::select_1b_4_4(local, c, b);
    let powers = [libm::expf(a[0]), libm::exp2f(a[1]), libm::expf(b[2]), libm::exp2f(b[3])];
    let logarithms = [libm::logf(a[0]), libm::log2f(a[1]), libm::logf(b[2]), libm::log2f(b[3])];
    let turns = [libm::sinf(a[0]), libm::cosf(a[1]), libm::sinf(b[2]), libm::cosf(b[3])];
    let slopes = [libm::tanf(a[0]), libm::tanf(b[1]), libm::atanf(a[2]), libm::atanf(b[3])];
    let angles = [libm::asinf(a[0]), libm::acosf(a[1]), libm::asinf(b[2]), libm::acosf(b[3])];
    let hyperbolas = [libm::sinhf(a[0]), libm::coshf(a[1]), libm::tanhf(a[2]), libm::sinhf(b[3])];
    let areas = [libm::asinhf(a[0]), libm::acoshf(a[1]), libm::atanhf(a[2]), libm::acoshf(b[3])];
    parameters_stored.angles = angles;
    parameters_stored.areas = areas;
    parameters_stored.exact_bends = wgsl::subtract_3(exact_bends_add, [wgsl::length_3(given.m); 3]);
    parameters_stored.exact_blends = exact_blends;
    parameters_stored.exact_bounds = wgsl::subtract_4(wgsl::add_4(wgsl::subtract_4(exact_bounds_add, wgsl::saturate_4(c)), wgsl::abs_4(b)), wgsl::step_4(a, b));
    parameters_stored.exact_roots = wgsl::add_4(wgsl::add_4(wgsl::sqrt_4(a), wgsl::inverse_sqrt_4(b)), exact_roots_vec4);
    parameters_stored.exact_steps = wgsl::add_4(exact_steps_add_2, wgsl::modulo_4(a, b));
    parameters_stored.exact_tests = wgsl::add_4(wgsl::select_4b_4_4(wgsl::less_4(a, b), b, a), exact_tests_select_2);
    parameters_stored.exact_ways = wgsl::add_3(exact_ways_add, wgsl::normalize_3(given.n));
    parameters_stored.hyperbolas = hyperbolas;
    parameters_stored.logarithms = logarithms;
    parameters_stored.powers = powers;
    parameters_stored.quadrants = wgsl::atan2_4(a, b);
    parameters_stored.raised = wgsl::pow_4(a, b);
    parameters_stored.slopes = slopes;
    parameters_stored.turns = turns;
}

/// What WGSL's operations mean, where Rust has none that means the same.
#[allow(dead_code, clippy::all, clippy::pedantic)]
mod wgsl {
    pub(super) fn abs_4(a: [f32; 4]) -> [f32; 4] {
        [libm::fabsf(a[0]), libm::fabsf(a[1]), libm::fabsf(a[2]), libm::fabsf(a[3])]
    }

    pub(super) fn add_3(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
        [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
    }

    pub(super) fn add_4(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
        [a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3]]
    }

    pub(super) fn atan2_4(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
        [
            libm::atan2f(a[0], b[0]),
            libm::atan2f(a[1], b[1]),
            libm::atan2f(a[2], b[2]),
            libm::atan2f(a[3], b[3]),
        ]
    }

    pub(super) fn ceil_4(a: [f32; 4]) -> [f32; 4] {
        [libm::ceilf(a[0]), libm::ceilf(a[1]), libm::ceilf(a[2]), libm::ceilf(a[3])]
    }

    pub(super) fn clamp(a: f32, low: f32, high: f32) -> f32 {
        min(max(a, low), high)
    }

    pub(super) fn clamp_4(a: [f32; 4], b: [f32; 4], c: [f32; 4]) -> [f32; 4] {
        [
            clamp(a[0], b[0], c[0]),
            clamp(a[1], b[1], c[1]),
            clamp(a[2], b[2], c[2]),
            clamp(a[3], b[3], c[3]),
        ]
    }

    pub(super) fn cross_3(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    }

    pub(super) fn degrees_4(a: [f32; 4]) -> [f32; 4] {
        [a[0] * 57.295776, a[1] * 57.295776, a[2] * 57.295776, a[3] * 57.295776]
    }

    pub(super) fn distance_4(a: [f32; 4], b: [f32; 4]) -> f32 {
        let t8 = a[0] - b[0];
        let t9 = a[1] - b[1];
        let t10 = a[2] - b[2];
        let t11 = a[3] - b[3];
        libm::sqrtf(t8 * t8 + t9 * t9 + t10 * t10 + t11 * t11)
    }

    pub(super) fn dot_3(a: [f32; 3], b: [f32; 3]) -> f32 {
        a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    }

    pub(super) fn face_forward_3(a: [f32; 3], b: [f32; 3], c: [f32; 3]) -> [f32; 3] {
        let t15 = b[0] * c[0] + b[1] * c[1] + b[2] * c[2] < 0.0;
        [
            if t15 { a[0] } else { -a[0] },
            if t15 { a[1] } else { -a[1] },
            if t15 { a[2] } else { -a[2] },
        ]
    }

    pub(super) fn floor_4(a: [f32; 4]) -> [f32; 4] {
        [libm::floorf(a[0]), libm::floorf(a[1]), libm::floorf(a[2]), libm::floorf(a[3])]
    }

    pub(super) fn fma_4(a: [f32; 4], b: [f32; 4], c: [f32; 4]) -> [f32; 4] {
        [a[0] * b[0] + c[0], a[1] * b[1] + c[1], a[2] * b[2] + c[2], a[3] * b[3] + c[3]]
    }

    pub(super) fn fract(a: f32) -> f32 {
        a - libm::floorf(a)
    }

    pub(super) fn fract_4(a: [f32; 4]) -> [f32; 4] {
        [fract(a[0]), fract(a[1]), fract(a[2]), fract(a[3])]
    }

    pub(super) fn inverse_sqrt_4(a: [f32; 4]) -> [f32; 4] {
        [
            1.0 / libm::sqrtf(a[0]),
            1.0 / libm::sqrtf(a[1]),
            1.0 / libm::sqrtf(a[2]),
            1.0 / libm::sqrtf(a[3]),
        ]
    }

    pub(super) fn length_3(a: [f32; 3]) -> f32 {
        libm::sqrtf(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])
    }

    pub(super) fn less_4(a: [f32; 4], b: [f32; 4]) -> [bool; 4] {
        [a[0] < b[0], a[1] < b[1], a[2] < b[2], a[3] < b[3]]
    }

    /// The larger; where one is not a number, the other.
    pub(super) fn max(a: f32, b: f32) -> f32 {
        if a < b || a.is_nan() { b } else { a }
    }

    pub(super) fn max_4(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
        [max(a[0], b[0]), max(a[1], b[1]), max(a[2], b[2]), max(a[3], b[3])]
    }

    /// The smaller; where one is not a number, the other.
    pub(super) fn min(a: f32, b: f32) -> f32 {
        if b < a || a.is_nan() { b } else { a }
    }

    pub(super) fn min_4(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
        [min(a[0], b[0]), min(a[1], b[1]), min(a[2], b[2]), min(a[3], b[3])]
    }

    pub(super) fn mix(a: f32, b: f32, t: f32) -> f32 {
        a * (1.0 - t) + b * t
    }

    pub(super) fn mix_4(a: [f32; 4], b: [f32; 4], c: [f32; 4]) -> [f32; 4] {
        [
            mix(a[0], b[0], c[0]),
            mix(a[1], b[1], c[1]),
            mix(a[2], b[2], c[2]),
            mix(a[3], b[3], c[3]),
        ]
    }

    pub(super) fn mix_4_4_1(a: [f32; 4], b: [f32; 4], c: f32) -> [f32; 4] {
        [mix(a[0], b[0], c), mix(a[1], b[1], c), mix(a[2], b[2], c), mix(a[3], b[3], c)]
    }

    pub(super) fn modf_1(a: f32) -> (f32, f32) {
        let t1 = libm::truncf(a);
        (a - t1, t1)
    }

    pub(super) fn modulo_4(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
        [rem(a[0], b[0]), rem(a[1], b[1]), rem(a[2], b[2]), rem(a[3], b[3])]
    }

    pub(super) fn multiply_3_1(a: [f32; 3], b: f32) -> [f32; 3] {
        [a[0] * b, a[1] * b, a[2] * b]
    }

    pub(super) fn multiply_4(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
        [a[0] * b[0], a[1] * b[1], a[2] * b[2], a[3] * b[3]]
    }

    pub(super) fn normalize_3(a: [f32; 3]) -> [f32; 3] {
        let t8 = 1.0 / libm::sqrtf(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
        [a[0] * t8, a[1] * t8, a[2] * t8]
    }

    /// Some components of a vector, in another order.
    pub(super) fn pick<T: Copy, const N: usize, const M: usize>(a: [T; N], at: [usize; M]) -> [T; M] {
        at.map(|at| a[at])
    }

    /// As GPUs have it; 1 where the exponent is 0.
    pub(super) fn pow(a: f32, b: f32) -> f32 {
        if b == 0.0 { 1.0 } else { libm::exp2f(b * libm::log2f(a)) }
    }

    pub(super) fn pow_4(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
        [pow(a[0], b[0]), pow(a[1], b[1]), pow(a[2], b[2]), pow(a[3], b[3])]
    }

    /// Writes words into bytes, from a place on.
    pub(super) fn put<const N: usize>(bytes: &mut [u8], at: usize, words: [u32; N]) {
        for (i, word) in words.into_iter().enumerate() {
            bytes[at + 4 * i..][..4].copy_from_slice(&word.to_le_bytes());
        }
    }

    pub(super) fn radians_4(a: [f32; 4]) -> [f32; 4] {
        [a[0] * 0.017453292, a[1] * 0.017453292, a[2] * 0.017453292, a[3] * 0.017453292]
    }

    pub(super) fn reflect_3(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
        let t12 = 2.0 * (b[0] * a[0] + b[1] * a[1] + b[2] * a[2]);
        [a[0] - t12 * b[0], a[1] - t12 * b[1], a[2] - t12 * b[2]]
    }

    pub(super) fn refract_3_3_1(a: [f32; 3], b: [f32; 3], c: f32) -> [f32; 3] {
        let t13 = b[0] * a[0] + b[1] * a[1] + b[2] * a[2];
        let t18 = 1.0 - c * c * (1.0 - t13 * t13);
        let t21 = c * t13 + libm::sqrtf(t18);
        let t31 = t18 < 0.0;
        [
            if t31 { 0.0 } else { c * a[0] - t21 * b[0] },
            if t31 { 0.0 } else { c * a[1] - t21 * b[1] },
            if t31 { 0.0 } else { c * a[2] - t21 * b[2] },
        ]
    }

    /// The remainder of truncated division.
    pub(super) fn rem(a: f32, b: f32) -> f32 {
        a - b * libm::truncf(a / b)
    }

    pub(super) fn round_4(a: [f32; 4]) -> [f32; 4] {
        [libm::rintf(a[0]), libm::rintf(a[1]), libm::rintf(a[2]), libm::rintf(a[3])]
    }

    pub(super) fn saturate(a: f32) -> f32 {
        clamp(a, 0.0, 1.0)
    }

    pub(super) fn saturate_4(a: [f32; 4]) -> [f32; 4] {
        [saturate(a[0]), saturate(a[1]), saturate(a[2]), saturate(a[3])]
    }

    pub(super) fn select_1b_4_4(a: bool, b: [f32; 4], c: [f32; 4]) -> [f32; 4] {
        [
            if a { b[0] } else { c[0] },
            if a { b[1] } else { c[1] },
            if a { b[2] } else { c[2] },
            if a { b[3] } else { c[3] },
        ]
    }

    pub(super) fn select_4b_4_4(a: [bool; 4], b: [f32; 4], c: [f32; 4]) -> [f32; 4] {
        [
            if a[0] { b[0] } else { c[0] },
            if a[1] { b[1] } else { c[1] },
            if a[2] { b[2] } else { c[2] },
            if a[3] { b[3] } else { c[3] },
        ]
    }

    /// -1, 0 or 1; 0 of what is not a number.
    pub(super) fn sign(a: f32) -> f32 {
        if a < 0.0 {
            -1.0
        } else if 0.0 < a {
            1.0
        } else {
            0.0
        }
    }

    pub(super) fn sign_4(a: [f32; 4]) -> [f32; 4] {
        [sign(a[0]), sign(a[1]), sign(a[2]), sign(a[3])]
    }

    pub(super) fn smooth_step(low: f32, high: f32, a: f32) -> f32 {
        let t = saturate((a - low) / (high - low));
        t * t * (3.0 - 2.0 * t)
    }

    pub(super) fn smooth_step_4(a: [f32; 4], b: [f32; 4], c: [f32; 4]) -> [f32; 4] {
        [
            smooth_step(a[0], b[0], c[0]),
            smooth_step(a[1], b[1], c[1]),
            smooth_step(a[2], b[2], c[2]),
            smooth_step(a[3], b[3], c[3]),
        ]
    }

    pub(super) fn sqrt_4(a: [f32; 4]) -> [f32; 4] {
        [libm::sqrtf(a[0]), libm::sqrtf(a[1]), libm::sqrtf(a[2]), libm::sqrtf(a[3])]
    }

    pub(super) fn step(edge: f32, a: f32) -> f32 {
        if edge <= a { 1.0 } else { 0.0 }
    }

    pub(super) fn step_4(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
        [step(a[0], b[0]), step(a[1], b[1]), step(a[2], b[2]), step(a[3], b[3])]
    }

    pub(super) fn subtract_3(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
        [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
    }

    pub(super) fn subtract_4(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
        [a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3]]
    }

    pub(super) fn trunc_4(a: [f32; 4]) -> [f32; 4] {
        [libm::truncf(a[0]), libm::truncf(a[1]), libm::truncf(a[2]), libm::truncf(a[3])]
    }
}
