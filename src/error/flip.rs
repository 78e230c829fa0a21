//! FLIP: how large the difference of two pictures looks to someone who flips between them, pixel by pixel, 0 to 1.
//!
//! LDR-FLIP. Colours are blurred as far as the eye blurs them at a number of pixels per degree, and compared in a
//! space where equal steps look alike; differences of edges and points then raise the result. All in f64 and in
//! software arithmetic, so that it is the same on every machine.
//!
//! This work is based on: Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild, "FLIP: A Difference Evaluator
//! for Alternating Images", 2020, sections 4.1 and 4.2.

use crate::eval::image::srgb_decode;

/// The eye's blur of the achromatic, red-green and blue-yellow channel: weights and widths of two Gaussians (table 1).
const BLUR: [[(f64, f64); 2]; 3] = [
    [(1.0, 0.0047), (0.0, 1e-5)],
    [(1.0, 0.0053), (0.0, 1e-5)],
    [(34.1, 0.04), (13.5, 0.025)],
];

/// Width of a feature that stands out, in degrees.
const FEATURE: f64 = 0.082;
/// Exponents of the colour and of the feature difference.
const COLOUR_POWER: f64 = 0.7;
const FEATURE_POWER: f64 = 0.5;
/// Colour differences up to this share of the largest are spread over this share of 0..1.
const KNEE: (f64, f64) = (0.4, 0.95);

/// The white of sRGB in XYZ: the row sums of [`to_xyz`].
const WHITE: [f64; 3] = [0.950_428_545_377_181, 1.0, 1.088_900_370_798_127_8];

/// A picture of three channels, row by row.
struct Image {
    width: usize,
    height: usize,
    pixels: Vec<[f64; 3]>,
}

/// FLIP at every pixel of two pictures of one size, row by row. Colours are sRGB-encoded, 0..1; a NaN is the
/// colour furthest from the other picture's. Beyond their edges the pictures go on as they end.
pub(crate) fn flip(
    width: usize,
    reference: &[[f32; 3]],
    test: &[[f32; 3]],
    pixels_per_degree: f64,
) -> Vec<f64> {
    let opposite = |c: f32| if c < 0.5 { 1.0 } else { 0.0 };
    let tested: Vec<[f32; 3]> = test
        .iter()
        .zip(reference)
        .map(|(test, reference)| {
            std::array::from_fn(|i| {
                if test[i].is_nan() {
                    opposite(reference[i])
                } else {
                    test[i]
                }
            })
        })
        .collect();
    let height = reference.len().checked_div(width).unwrap_or(0);
    let [a, b] = [reference, &tested].map(|colours| {
        let opponent = Image {
            width,
            height,
            pixels: colours.iter().map(|c| to_opponent(*c)).collect(),
        };
        (
            perceived(&opponent, pixels_per_degree),
            features(&opponent, pixels_per_degree),
        )
    });
    let largest = {
        let [green, blue] = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|c| hunt(to_lab(to_xyz(c))));
        libm::pow(hyab(green, blue), COLOUR_POWER)
    };
    let colours = a.0.iter().zip(&b.0);
    let features = a.1.iter().zip(&b.1);
    colours
        .zip(features)
        .map(|((a, b), ([edge_a, point_a], [edge_b, point_b]))| {
            let distance = libm::pow(hyab(*a, *b), COLOUR_POWER);
            let (knee, share) = (KNEE.0 * largest, KNEE.1);
            let colour = if distance < knee {
                share / knee * distance
            } else {
                share + (distance - knee) / (largest - knee) * (1.0 - share)
            };
            let feature = (edge_a - edge_b).abs().max((point_a - point_b).abs());
            let feature = libm::pow(feature * std::f64::consts::FRAC_1_SQRT_2, FEATURE_POWER);
            libm::pow(colour.clamp(0.0, 1.0), 1.0 - feature.min(1.0))
        })
        .collect()
}

/// How many pixels away a pixel has an influence on FLIP.
pub(crate) fn reach(pixels_per_degree: f64) -> usize {
    blur_radius(pixels_per_degree).max(feature_radius(pixels_per_degree))
}

fn blur_radius(pixels_per_degree: f64) -> usize {
    let widest = BLUR.as_flattened().iter().fold(0.0, |w: f64, g| w.max(g.1));
    let deviation = (widest / (2.0 * std::f64::consts::PI.powi(2))).sqrt();
    (3.0 * deviation * pixels_per_degree).ceil() as usize
}

fn feature_radius(pixels_per_degree: f64) -> usize {
    (3.0 * 0.5 * FEATURE * pixels_per_degree).ceil() as usize
}

fn to_xyz([r, g, b]: [f64; 3]) -> [f64; 3] {
    [
        (10_135_552.0 * r + 8_788_810.0 * g + 4_435_075.0 * b) / 24_577_794.0,
        (2_613_072.0 * r + 8_788_810.0 * g + 887_015.0 * b) / 12_288_897.0,
        (1_425_312.0 * r + 8_788_810.0 * g + 70_074_185.0 * b) / 73_733_382.0,
    ]
}

