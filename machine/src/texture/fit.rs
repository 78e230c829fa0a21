//! How near a texture is to a short sum of functions of its coordinates.

use super::sample::cube_direction;
use super::{Dimension, Level, Texture};
use lodc_passes::basis::Basis;
use lodc_passes::facts::Fit;
use lodc_passes::least_squares::LeastSquares;

/// The longest edge of a MIP level that is fitted: what is finer no such sum can follow, and may be filtered out by a read.
const EDGE: u32 = 8;
/// Keeps the equations of a texture of few texels solvable.
const DAMPING: f64 = 1e-9;

impl Texture {
    /// The sums of functions of its coordinates that are nearest to it, simplest first: polynomials of a texture of two
    /// dimensions, spherical harmonics of a cube map, by least squares over a coarse MIP level. Nothing of other textures, of
    /// arrays, of what has no MIP levels and is large, and of a texture that is the same everywhere.
    pub fn fits(&self) -> Vec<Fit> {
        let small = |level: &&Level| level.width.max(level.height) <= EDGE;
        let (Some(level), 1) = (self.levels.iter().find(small), self.layers()) else {
            return Vec::new();
        };
        let bases = match self.dimension {
            Dimension::D2 => [Basis::Polynomial(1), Basis::Polynomial(3)],
            Dimension::Cube => [Basis::Harmonics(1), Basis::Harmonics(2)],
            Dimension::D3 => return Vec::new(),
        };
        let samples = level.samples(self.dimension);
        let fits = bases.into_iter();
        fits.filter_map(|basis| fit(basis, &samples)).collect()
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

/// The nearest sum, unless there is nothing to follow.
fn fit(basis: Basis, samples: &[Sample]) -> Option<Fit> {
    let functions: Vec<Vec<f64>> = samples
        .iter()
        .map(|(place, _, _)| basis.values(*place))
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
        assert_eq!(fits[1].basis, Basis::Harmonics(2));
        assert!(fits[1].left < 1e-4 && fits[0].left > 1e-2, "{fits:?}");
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
