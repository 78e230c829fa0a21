//! How near a texture is to a short sum of functions of its coordinates.

use super::sample::cube_direction;
use super::{Dimension, Level, Texture};
use lodc_passes::basis::{Basis, Lobe, MOST_LIGHTS, lobe_at};
use lodc_passes::facts::Fit;
use lodc_passes::least_squares::LeastSquares;

/// The longest edge of a MIP level that is fitted: what is finer no such sum can follow, and may be filtered out by a read.
const EDGE: u32 = 8;
/// The same for lights, which may be smaller.
const EDGE_OF_LIGHTS: u32 = 16;
/// How narrow lights may be at first: about a texel of the level that is fitted is the narrowest.
const SHARPNESS: [f64; 6] = [2.0, 4.0, 8.0, 16.0, 32.0, 64.0];
/// The first step by which a light is moved, as a tangent, and how often it is halved.
const STEP: f64 = 0.1;
const HALVINGS: u32 = 4;
/// Keeps the equations of a texture of few texels solvable.
const DAMPING: f64 = 1e-9;

impl Texture {
    /// The sums of functions of its coordinates that are nearest to it, simplest first: polynomials of a texture of two
    /// dimensions, spherical harmonics and lights of a cube map, by least squares over a coarse MIP level. Nothing of other textures, of
    /// arrays, of what has no MIP levels and is large, and of a texture that is the same everywhere.
    pub fn fits(&self) -> Vec<Fit> {
        let up_to = |edge: u32| {
            let mut levels = self.levels.iter();
            levels.find(|level| level.width.max(level.height) <= edge)
        };
        let (Some(level), 1) = (up_to(EDGE), self.layers()) else {
            return Vec::new();
        };
        let samples = level.samples(self.dimension);
        let of = |basis: Basis| fit((basis, &[]), &samples);
        match self.dimension {
            Dimension::D2 => {
                let bases = [1, 3].map(Basis::Polynomial);
                bases.into_iter().filter_map(of).collect()
            }
            Dimension::Cube => {
                let level = up_to(EDGE_OF_LIGHTS).unwrap_or(level);
                let mut lights = lights(&level.samples(self.dimension)).into_iter();
                let [first, second] = [1, 2].map(|band| of(Basis::Harmonics(band)));
                // By their work: two lights cost as much as the second band.
                let mut fits: Vec<Fit> = first.into_iter().chain(lights.by_ref().take(2)).collect();
                fits.extend(second);
                fits.extend(lights);
                fits
            }
            Dimension::D3 => Vec::new(),
        }
    }
}

/// A texel: its coordinates, the part of the texture that it is, and its channels.
type Sample = ([f64; 3], f64, [f64; 4]);

impl Level {
    /// Its texels, those of a cube map by their directions and the angle that each takes up.
    fn samples(&self, dimension: Dimension) -> Vec<Sample> {
        let texels = self.texels.iter().enumerate();
        let sample = |(i, texel): (usize, &[f32; 4])| {
            let (width, height) = (self.width as usize, self.height as usize);
            let middle = |at: usize, of: usize| (at as f32 + 0.5) / of as f32;
            let (s, t) = (middle(i % width, width), middle(i / width % height, height));
            let texel = texel.map(f64::from);
            match dimension {
                Dimension::Cube => {
                    let place = cube_direction(i / (width * height), s, t).map(f64::from);
                    let square: f64 = place.iter().map(|c| c * c).sum();
                    (place, 1.0 / (square * square.sqrt()), texel)
                }
                _ => ([f64::from(s), f64::from(t), 0.5], 1.0, texel),
            }
        };
        texels.map(sample).collect()
    }
}

/// The fits of one light and more, one more each.
///
/// A light is where it takes most of what the fit before has left. It starts at the brightest texel of that, and is moved, and
/// made narrower or wider, as long as it takes more; then so are the others, and all that is a factor is solved for anew.
fn lights(samples: &[Sample]) -> Vec<Fit> {
    let mut fits: Vec<Fit> = Vec::new();
    let Some(mut before) = fit((Basis::Harmonics(1), &[]), samples) else {
        return fits;
    };
    for count in 1..=MOST_LIGHTS {
        let rest = left(&before, None, samples);
        let bright = |sample: &Sample| sample.2.iter().sum::<f64>();
        let brightest = rest.iter().max_by(|a, b| bright(a).total_cmp(&bright(b)));
        let Some(lobe) = brightest.map(|(peak, _, _)| climbed(*peak, &rest)) else {
            break;
        };
        let mut lobes = before.lobes.clone();
        lobes.push(lobe);
        // What the others take of it, and it of them, is known only when all are there.
        for at in 0..=lobes.len() {
            let Some(fit) = fit((Basis::Lights(count), &lobes), samples) else {
                return fits;
            };
            if let Some(lobe) = lobes.get_mut(at) {
                *lobe = climbed(unit(lobe.map(f64::from)), &left(&fit, Some(at), samples));
            }
            before = fit;
        }
        fits.push(before.clone());
    }
    fits
}

