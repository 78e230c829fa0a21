//! How the texels of a generated texture are stored: eight bits a channel, or floats of 16.

use crate::eval::image::{srgb_byte, srgb_encode, to_byte};

/// A step of eight bits.
pub(super) const STEP: f32 = 1.0 / 255.0;

/// How the texels of a generated texture are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum TexelFormat {
    /// Eight bits a channel, 0..1.
    Rgba8Unorm,
    /// The same, colours encoded as sRGB.
    Rgba8UnormSrgb,
    /// Floats of 16 bits.
    Rgba16Float,
}

impl TexelFormat {
    /// As WebGPU calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rgba8Unorm => "rgba8unorm",
            Self::Rgba8UnormSrgb => "rgba8unorm-srgb",
            Self::Rgba16Float => "rgba16float",
        }
    }

    /// A texel's size in bytes.
    pub fn bytes(self) -> usize {
        match self {
            Self::Rgba8Unorm | Self::Rgba8UnormSrgb => 4,
            Self::Rgba16Float => 8,
        }
    }

    /// Whether no component is further than half a step outside of what it can hold.
    pub(super) fn holds(self, components: &[f32]) -> bool {
        let mut all = components.iter().enumerate();
        all.all(|(i, x)| {
            let [below, above] = match (self, i) {
                (Self::Rgba16Float, _) => return x.abs() < MOST_HALF,
                (Self::Rgba8UnormSrgb, 0..3) => [SLOPE_AT_BLACK, SLOPE_AT_WHITE],
                _ => [1.0; 2],
            };
            (-0.5 * STEP * below..=1.0 + 0.5 * STEP * above).contains(x)
        })
    }

    /// A texel as it is stored.
    pub fn encode(self, texel: [f32; 4]) -> Vec<u8> {
        let [r, g, b, a] = texel;
        match self {
            Self::Rgba8Unorm => texel.map(to_byte).to_vec(),
            Self::Rgba8UnormSrgb => {
                let [r, g, b] = [r, g, b].map(|x| to_byte(srgb_encode(x)));
                vec![r, g, b, to_byte(a)]
            }
            Self::Rgba16Float => {
                let halves = texel.map(|x| half(x).to_le_bytes());
                halves.concat()
            }
        }
    }

    /// What a sample returns of a stored texel; bytes that are not there are 0.
    pub fn decode(self, bytes: &[u8]) -> [f32; 4] {
        let byte = |at: usize| bytes.get(at).copied().unwrap_or(0);
        let unorm = |at: usize| f32::from(byte(at)) / 255.0;
        match self {
            Self::Rgba8Unorm => [0, 1, 2, 3].map(unorm),
            Self::Rgba8UnormSrgb => {
                let [r, g, b] = [0, 1, 2].map(|at| srgb_byte(byte(at)));
                [r, g, b, unorm(3)]
            }
            Self::Rgba16Float => {
                [0, 1, 2, 3].map(|i| float(u16::from_le_bytes([byte(2 * i), byte(2 * i + 1)])))
            }
        }
    }

    /// What is left of a texel.
    pub fn rounded(self, texel: [f32; 4]) -> [f32; 4] {
        self.decode(&self.encode(texel))
    }
}

/// What rounds to no float of 16 bits.
const MOST_HALF: f32 = 65520.0;

/// How fast colours decode where their code is 0, and where it is 1.
const SLOPE_AT_BLACK: f32 = 1.0 / 12.92;
const SLOPE_AT_WHITE: f32 = 2.4 / 1.055;

/// A float as one of 16 bits, rounded to nearest, ties to even; what is too large is the largest, NaN is 0.
fn half(x: f32) -> u16 {
    let sign = ((x.to_bits() >> 16) & 0x8000) as u16;
    let x = x.abs();
    if x.is_nan() {
        return 0;
    }
    if x >= MOST_HALF {
        return sign | 0x7bff;
    }
    let bits = x.to_bits();
    let exponent = (bits >> 23) as i32 - 127;
    // Below 2^-14 all have the same step.
    let shift = 13 + (-14 - exponent).clamp(0, 24) as u32;
    let mantissa = match exponent < -14 {
        true => (bits & 0x7f_ffff) | 0x80_0000,
        false => bits - ((127 - 15) << 23),
    };
    if shift > 30 {
        return sign;
    }
    let half = 1_u32 << (shift - 1);
    let rest = mantissa & ((1 << shift) - 1);
    let mut rounded = mantissa >> shift;
    if rest > half || (rest == half && rounded & 1 == 1) {
        rounded += 1;
    }
    sign | rounded as u16
}

/// The float of 16 bits as one of 32.
fn float(half: u16) -> f32 {
    let sign = if half & 0x8000 == 0 { 1.0 } else { -1.0 };
    let (exponent, mantissa) = (i32::from(half >> 10 & 31), f32::from(half & 1023));
    let magnitude = match exponent {
        0 => mantissa * 2.0_f32.powi(-24),
        31 => f32::INFINITY,
        _ => (1.0 + mantissa / 1024.0) * 2.0_f32.powi(exponent - 15),
    };
    sign * magnitude
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eval::image::srgb_decode;

    #[test]
    fn halves_round_to_nearest_and_come_back() {
        for bits in 0..0x7c00_u16 {
            assert_eq!(half(float(bits)), bits, "{bits:04x}");
            assert_eq!(half(-float(bits)), bits | 0x8000, "{bits:04x}");
            // Between two, the nearer one.
            let (low, high) = (float(bits), float(bits + 1));
            if bits + 1 < 0x7c00 {
                assert_eq!(half(low + 0.25 * (high - low)), bits, "{bits:04x}");
                assert_eq!(half(low + 0.75 * (high - low)), bits + 1, "{bits:04x}");
                assert_eq!(half(low + 0.5 * (high - low)) & 1, 0, "{bits:04x}");
            }
        }
        assert_eq!(float(half(1e9)), 65504.0);
        assert_eq!(half(f32::NAN), 0);
        assert_eq!(float(half(-1.0 / 3.0)), -0.333_251_95);
    }

    #[test]
    fn formats_hold_their_own_values() {
        for byte in 0..=255_u8 {
            let bytes = [byte, 255 - byte, byte / 2, byte];
            for format in [TexelFormat::Rgba8Unorm, TexelFormat::Rgba8UnormSrgb] {
                assert_eq!(format.encode(format.decode(&bytes)), bytes, "{format:?}");
            }
        }
        // Half a step of a dark colour is less.
        for (x, held) in [
            (-0.4 * STEP, [true, false]),
            (-0.6 * STEP, [false; 2]),
            (1.0 + STEP, [false, true]),
        ] {
            let formats = [TexelFormat::Rgba8Unorm, TexelFormat::Rgba8UnormSrgb];
            assert_eq!(formats.map(|format| format.holds(&[x])), held, "{x}");
        }
        assert!(!TexelFormat::Rgba8UnormSrgb.holds(&[0.5, 0.5, 0.5, 1.0 + STEP]));
        let dark = srgb_decode(0.5 * STEP + 3.0 * STEP);
        let apart = |format: TexelFormat| (format.rounded([dark; 4])[0] - dark).abs();
        assert!(apart(TexelFormat::Rgba8UnormSrgb) < apart(TexelFormat::Rgba8Unorm));
    }
}
