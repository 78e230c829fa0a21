//! Formats of render targets: what is left of a colour that is written to one and read again.

use crate::eval::image::{srgb_decode, srgb_encode};
use lodc_passes::semantics::words::{float_to_half, half_to_float};
use naga::ScalarKind;

/// The format of a render target, as WebGPU names them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Format {
    name: &'static str,
    /// How many components are stored; the others read 0, alpha 1.
    components: usize,
    coding: Coding,
}

/// How a component is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Coding {
    /// 0..1 in so many steps.
    Unorm(u32),
    /// -1..1 in so many steps to either side.
    Snorm(u32),
    /// 0..1 in 255 steps, encoded as sRGB but for alpha.
    Srgb,
    /// 0..1 in 1023 steps, alpha in 3.
    Unorm1010102,
    /// Half precision.
    Half,
    /// Without a sign, five bits of exponent and six of fraction, blue five.
    Half11,
    /// As it is.
    Single,
    /// Unsigned, of so many bits.
    Uint(u32),
    /// Signed, of so many bits.
    Sint(u32),
}

use Coding::{Half, Half11, Single, Sint, Snorm, Srgb, Uint, Unorm, Unorm1010102};

const FORMATS: [(&str, usize, Coding); 35] = [
    ("r8unorm", 1, Unorm(255)),
    ("r8snorm", 1, Snorm(127)),
    ("r8uint", 1, Uint(8)),
    ("r8sint", 1, Sint(8)),
    ("r16unorm", 1, Unorm(65535)),
    ("r16snorm", 1, Snorm(32767)),
    ("r16uint", 1, Uint(16)),
    ("r16sint", 1, Sint(16)),
    ("r16float", 1, Half),
    ("rg8unorm", 2, Unorm(255)),
    ("rg8snorm", 2, Snorm(127)),
    ("rg8uint", 2, Uint(8)),
    ("rg8sint", 2, Sint(8)),
    ("r32float", 1, Single),
    ("rg16unorm", 2, Unorm(65535)),
    ("rg16snorm", 2, Snorm(32767)),
    ("rg16uint", 2, Uint(16)),
    ("rg16sint", 2, Sint(16)),
    ("rg16float", 2, Half),
    ("rgba8unorm", 4, Unorm(255)),
    ("rgba8unorm-srgb", 4, Srgb),
    ("rgba8snorm", 4, Snorm(127)),
    ("rgba8uint", 4, Uint(8)),
    ("rgba8sint", 4, Sint(8)),
    ("bgra8unorm", 4, Unorm(255)),
    ("bgra8unorm-srgb", 4, Srgb),
    ("rgb10a2unorm", 4, Unorm1010102),
    ("rg11b10ufloat", 3, Half11),
    ("rg32float", 2, Single),
    ("rgba16unorm", 4, Unorm(65535)),
    ("rgba16snorm", 4, Snorm(32767)),
    ("rgba16uint", 4, Uint(16)),
    ("rgba16sint", 4, Sint(16)),
    ("rgba16float", 4, Half),
    ("rgba32float", 4, Single),
];

impl Format {
    /// The format of a name such as `rgba8unorm-srgb`.
    pub fn of_name(name: &str) -> Option<Self> {
        let mut all = FORMATS.into_iter();
        all.find(|(known, ..)| *known == name)
            .map(|(name, components, coding)| Self {
                name,
                components,
                coding,
            })
    }

    /// Every name.
    pub fn names() -> impl Iterator<Item = &'static str> {
        FORMATS.into_iter().map(|(name, ..)| name)
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        self.name
    }

    /// What a shader writes to it and reads from it.
    pub fn kind(self) -> ScalarKind {
        match self.coding {
            Uint(_) => ScalarKind::Uint,
            Sint(_) => ScalarKind::Sint,
            _ => ScalarKind::Float,
        }
    }

    /// How many bytes a pixel of it takes.
    pub fn bytes(self) -> u32 {
        let bits = match self.coding {
            Unorm1010102 | Half11 => return 4,
            Unorm(255) | Snorm(127) | Srgb => 8,
            Unorm(_) | Snorm(_) | Half => 16,
            Single => 32,
            Uint(bits) | Sint(bits) => bits,
        };
        bits / 8 * self.components as u32
    }

    /// What is read back of a colour that was written: rounded to the nearest number that there is, limited to
    /// what there is. A NaN is 0 where there is none.
    pub fn store(self, colour: [f32; 4]) -> [f32; 4] {
        let mut stored = [0.0, 0.0, 0.0, 1.0];
        for (component, value) in colour.into_iter().enumerate().take(self.components) {
            stored[component] = match self.coding {
                Unorm(steps) => steps_of(value, 0.0, steps),
                Snorm(steps) => steps_of(value, -1.0, steps),
                Srgb if component == 3 => steps_of(value, 0.0, 255),
                Srgb => srgb_decode(steps_of(srgb_encode(value), 0.0, 255)),
                Unorm1010102 => steps_of(value, 0.0, if component == 3 { 3 } else { 1023 }),
                Half => half_to_float(float_to_half(value)),
                Half11 => small_float(value, if component == 2 { 5 } else { 6 }),
                Single => value,
                Uint(bits) => limited(value, 0.0, ((1_u32 << bits) - 1) as f32),
                Sint(bits) => {
                    let end = (1_u32 << (bits - 1)) as f32;
                    limited(value, -end, end - 1.0)
                }
            };
        }
        stored
    }
}

