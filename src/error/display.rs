//! What a display shows of a colour that a shader returns.

use crate::eval::image::{srgb_decode, srgb_encode};
use crate::scene::{Output, ToneMapping};

/// What a display shows of a fragment's colour, in linear light of 0..1. Light below 0 shows as none and
/// infinite light as the brightest; NaN stays NaN.
pub fn displayed(output: Output, colour: [f32; 4]) -> [f32; 3] {
    let [r, g, b, _] = colour;
    [r, g, b].map(|c| {
        if c.is_nan() {
            return c;
        }
        match output {
            Output::Display => c.clamp(0.0, 1.0),
            Output::Encoded => srgb_decode(c),
            Output::Linear {
                exposure,
                tone_mapping,
            } => {
                let light = (c * exposure).max(0.0);
                let mapped = match tone_mapping {
                    ToneMapping::None => light,
                    ToneMapping::Reinhard => light / (1.0 + light),
                    // Narkowicz 2015.
                    ToneMapping::Aces => {
                        light * (2.51 * light + 0.03) / (light * (2.43 * light + 0.59) + 0.14)
                    }
                };
                // The quotient of two infinities: a light without a limit is as bright as can be.
                if mapped.is_nan() {
                    1.0
                } else {
                    mapped.min(1.0)
                }
            }
        }
    })
}

/// What the target holds of a fragment's colour that is to be blended: 0..1 in a target that a display shows, light
/// without a limit in another. Alpha is 0..1; NaN stays NaN.
pub fn held(output: Output, colour: [f32; 4]) -> [f32; 4] {
    let [r, g, b, a] = colour;
    let [r, g, b] = match output {
        Output::Display | Output::Encoded => [r, g, b].map(|c| c.clamp(0.0, 1.0)),
        Output::Linear { .. } => [r, g, b],
    };
    [r, g, b, a.clamp(0.0, 1.0)]
}

/// What a display shows over a white background more than over a black one where a pixel holds a premultiplied colour
/// and coverage: the light that comes through, 0..1. Over the black one it shows [`displayed`].
///
/// Blending is done where the target does it: in linear light, or, when the shader returns encoded values, in those.
/// Light without a limit meets the background when it is on the display, for which no light is white there.
pub fn through(output: Output, [r, g, b, a]: [f32; 4]) -> [f32; 3] {
    let kept = 1.0 - a;
    let black = displayed(output, [r, g, b, a]);
    match output {
        Output::Display | Output::Linear { .. } => black.map(|black| kept.min(1.0 - black)),
        Output::Encoded => {
            let white = displayed(output, [r + kept, g + kept, b + kept, a]);
            std::array::from_fn(|i| white[i] - black[i])
        }
    }
}

/// Linear light as sRGB, 0..1: what the error compares. NaN stays NaN.
pub fn encoded(light: [f32; 3]) -> [f32; 3] {
    light.map(|c| if c.is_nan() { c } else { srgb_encode(c) })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn linear(exposure: f32, tone_mapping: ToneMapping) -> Output {
        Output::Linear {
            exposure,
            tone_mapping,
        }
    }

    /// All three channels alike.
    fn shows(output: Output, value: f32) -> f32 {
        let [r, g, b] = displayed(output, [value, value, value, 0.3]);
        assert_eq!((r, g), (g, b));
        r
    }

    #[test]
    fn numbers_worked_out_by_hand() {
        for (output, value, light) in [
            (Output::Display, 0.25, 0.25),
            // ((0.5 + 0.055) / 1.055)^2.4
            (Output::Encoded, 0.5, 0.214_041_14),
            (linear(2.0, ToneMapping::None), 0.25, 0.5),
            (linear(4.0, ToneMapping::None), 0.5, 1.0),
            // 3 / (1 + 3)
            (linear(1.5, ToneMapping::Reinhard), 2.0, 0.75),
            // 1 * 2.54 / (3.02 + 0.14)
            (linear(0.5, ToneMapping::Aces), 2.0, 0.803_797_5),
            // 0.1 * 0.281 / (0.1 * 0.833 + 0.14)
            (linear(1.0, ToneMapping::Aces), 0.1, 0.125_839_68),
        ] {
            let found = shows(output, value);
            assert!((found - light).abs() < 1e-6, "{output:?} {value}: {found}");
        }
        // 1.055 * 0.25^(1 / 2.4) - 0.055
        let shown = encoded(displayed(Output::Display, [0.25, 0.25, 0.25, 1.0]));
        assert!((shown[0] - 0.537_099).abs() < 1e-6, "{shown:?}");
    }

    #[test]
    fn a_white_background_comes_through_where_the_target_blends() {
        let reinhard = linear(1.5, ToneMapping::Reinhard);
        for (output, [light, alpha], light_through) in [
            (Output::Display, [0.25, 0.5], 0.5),
            (Output::Display, [0.25, 1.0], 0.0),
            (Output::Display, [0.0, 0.0], 1.0),
            // White cannot get brighter than white.
            (Output::Display, [0.875, 0.0], 0.125),
            // Encoded values are blended: 0.5 over white is 1, over black it is 0.214 of light.
            (Output::Encoded, [0.5, 0.5], 1.0 - 0.214_041_14),
            (Output::Encoded, [0.5, 1.0], 0.0),
            // 3 / (1 + 3) over black leaves a quarter.
            (reinhard, [2.0, 0.875], 0.125),
            (reinhard, [2.0, 0.5], 0.25),
        ] {
            let found = through(output, [light, light, light, alpha]);
            assert!(
                (found[0] - light_through).abs() < 1e-6,
                "{output:?} {light} {alpha}: {found:?}"
            );
        }
        assert_eq!(
            held(Output::Display, [2.0, -1.0, 0.5, 3.0]),
            [1.0, 0.0, 0.5, 1.0]
        );
        assert_eq!(
            held(reinhard, [2.0, -1.0, 0.5, -3.0]),
            [2.0, -1.0, 0.5, 0.0]
        );
    }

    #[test]
    fn what_a_display_cannot_show_is_clamped_and_nan_is_kept() {
        let outputs = [
            Output::Display,
            Output::Encoded,
            linear(1.0, ToneMapping::None),
            linear(1.0, ToneMapping::Reinhard),
            linear(1.0, ToneMapping::Aces),
            linear(f32::MIN_POSITIVE, ToneMapping::Aces),
        ];
        for output in outputs {
            // Negative light is what scRGB has for colours outside of sRGB.
            for (value, light) in [
                (-0.5, 0.0),
                (f32::NEG_INFINITY, 0.0),
                (f32::INFINITY, 1.0),
                (0.0, 0.0),
            ] {
                assert_eq!(shows(output, value), light, "{output:?} {value}");
            }
            assert!(displayed(output, [f32::NAN; 4])[0].is_nan(), "{output:?}");
            assert!(
                encoded(displayed(output, [f32::NAN; 4]))[0].is_nan(),
                "{output:?}"
            );
        }
        assert_eq!(shows(linear(1.0, ToneMapping::Aces), f32::MAX), 1.0);
        assert_eq!(shows(linear(f32::MAX, ToneMapping::None), f32::MAX), 1.0);
    }
}