/// What a fit leaves of texels, or would without one of its lights.
fn left(fit: &Fit, without: Option<usize>, samples: &[Sample]) -> Vec<Sample> {
    let without = without.map(|light| fit.numbers.len() - fit.lobes.len() + light);
    let rest = |(place, weight, texel): &Sample| {
        let functions = fit.basis.values(*place, &fit.lobes);
        let terms = functions.iter().zip(&fit.numbers).enumerate();
        let mut rest = *texel;
        for (_, (function, numbers)) in terms.filter(|(at, _)| Some(*at) != without) {
            for (rest, number) in rest.iter_mut().zip(numbers) {
                *rest -= function * f64::from(*number);
            }
        }
        (unit(*place), *weight, rest)
    };
    samples.iter().map(rest).collect()
}

/// A light at a peak, or beside it, that takes more than those around it.
fn climbed(peak: [f64; 3], left: &[Sample]) -> Lobe {
    let lobe = |direction: [f64; 3], sharpness: f64| direction.map(|c| (c * sharpness) as f32);
    // How much less of the squares it leaves: by channel, what is seen of it, squared.
    let taken = |direction: [f64; 3], sharpness: f64| {
        let lobe = lobe(direction, sharpness);
        let (mut seen, mut square) = ([0.0; 4], 0.0);
        for (place, weight, texel) in left {
            let value = lobe_at(lobe, *place);
            square += weight * value * value;
            for (seen, texel) in seen.iter_mut().zip(texel) {
                *seen += weight * value * texel;
            }
        }
        seen.iter().map(|seen| seen * seen).sum::<f64>() / square
    };
    let mut best = (f64::NEG_INFINITY, peak, SHARPNESS[0]);
    let judge = |best: &mut (f64, [f64; 3], f64), direction: [f64; 3], sharpness: f64| {
        let taken = taken(direction, sharpness);
        let better = taken > best.0;
        if better {
            *best = (taken, direction, sharpness);
        }
        better
    };
    for sharpness in SHARPNESS {
        judge(&mut best, peak, sharpness);
    }
    for halvings in 0..HALVINGS {
        let step = STEP / f64::from(1_u32 << halvings);
        for axis in 0..3 {
            for sign in [-1.0, 1.0] {
                let (_, mut direction, sharpness) = best;
                direction[axis] += sign * step;
                judge(&mut best, unit(direction), sharpness);
            }
        }
        for factor in [1.0 + 4.0 * step, 1.0 / (1.0 + 4.0 * step)] {
            let (_, direction, sharpness) = best;
            judge(&mut best, direction, sharpness * factor);
        }
    }
    let (_, direction, sharpness) = best;
    lobe(direction, sharpness)
}

fn unit(direction: [f64; 3]) -> [f64; 3] {
    let length = direction.iter().map(|c| c * c).sum::<f64>().sqrt();
    direction.map(|c| c / length)
}