/// The inverse of [`to_xyz`].
fn to_rgb([x, y, z]: [f64; 3]) -> [f64; 3] {
    [
        3.241_003_275_977_082 * x - 1.537_398_934_486_727 * y - 0.498_615_859_610_461 * z,
        -0.969_224_232_029_797 * x + 1.875_929_946_957_377 * y + 0.041_554_205_577_176 * z,
        0.055_639_423_464_477 * x - 0.204_011_201_834_898 * y + 1.057_148_933_749_832 * z,
    ]
}

/// An encoded colour as lightness, red-green and blue-yellow, linear in light (YCxCz).
fn to_opponent(encoded: [f32; 3]) -> [f64; 3] {
    let xyz = to_xyz(encoded.map(|c| f64::from(srgb_decode(c))));
    let [x, y, z] = [0, 1, 2].map(|i| xyz[i] / WHITE[i]);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn from_opponent([lightness, red_green, blue_yellow]: [f64; 3]) -> [f64; 3] {
    let y = (lightness + 16.0) / 116.0;
    let xyz = [y + red_green / 500.0, y, y - blue_yellow / 200.0];
    to_rgb([0, 1, 2].map(|i| xyz[i] * WHITE[i]))
}

fn to_lab(xyz: [f64; 3]) -> [f64; 3] {
    const STEP: f64 = 6.0 / 29.0;
    let [x, y, z] = [0, 1, 2].map(|i| {
        let t = xyz[i] / WHITE[i];
        if t > STEP * STEP * STEP {
            libm::cbrt(t)
        } else {
            t / (3.0 * STEP * STEP) + 4.0 / 29.0
        }
    });
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// Bright colours look more colourful.
fn hunt([l, a, b]: [f64; 3]) -> [f64; 3] {
    [l, 0.01 * l * a, 0.01 * l * b]
}

fn hyab(a: [f64; 3], b: [f64; 3]) -> f64 {
    let [l, x, y] = [0, 1, 2].map(|i| a[i] - b[i]);
    l.abs() + (x * x + y * y).sqrt()
}

/// What the eye sees of a picture's colours.
fn perceived(picture: &Image, pixels_per_degree: f64) -> Vec<[f64; 3]> {
    let radius = blur_radius(pixels_per_degree) as i64;
    let mut seen = vec![[0.0; 3]; picture.pixels.len()];
    for (channel, gaussians) in BLUR.iter().enumerate() {
        let kernels = gaussians.map(|(weight, width)| {
            let kernel: Vec<f64> = (-radius..=radius)
                .map(|i| {
                    let degrees = i as f64 / pixels_per_degree;
                    libm::exp(-std::f64::consts::PI.powi(2) * degrees * degrees / width)
                })
                .collect();
            (weight * (std::f64::consts::PI / width).sqrt(), kernel)
        });
        let total: f64 = kernels
            .iter()
            .map(|(weight, kernel)| weight * kernel.iter().sum::<f64>().powi(2))
            .sum();
        for (weight, kernel) in kernels.iter().filter(|(weight, _)| *weight > 0.0) {
            let plane: Vec<f64> = picture.pixels.iter().map(|p| p[channel]).collect();
            let blurred = convolve(picture, &plane, kernel, kernel);
            for (seen, value) in seen.iter_mut().zip(blurred) {
                seen[channel] += value * weight / total;
            }
        }
    }
    seen.into_iter()
        .map(|opponent| {
            hunt(to_lab(to_xyz(
                from_opponent(opponent).map(|c| c.clamp(0.0, 1.0)),
            )))
        })
        .collect()
}

/// How strong edges and points are at every pixel.
fn features(picture: &Image, pixels_per_degree: f64) -> Vec<[f64; 2]> {
    let deviation = 0.5 * FEATURE * pixels_per_degree;
    let radius = feature_radius(pixels_per_degree) as i64;
    let kernel = |of: &dyn Fn(f64) -> f64| -> Vec<f64> {
        let gaussian = |x: f64| libm::exp(-x * x / (2.0 * deviation * deviation));
        let values: Vec<f64> = (-radius..=radius)
            .map(|i| of(i as f64) * gaussian(i as f64))
            .collect();
        // What is above 0 sums to 1, what is below to -1.
        let above: f64 = values.iter().filter(|v| **v > 0.0).sum();
        let below: f64 = -values.iter().filter(|v| **v < 0.0).sum::<f64>();
        let scaled = |v: &f64| match *v > 0.0 {
            true => v / above,
            false if below > 0.0 => v / below,
            false => 0.0,
        };
        values.iter().map(scaled).collect()
    };
    let smooth = kernel(&|_| 1.0);
    let edge = kernel(&|x| -x);
    let point = kernel(&|x| x * x / (deviation * deviation) - 1.0);
    let light: Vec<f64> = picture
        .pixels
        .iter()
        .map(|p| (p[0] + 16.0) / 116.0)
        .collect();
    let strength = |kernel: &[f64]| -> Vec<f64> {
        let across = convolve(picture, &light, kernel, &smooth);
        let along = convolve(picture, &light, &smooth, kernel);
        let pairs = across.iter().zip(&along);
        pairs.map(|(x, y)| (x * x + y * y).sqrt()).collect()
    };
    let (edges, points) = (strength(&edge), strength(&point));
    edges.into_iter().zip(points).map(|(e, p)| [e, p]).collect()
}

/// A plane of a picture's size, convolved with a kernel along rows and one along columns.
fn convolve(picture: &Image, plane: &[f64], row: &[f64], column: &[f64]) -> Vec<f64> {
    let (width, height) = (picture.width, picture.height);
    let mut across = vec![0.0; plane.len()];
    let at = |i: usize, k: usize, radius: usize, size: usize| {
        (i + k).saturating_sub(radius).min(size.saturating_sub(1))
    };
    for y in 0..height {
        let line = &plane[y * width..(y + 1) * width];
        for x in 0..width {
            let radius = row.len() / 2;
            let terms = row.iter().enumerate();
            across[y * width + x] = terms.map(|(k, w)| w * line[at(x, k, radius, width)]).sum();
        }
    }
    let mut out = vec![0.0; plane.len()];
    for y in 0..height {
        for (k, weight) in column.iter().enumerate() {
            let from = at(y, k, column.len() / 2, height) * width;
            for x in 0..width {
                out[y * width + x] += weight * across[from + x];
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: (usize, usize) = (24, 16);

    /// Pictures that are written the same in any language: bands, bands that jump in the middle, a checkerboard, grey.
    fn picture(kind: usize) -> Vec<[f32; 3]> {
        let (width, height) = SIZE;
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        pixels
            .map(|(x, y)| {
                [0, 1, 2].map(|c| {
                    let band = x * 7 + y * 13 + c * 29;
                    match kind {
                        0 => (band % 64) as f32 / 63.0,
                        1 => ((band + if x > 11 { 9 } else { 0 }) % 64) as f32 / 63.0,
                        2 => ((x / 4 + y / 4) % 2) as f32,
                        _ => 0.5,
                    }
                })
            })
            .collect()
    }

    /// What the authors' own program says of these pictures: PyPI `flip-evaluator` 1.7, `evaluate(reference, test, "LDR",
    /// inputsRGB=True, applyMagma=False, parameters={"ppd": ...})`, the mean and the pixels (0, 0), (12, 8), (23, 15), (5, 10).
    #[test]
    fn the_authors_program_says_the_same() {
        for (reference, test, pixels_per_degree, mean, pixels) in [
            (0, 1, 67.0, 0.219809, [0.0, 0.297024, 0.410980, 0.001808]),
            (0, 1, 30.0, 0.342055, [0.0, 0.689951, 0.580276, 0.0]),
            (
                2,
                3,
                67.0,
                0.666038,
                [0.968894, 0.617620, 0.968894, 0.826154],
            ),
            (
                2,
                3,
                30.0,
                0.889273,
                [0.943509, 0.890954, 0.943509, 0.955905],
            ),
            (
                3,
                2,
                67.0,
                0.666038,
                [0.968894, 0.617620, 0.968894, 0.826154],
            ),
        ] {
            let map = flip(
                SIZE.0,
                &picture(reference),
                &picture(test),
                pixels_per_degree,
            );
            let found = map.iter().sum::<f64>() / map.len() as f64;
            let what = format!("{reference} {test} {pixels_per_degree}");
            assert!((found - mean).abs() < 1e-4, "{what}: {found}, not {mean}");
            let places = [(0, 0), (12, 8), (23, 15), (5, 10)];
            for ((x, y), pixel) in places.into_iter().zip(pixels) {
                let found = map[y * SIZE.0 + x];
                assert!(
                    (found - pixel).abs() < 2e-4,
                    "{what} ({x}, {y}): {found}, not {pixel}"
                );
            }
        }
    }

    #[test]
    fn a_picture_does_not_differ_from_itself_and_a_nan_does() {
        let picture = picture(0);
        assert!(
            flip(SIZE.0, &picture, &picture, 67.0)
                .iter()
                .all(|f| *f < 1e-6)
        );
        let mut broken = picture.clone();
        broken[30] = [f32::NAN; 3];
        let map = flip(SIZE.0, &picture, &broken, 67.0);
        assert!(map[30] > 0.1 && map.iter().all(|f| (0.0..=1.0).contains(f)));
        assert!(flip(0, &[], &[], 67.0).is_empty());
    }
}
