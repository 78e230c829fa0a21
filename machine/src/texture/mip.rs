//! MIP levels by a box filter that handles odd sizes.

use super::{Dimension, Level};

impl Level {
    /// The next coarser level, or none below one texel.
    pub(super) fn halved(&self, dimension: Dimension) -> Option<Level> {
        let volume = dimension == Dimension::D3;
        let mut size = [self.width, self.height, self.layers].map(|n| n as usize);
        let axes = if volume { 3 } else { 2 };
        if size[..axes].iter().all(|&n| n == 1) {
            return None;
        }
        let mut texels = halve(&self.texels, &mut size, 0);
        for axis in 1..axes {
            texels = halve(&texels, &mut size, axis);
        }
        Some(Level {
            width: size[0] as u32,
            height: size[1] as u32,
            layers: size[2] as u32,
            texels,
        })
    }
}

/// Halves one axis of a grid of texels of this size, and the size with it.
///
/// A coarse texel is the mean over the interval that it covers. With `n = 2 m` fine texels that is the
/// mean of two. With `n = 2 m + 1` the interval of texel `x` spans `n / m` of them, from `x n / m`:
/// three texels with weights `(m - x) / n`, `m / n` and `(x + 1) / n`. Each fine texel's weights
/// sum to `m / n` either way, so the mean is kept.
fn halve(texels: &[[f32; 4]], size: &mut [usize; 3], axis: usize) -> Vec<[f32; 4]> {
    let n = size[axis];
    if n == 1 {
        return texels.to_vec();
    }
    let m = n / 2;
    let stride: usize = size[..axis].iter().product();
    size[axis] = m;
    let mut out = Vec::with_capacity(size.iter().product());
    for row in texels.chunks_exact(stride * n) {
        for x in 0..m {
            let taps = &row[2 * x * stride..];
            if n.is_multiple_of(2) {
                for i in 0..stride {
                    let (a, b) = (taps[i], taps[i + stride]);
                    out.push(std::array::from_fn(|c| 0.5 * (a[c] + b[c])));
                }
            } else {
                let weights = [m - x, m, x + 1].map(|w| w as f32 / n as f32);
                for i in 0..stride {
                    let (a, b, d) = (taps[i], taps[i + stride], taps[i + 2 * stride]);
                    out.push(std::array::from_fn(|c| {
                        weights[0] * a[c] + weights[1] * b[c] + weights[2] * d[c]
                    }));
                }
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::{Dimension, Texture};
    use crate::texture::Image;

    fn grey(width: u32, height: u32, value: impl Fn(u32, u32) -> f32) -> Image {
        let texels = (0..height)
            .flat_map(|y| (0..width).map(move |x| (x, y)))
            .map(|(x, y)| [value(x, y), 0.0, 0.0, 1.0])
            .collect();
        Image {
            width,
            height,
            texels,
        }
    }

    fn chain(dimension: Dimension, images: Vec<Image>) -> Texture {
        Texture::new(dimension, images).unwrap().with_mip_chain()
    }

    #[test]
    fn even_sizes_average_four_texels() {
        let texture = chain(Dimension::D2, vec![grey(4, 2, |x, y| (x + 10 * y) as f32)]);
        let sizes: Vec<_> = (0..3).map(|l| texture.size(l)).collect();
        assert_eq!(sizes, [[4, 2, 1], [2, 1, 1], [1, 1, 1]]);
        assert_eq!(texture.level_count(), 3);
        let reds: Vec<f32> = texture.levels()[1].texels.iter().map(|t| t[0]).collect();
        assert_eq!(reds, [5.5, 7.5]);
        assert_eq!(texture.levels()[2].texels, [[6.5, 0.0, 0.0, 1.0]]);
    }

    #[test]
    fn odd_sizes_weigh_by_coverage() {
        // Five texels to two: (2, 2, 1) / 5 and (1, 2, 2) / 5.
        let texture = chain(Dimension::D2, vec![grey(5, 1, |x, _| (x * x) as f32)]);
        let reds: Vec<f32> = texture.levels()[1].texels.iter().map(|t| t[0]).collect();
        let expected = [(2.0 + 4.0) / 5.0, (4.0 + 2.0 * 9.0 + 2.0 * 16.0) / 5.0];
        assert!((reds[0] - expected[0]).abs() < 1e-6 && (reds[1] - expected[1]).abs() < 1e-6);
    }

    #[test]
    fn every_level_keeps_the_mean() {
        let texture = chain(
            Dimension::D2,
            vec![grey(13, 7, |x, y| {
                (x * 7 + y * y * 3 + x * y * 5) as f32 % 11.0
            })],
        );
        let facts = texture.facts(0.0, false);
        assert_eq!(facts.mean.len(), 4);
        for mean in &facts.mean {
            assert!((mean[0] - facts.mean[0][0]).abs() < 1e-5, "{mean:?}");
        }
        assert!(facts.deviation[0][0] > facts.deviation[1][0]);
        assert_eq!(facts.deviation[3], [0.0; 4]);
    }

    #[test]
    fn volumes_halve_in_depth_too() {
        let slices = (0..4).map(|z| grey(2, 2, move |_, _| z as f32)).collect();
        let texture = chain(Dimension::D3, slices);
        assert_eq!(texture.size(1), [1, 1, 2]);
        assert_eq!(texture.size(2), [1, 1, 1]);
        assert_eq!(texture.levels()[2].texels[0][0], 1.5);
    }

    #[test]
    fn statistics_of_known_texels() {
        let texture = Texture::new(Dimension::D2, vec![grey(2, 1, |x, _| x as f32 * 2.0)]).unwrap();
        let facts = texture.facts(1.5, false);
        assert_eq!(facts.mean, [[1.0, 0.0, 0.0, 1.0]]);
        assert_eq!(facts.deviation, [[1.0, 0.0, 0.0, 0.0]]);
        assert_eq!(facts.level, 1.5);
    }

    /// A map of normals of one row.
    fn normals(normals: &[[f32; 3]]) -> Texture {
        let texel = |n: &[f32; 3]| [0, 1, 2, 3].map(|i| n.get(i).map_or(1.0, |x| 0.5 * x + 0.5));
        let image = Image {
            width: normals.len() as u32,
            height: 1,
            texels: normals.iter().map(texel).collect(),
        };
        chain(Dimension::D2, vec![image])
    }

    #[test]
    fn slopes_of_known_normals() {
        // Slopes of 3/4, -3/4, 5/12 and -5/12 across, and none along.
        let slopes = normals(&[
            [0.6, 0.0, 0.8],
            [-0.6, 0.0, 0.8],
            [5.0 / 13.0, 0.0, 12.0 / 13.0],
            [-5.0 / 13.0, 0.0, 12.0 / 13.0],
        ])
        .slopes();
        let close = |a: f32, b: f32| assert!((a - b).abs() < 1e-6, "{a} {b}");
        assert_eq!(slopes.len(), 3);
        close(slopes[0][0], (9.0 / 16.0 + 25.0 / 144.0) / 2.0);
        close(slopes[0][1], 0.0);
        // Each pair levels out.
        close(slopes[1][0], 0.0);
        // Slopes of 3/4 and -5/12: half of what is between them, squared. What they have in common does not count.
        let leaning = normals(&[[0.0, 0.6, 0.8], [0.0, -5.0 / 13.0, 12.0 / 13.0]]).slopes();
        close(leaning[0][1], ((3.0 / 4.0 + 5.0 / 12.0) / 2.0_f32).powi(2));
        assert_eq!(leaning[1], [0.0; 2]);
    }

    #[test]
    fn slopes_of_two_channels_and_of_what_is_no_normal() {
        for third in [-1.0, 1.0] {
            let slopes = normals(&[[0.6, 0.0, third], [-0.6, 0.0, third]]).slopes();
            assert!(
                (slopes[0][0] - 9.0 / 16.0).abs() < 1e-6,
                "{third}: {slopes:?}"
            );
        }
        // A steep slope is cut off.
        let steep = normals(&[
            [1.0, 0.0, 0.0],
            [0.0, 0.0, 1.0],
            [0.0, 0.0, 1.0],
            [0.0, 0.0, 1.0],
        ]);
        assert_eq!(steep.slopes()[0][0], 3.0 / 16.0);
        // In all directions, as in a map of normals in the space of an object.
        assert!(
            normals(&[[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
                .slopes()
                .is_empty()
        );
        let slices = vec![grey(1, 1, |_, _| 0.5); 2];
        assert!(chain(Dimension::D3, slices).slopes().is_empty());
    }

    #[test]
    fn means_are_weighed_by_alpha_where_it_is_what_is_seen() {
        // 4 x 4 texels: a column of red that is opaque, one of 0.5 half seen, and two of white that are not.
        let texels = (0..16).map(|i| match i % 4 {
            0 => [1.0, 0.0, 0.0, 1.0],
            1 => [0.5, 0.0, 0.0, 0.5],
            _ => [1.0, 1.0, 1.0, 0.0],
        });
        let image = Image {
            width: 4,
            height: 4,
            texels: texels.collect(),
        };
        let texture = Texture::new(Dimension::D2, vec![image]).unwrap();
        let facts = texture.facts(0.0, true);
        // Red: (1 * 1 + 0.5 * 0.5) / 1.5, with a variance of (1 * (1 / 6)^2 + 0.5 * (1 / 3)^2) / 1.5 = 1 / 18.
        assert_eq!(facts.mean, [[1.25 / 1.5, 0.0, 0.0, 0.375]]);
        let [red, green, _, alpha] = facts.deviation[0];
        assert!(
            (red - (1.0_f32 / 18.0).sqrt()).abs() < 1e-6 && green == 0.0,
            "{red}"
        );
        // Of 1, 0.5, 0 and 0 about 0.375.
        assert!((alpha - 0.171_875_f32.sqrt()).abs() < 1e-6, "{alpha}");
        assert!(!facts.is_flat());
        let plain = texture.facts(0.0, false);
        assert_eq!(plain.mean, [[0.875, 0.5, 0.5, 0.375]]);
        // What is nowhere seen has a plain mean.
        let clear = Texture::new(
            Dimension::D2,
            vec![Image {
                width: 2,
                height: 1,
                texels: vec![[0.5, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]],
            }],
        );
        assert_eq!(
            clear.unwrap().facts(0.0, true).mean,
            [[0.75, 0.0, 0.0, 0.0]]
        );
    }

    #[test]
    fn bad_shapes_are_errors() {
        assert!(Texture::new(Dimension::D2, vec![]).is_err());
        assert!(Texture::new(Dimension::D2, vec![grey(0, 1, |_, _| 0.0)]).is_err());
        let two = vec![grey(1, 1, |_, _| 0.0), grey(2, 1, |_, _| 0.0)];
        assert!(Texture::new(Dimension::D2, two).is_err());
        assert!(Texture::new(Dimension::Cube, vec![grey(1, 1, |_, _| 0.0); 5]).is_err());
        assert!(Texture::new(Dimension::Cube, vec![grey(2, 1, |_, _| 0.0); 6]).is_err());
    }
}