/// The nearest sum, with its lights where they are, unless there is nothing to follow.
fn fit((basis, lobes): (Basis, &[Lobe]), samples: &[Sample]) -> Option<Fit> {
    let functions: Vec<Vec<f64>> = samples
        .iter()
        .map(|(place, _, _)| basis.values(*place, lobes))
        .collect();
    let whole: f64 = samples.iter().map(|(_, weight, _)| weight).sum();
    let mut numbers = vec![[0.0_f32; 4]; basis.count()];
    let (mut left, mut variance) = (0.0, 0.0);
    for channel in 0..4 {
        let mut equations = LeastSquares::new(basis.count());
        for ((_, weight, texel), functions) in samples.iter().zip(&functions) {
            let root = weight.sqrt();
            let slopes: Vec<f64> = functions.iter().map(|f| root * f).collect();
            equations.add(&slopes, root * texel[channel]);
        }
        let found = equations.solve(DAMPING)?;
        let sum = |of: &dyn Fn(&Sample) -> f64| samples.iter().map(of).sum::<f64>();
        let mean = sum(&|(_, weight, texel)| weight * texel[channel]) / whole;
        variance += sum(&|(_, weight, texel)| weight * (texel[channel] - mean).powi(2));
        for ((_, weight, texel), functions) in samples.iter().zip(&functions) {
            let made: f64 = functions.iter().zip(&found).map(|(f, n)| f * n).sum();
            left += weight * (texel[channel] - made).powi(2);
        }
        for (number, found) in numbers.iter_mut().zip(&found) {
            number[channel] = *found as f32;
        }
    }
    (variance > 0.0).then(|| Fit {
        basis,
        numbers,
        lobes: lobes.to_vec(),
        left: (left / variance).min(1.0),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::texture::Image;

    const SIZE: u32 = 24;

    fn texture(dimension: Dimension, colour: impl Fn([f32; 3]) -> f32) -> Texture {
        let faces = if dimension == Dimension::Cube { 6 } else { 1 };
        let middle = |i: u32| (i as f32 + 0.5) / SIZE as f32;
        let images = (0..faces).map(|face| Image {
            width: SIZE,
            height: SIZE,
            texels: (0..SIZE * SIZE)
                .map(|i| {
                    let (s, t) = (middle(i % SIZE), middle(i / SIZE));
                    let place = match dimension {
                        Dimension::Cube => cube_direction(face, s, t),
                        _ => [s, t, 0.0],
                    };
                    [colour(place), 0.5, 0.0, 1.0]
                })
                .collect(),
        });
        Texture::new(dimension, images.collect())
            .expect("it is whole")
            .with_mip_chain()
    }

    #[test]
    fn what_is_such_a_sum_is_found() {
        let ramp = texture(Dimension::D2, |[u, v, _]| 0.25 + 0.5 * u - 0.125 * v);
        let fits = ramp.fits();
        assert_eq!(fits[0].basis, Basis::Polynomial(1));
        assert!(fits[0].left < 1e-6, "{fits:?}");
        let near = |a: f32, b: f32| (a - b).abs() < 1e-4;
        let [constant, u, v] = fits[0].numbers[..] else {
            panic!("a plane has three numbers");
        };
        assert!(near(constant[0], 0.4375) && near(u[0], 0.25) && near(v[0], -0.0625));
        assert!(near(constant[1], 0.5) && near(constant[3], 1.0));

        let light = |d: [f32; 3]| {
            let length = d.iter().map(|c| c * c).sum::<f32>().sqrt();
            0.5 + 0.25 * d[1] / length + 0.125 * (d[2] / length).powi(2)
        };
        let fits = texture(Dimension::Cube, light).fits();
        assert_eq!(fits[0].basis, Basis::Harmonics(1));
        let second = fits.iter().find(|fit| fit.basis == Basis::Harmonics(2));
        let second = second.expect("it is thought of");
        assert!(second.left < 1e-4 && fits[0].left > 1e-2, "{fits:?}");
    }

    #[test]
    fn two_bright_spots_are_two_lights() {
        let lamps = [
            ([0.6, 0.0, 0.8], 12.0, 4.0),
            ([-0.48, 0.8, -0.36], 20.0, 2.0),
        ];
        let sky = texture(Dimension::Cube, |d| {
            let direction = unit(d.map(f64::from));
            let of_lamp = |(towards, sharpness, colour): ([f64; 3], f64, f64)| {
                let lobe = towards.map(|c| (c * sharpness) as f32);
                colour * lobe_at(lobe, direction)
            };
            (0.25 + 0.1 * direction[1] + lamps.map(of_lamp).iter().sum::<f64>()) as f32
        });
        let fits = sky.fits();
        let bases: Vec<Basis> = fits.iter().map(|fit| fit.basis).collect();
        assert_eq!(
            bases[..4],
            [
                Basis::Harmonics(1),
                Basis::Lights(1),
                Basis::Lights(2),
                Basis::Harmonics(2)
            ]
        );
        // The harmonics follow neither, and the first light the brighter one.
        let left: Vec<f64> = fits.iter().map(|fit| fit.left).collect();
        assert!(
            left[0] > 0.5 && left[1] < 0.6 * left[0] && left[2] < 0.02 && left[2] < 0.1 * left[3],
            "{left:?}"
        );
        for ((towards, sharpness, colour), (lobe, number)) in lamps
            .into_iter()
            .zip(fits[2].lobes.iter().zip(&fits[2].numbers[4..]))
        {
            let found = lobe.map(f64::from);
            let length = found.iter().map(|c| c * c).sum::<f64>().sqrt();
            let cosine: f64 = unit(found).iter().zip(towards).map(|(a, b)| a * b).sum();
            assert!(cosine > 0.998, "{lobe:?} {towards:?}");
            assert!(
                (0.6..1.4).contains(&(length / sharpness)),
                "{length} {sharpness}"
            );
            assert!(
                (0.7..1.3).contains(&(f64::from(number[0]) / colour)),
                "{number:?} {colour}"
            );
        }
    }

    #[test]
    fn what_is_not_smooth_is_left_and_what_is_even_has_none() {
        let noisy = texture(Dimension::D2, |[u, v, _]| {
            (57.0 * u).sin() * (91.0 * v).cos()
        });
        assert!(noisy.fits().iter().all(|fit| fit.left > 0.9));
        assert!(texture(Dimension::D2, |_| 0.25).fits().is_empty());
    }
}
