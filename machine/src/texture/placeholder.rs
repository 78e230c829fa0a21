//! The picture that a dynamic texture is drawn with: seeded fractal value noise that tiles.

use super::sample::cube_direction;
use super::{Dimension, Level};
use crate::chance::mix;

/// Texels along an edge.
const SIZE: u32 = 64;
/// Slices of a volume, and its edge.
const VOLUME: u32 = 32;
/// Lattice cells along an edge at the coarsest octave; each octave doubles them.
const CELLS: u32 = 4;
/// Octaves, each half as strong as the one before.
const OCTAVES: u32 = 3;

/// The finest level of a placeholder.
pub(super) fn level(seed: u64, dimension: Dimension, layers: u32) -> Level {
    let (size, layers) = match dimension {
        Dimension::D2 => (SIZE, layers),
        Dimension::Cube => (SIZE, layers.saturating_mul(6)),
        Dimension::D3 => (VOLUME, VOLUME),
    };
    let middle = |i: u32| (i as f32 + 0.5) / size as f32;
    let mut texels = Vec::new();
    for layer in 0..layers {
        for y in 0..size {
            for x in 0..size {
                let (place, variant) = match dimension {
                    Dimension::D2 => ([middle(x), middle(y), 0.5], layer),
                    Dimension::D3 => ([middle(x), middle(y), middle(layer)], 0),
                    // On the surface of the unit cube the noise has no seams.
                    Dimension::Cube => (
                        cube_direction((layer % 6) as usize, middle(x), middle(y))
                            .map(|c| 0.5 + 0.5 * c),
                        layer / 6,
                    ),
                };
                let channel = |c: u64| fractal(hash(seed, u64::from(variant) * 3 + c), place);
                texels.push([channel(0), channel(1), channel(2), 1.0]);
            }
        }
    }
    Level {
        width: size,
        height: size,
        layers,
        texels,
    }
}

/// Octaves of value noise over a place in 0..1, in 0..1.
fn fractal(seed: u64, place: [f32; 3]) -> f32 {
    let (mut sum, mut weight, mut total) = (0.0, 1.0, 0.0);
    for octave in 0..OCTAVES {
        sum += weight * noise(hash(seed, u64::from(octave)), place, CELLS << octave);
        total += weight;
        weight *= 0.5;
    }
    sum / total
}

/// Random values at the corners of a lattice of `cells` cells that wraps, smoothly interpolated.
fn noise(seed: u64, place: [f32; 3], cells: u32) -> f32 {
    let mut cell = [0; 3];
    let mut part = [0.0; 3];
    for i in 0..3 {
        let x = place[i] * cells as f32;
        cell[i] = (x as u32).min(cells - 1);
        let t = x - cell[i] as f32;
        part[i] = t * t * (3.0 - 2.0 * t);
    }
    let mut sum = 0.0;
    for corner in 0..8_u32 {
        let mut key = seed;
        let mut weight = 1.0;
        for i in 0..3 {
            let far = corner >> i & 1;
            weight *= if far == 1 { part[i] } else { 1.0 - part[i] };
            key = hash(key, u64::from((cell[i] + far) % cells));
        }
        sum += weight * ((key >> 40) as f32 / (1 << 24) as f32);
    }
    sum
}

/// Mixes a number into a seed.
fn hash(seed: u64, number: u64) -> u64 {
    mix(seed
        .wrapping_mul(0xd134_2543_de82_ef95)
        .wrapping_add(number))
}

#[cfg(test)]
mod tests {
    use super::super::{Dimension, Texture};

    #[test]
    fn follows_the_seed_and_stays_in_range() {
        let one = Texture::placeholder(1, Dimension::D2, 2);
        assert_eq!(one, Texture::placeholder(1, Dimension::D2, 2));
        assert_ne!(one, Texture::placeholder(2, Dimension::D2, 2));
        assert_eq!((one.layers(), one.level_count()), (2, 7));
        let texels = &one.levels()[0].texels;
        assert!(texels.iter().flatten().all(|c| (0.0..=1.0).contains(c)));
        let facts = one.facts(0.0, false);
        assert!((facts.mean[0][0] - 0.5).abs() < 0.1, "{:?}", facts.mean[0]);
        assert!(facts.deviation[0][0] > 0.05, "{:?}", facts.deviation[0]);
    }

    #[test]
    fn has_every_shape() {
        let cube = Texture::placeholder(3, Dimension::Cube, 2);
        assert_eq!((cube.layers(), cube.levels()[0].layers), (2, 12));
        let volume = Texture::placeholder(3, Dimension::D3, 1);
        assert_eq!(volume.size(0), [32, 32, 32]);
        assert_eq!(volume.level_count(), 6);
    }
}