/// The value within a range; NaN is 0.
fn limited(value: f32, low: f32, high: f32) -> f32 {
    if value.is_nan() {
        0.0
    } else {
        value.clamp(low, high)
    }
}

/// The nearest of the steps from 0 to 1, and as many below when `low` is -1.
fn steps_of(value: f32, low: f32, steps: u32) -> f32 {
    let steps = steps as f32;
    (limited(value, low, 1.0) * steps).round_ties_even() / steps
}

/// The nearest float without a sign, of the exponents of half precision and so many bits of fraction.
fn small_float(value: f32, fraction: u32) -> f32 {
    if value.is_nan() {
        return value;
    }
    // Half precision has ten: the rest is rounded away, and what carries goes to the exponent.
    let half = float_to_half(value.max(0.0));
    let rest = 10 - fraction;
    let (whole, cut) = (half >> rest, half & ((1 << rest) - 1));
    let middle = 1 << (rest - 1);
    let up = cut > middle || cut == middle && whole & 1 == 1;
    half_to_float((whole + u32::from(up)) << rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn store(name: &str, colour: [f32; 4]) -> [f32; 4] {
        Format::of_name(name).expect(name).store(colour)
    }

    #[test]
    fn components_that_are_not_stored_read_as_zero_and_one() {
        assert_eq!(store("r32float", [2.0; 4]), [2.0, 0.0, 0.0, 1.0]);
        assert_eq!(store("rg16float", [0.5; 4]), [0.5, 0.5, 0.0, 1.0]);
    }

    #[test]
    fn values_are_rounded_to_the_steps_that_there_are() {
        let colour = [0.5, -1.0, 2.0, f32::NAN];
        assert_eq!(store("rgba8unorm", colour), [128.0 / 255.0, 0.0, 1.0, 0.0]);
        assert_eq!(store("rgba8snorm", colour), [64.0 / 127.0, -1.0, 1.0, 0.0]);
        assert_eq!(
            store("rgb10a2unorm", [0.5, 0.5, 0.5, 0.5]),
            [512.0 / 1023.0, 512.0 / 1023.0, 512.0 / 1023.0, 2.0 / 3.0]
        );
        assert_eq!(
            store("rgba8uint", [3.0, 300.0, -1.0, 0.0]),
            [3.0, 255.0, 0.0, 0.0]
        );
        assert_eq!(
            store("rgba8sint", [3.0, 300.0, -300.0, 0.0]),
            [3.0, 127.0, -128.0, 0.0]
        );
    }

    #[test]
    fn encoded_targets_spend_their_steps_on_dark_colours() {
        // Step 1 of 255 is 1 / 255 / 12.92 in linear light.
        let dark = 1.0 / 255.0 / 12.92;
        let [r, g, _, a] = store("rgba8unorm-srgb", [dark * 1.3, dark * 0.4, 0.0, 0.5]);
        assert!((r - dark).abs() < 1e-9, "{r} {dark}");
        assert_eq!((g, a), (0.0, 128.0 / 255.0));
    }

    #[test]
    fn halves_and_smaller_floats_round_to_the_nearest() {
        let [r, g, b, _] = store("rgba16float", [1.0 + 1.0 / 2048.0, 65519.0, 1e-9, 0.0]);
        assert_eq!((r, g, b), (1.0, 65504.0, 0.0));
        // Six bits of fraction for red and green, five for blue; negative numbers are 0.
        let stored = store(
            "rg11b10ufloat",
            [1.0 + 3.0 / 128.0, -2.0, 1.0 + 3.0 / 64.0, 0.0],
        );
        assert_eq!(stored, [1.0 + 4.0 / 128.0, 0.0, 1.0 + 4.0 / 64.0, 1.0]);
    }

    #[test]
    fn what_was_stored_is_stored_as_it_is() {
        for name in Format::names() {
            let once = store(name, [0.3, 0.7, 1.3, 0.2]);
            let twice = store(name, once);
            for (a, b) in once.iter().zip(twice) {
                assert!((a - b).abs() < 1e-6, "{name}: {once:?} {twice:?}");
            }
        }
    }
}
