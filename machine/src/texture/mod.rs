//! Textures and samplers: texels in linear light, MIP levels, what is known of their images.
//!
//! A texture is made of decoded [`Image`]s and read by blocks of lanes, see `sample`.

mod fit;
mod mip;
mod placeholder;
mod sample;

pub use sample::{Detail, Floats, Integers, Request, cube_direction};

use lodc_passes::facts::TextureFacts;
use std::fmt;

/// A decoded image, row by row from the top left.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Width in texels.
    pub width: u32,
    /// Height in texels.
    pub height: u32,
    /// `width * height` texels.
    pub texels: Vec<[f32; 4]>,
}

/// The shape of a texture. One dimension is two with a height of 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dimension {
    /// One image, or an array of them.
    D2,
    /// Six faces (+x, -x, +y, -y, +z, -z), or an array of such.
    Cube,
    /// A volume, slice by slice.
    D3,
}

/// One MIP level: texels in linear light as a sample returns them, layer by layer, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// Width in texels.
    pub width: u32,
    /// Height in texels.
    pub height: u32,
    /// Layers of an array, faces of a cube (six times the layers), or slices of a volume.
    pub layers: u32,
    /// `width * height * layers` texels. Integer textures hold their values, which are exact
    /// in an f32 as long as they come from 8 or 16 bits; depth textures hold depth in the first component.
    pub texels: Vec<[f32; 4]>,
}

/// A texture with its MIP chain, finest level first.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    dimension: Dimension,
    /// At least one; each level's texel count is its width times height times layers, none of them 0.
    levels: Vec<Level>,
}

/// What happens outside 0..1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// It repeats.
    #[default]
    Repeat,
    /// The edge texel goes on.
    ClampToEdge,
    /// It repeats, every other time mirrored.
    MirrorRepeat,
}

/// How a depth reference is compared with a texel, the reference on the left.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Comparison {
    /// `false`.
    Never,
    /// `<`.
    Less,
    /// `==`.
    Equal,
    /// `<=`.
    #[default]
    LessEqual,
    /// `>`.
    Greater,
    /// `!=`.
    NotEqual,
    /// `>=`.
    GreaterEqual,
    /// `true`.
    Always,
}

/// How a texture is read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampler {
    /// Per coordinate. Cube maps do not look at it: their edges are seamless.
    pub wrap: [Wrap; 3],
    /// Linear rather than nearest, when magnified.
    pub linear_magnification: bool,
    /// Linear rather than nearest, when minified.
    pub linear_minification: bool,
    /// Linear rather than nearest, between MIP levels.
    pub linear_mip: bool,
    /// What a comparison sampler compares.
    pub comparison: Comparison,
}

impl Default for Sampler {
    /// Trilinear, repeating, less-equal.
    fn default() -> Self {
        Self {
            wrap: [Wrap::Repeat; 3],
            linear_magnification: true,
            linear_minification: true,
            linear_mip: true,
            comparison: Comparison::LessEqual,
        }
    }
}

/// Why images do not make a texture: lower case, without a full stop.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Misfit(String);

impl fmt::Display for Misfit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Misfit {}

impl Texture {
    /// A texture of one level: an image for each layer of an array, face of a cube or slice of a volume.
    ///
    /// # Errors
    /// When there is no image, sizes differ, an image is empty, or a cube has no square faces or not six a layer.
    pub fn new(dimension: Dimension, images: Vec<Image>) -> Result<Self, Misfit> {
        let Some(first) = images.first() else {
            return Err(Misfit("a texture needs at least one image".to_owned()));
        };
        let (width, height, layers) = (first.width, first.height, images.len());
        if width == 0 || height == 0 {
            return Err(Misfit("an image of a texture is empty".to_owned()));
        }
        if let Some(other) = images
            .iter()
            .find(|i| (i.width, i.height) != (width, height))
        {
            return Err(Misfit(format!(
                "the images of a texture differ in size: {width} x {height} and {} x {}",
                other.width, other.height
            )));
        }
        if dimension == Dimension::Cube && layers % 6 != 0 {
            return Err(Misfit(format!(
                "a cube texture needs six faces a layer, there are {layers}"
            )));
        }
        if dimension == Dimension::Cube && width != height {
            return Err(Misfit(format!(
                "the faces of a cube texture must be square, these are {width} x {height}"
            )));
        }
        let mut texels = Vec::with_capacity(width as usize * height as usize * layers);
        for image in images {
            texels.extend(image.texels);
        }
        let level = Level {
            width,
            height,
            layers: u32::try_from(layers).unwrap_or(u32::MAX),
            texels,
        };
        assert_eq!(
            level.texels.len(),
            width as usize * height as usize * layers,
            "an image has as many texels as its size says"
        );
        Ok(Self {
            dimension,
            levels: vec![level],
        })
    }

    /// A texture of levels that are there, finest first.
    ///
    /// # Panics
    /// When there is none, or one has not as many texels as its size says, or none.
    pub fn of_levels(dimension: Dimension, levels: Vec<Level>) -> Self {
        assert!(!levels.is_empty(), "a texture has a level");
        for level in &levels {
            let [width, height, layers] =
                [level.width, level.height, level.layers].map(|edge| edge as usize);
            let count = width * height * layers;
            assert!(count > 0 && count == level.texels.len(), "as its size says");
        }
        Self { dimension, levels }
    }

    /// The same texture with all MIP levels, each the box filter of the one before.
    /// Sizes are halved and rounded down; every level has the mean of the first, odd sizes included.
    pub fn with_mip_chain(mut self) -> Self {
        self.levels.truncate(1);
        while let Some(next) = self.levels.last().and_then(|l| l.halved(self.dimension)) {
            self.levels.push(next);
        }
        self
    }

    /// A tileable picture from a seed: what a dynamic texture is drawn with, since nobody knows its image.
    /// Values lie in 0..1, alpha is 1, and there are all MIP levels. `layers` counts layers of an array or
    /// of a cube array; a volume has its own depth.
    pub fn placeholder(seed: u64, dimension: Dimension, layers: u32) -> Self {
        Self {
            dimension,
            levels: vec![placeholder::level(seed, dimension, layers.max(1))],
        }
        .with_mip_chain()
    }

    /// The texels of the finest level, to be written.
    pub fn texels_mut(&mut self) -> &mut [[f32; 4]] {
        &mut self.levels[0].texels
    }

    /// Its shape.
    pub fn dimension(&self) -> Dimension {
        self.dimension
    }

    /// The MIP levels, finest first, at least one.
    pub fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// Width, height and depth of a MIP level in texels (`textureDimensions`); the depth is 1 except for a
    /// volume. A level that is not there counts as the last.
    pub fn size(&self, level: u32) -> [u32; 3] {
        let level = &self.levels[(level as usize).min(self.levels.len() - 1)];
        let depth = match self.dimension {
            Dimension::D3 => level.layers,
            Dimension::D2 | Dimension::Cube => 1,
        };
        [level.width, level.height, depth]
    }

    /// Layers of an array (`textureNumLayers`); a cube's six faces count as one.
    pub fn layers(&self) -> u32 {
        match self.dimension {
            Dimension::D2 => self.levels[0].layers,
            Dimension::Cube => self.levels[0].layers / 6,
            Dimension::D3 => 1,
        }
    }

    /// How many MIP levels there are (`textureNumLevels`).
    pub fn level_count(&self) -> u32 {
        self.levels.len() as u32
    }

    /// Size, and mean and standard deviation of every MIP level, summed in f64 in the order of the texels.
    /// `level` is the MIP level that a sample at the facts' distance falls on. Where alpha says how much is seen of a
    /// texel, `weighed`, the other components are weighed by it; alpha itself is not.
    pub fn facts(&self, level: f32, weighed: bool) -> TextureFacts {
        let levels = self.levels.iter();
        let (mean, deviation) = levels.map(|level| level.statistics(weighed)).unzip();
        let [width, height, _] = self.size(0);
        TextureFacts {
            size: [width, height],
            layers: self.layers(),
            mean,
            deviation,
            level,
            ..TextureFacts::default()
        }
    }

    /// The variance of the slopes of every MIP level, along each axis, where texels are normals in tangent space: `2 t - 1`
    /// for each channel. A slope of more than 1 counts as 1. A third channel that is the same everywhere is none, and z follows from the first two. Nothing
    /// for what is no such map, because it has more than one layer or points into the surface as often as away from it.
    pub fn slopes(&self) -> Vec<[f32; 2]> {
        let finest = &self.levels[0];
        let z = |texel: &[f32; 4]| f64::from(texel[2]) * 2.0 - 1.0;
        let first = finest.texels.first().map_or(0.0, |texel| texel[2]);
        let two_channels = finest.texels.iter().all(|texel| texel[2] == first);
        let mean = finest.texels.iter().map(z).sum::<f64>() / finest.texels.len() as f64;
        let outwards = two_channels || mean > LEAST_MEAN_Z;
        match self.dimension == Dimension::D2 && self.layers() == 1 && outwards {
            true => {
                let levels = self.levels.iter();
                levels.map(|level| level.slopes(two_channels)).collect()
            }
            false => Vec::new(),
        }
    }
}

/// The least mean of the third component of normals in tangent space; of normals in all directions it is 0.
const LEAST_MEAN_Z: f64 = 0.5;

impl Level {
    /// The mean and the standard deviation of its texels; colours weighed by alpha where that is wanted, and any texel
    /// has some.
    fn statistics(&self, weighed: bool) -> ([f32; 4], [f32; 4]) {
        let alpha: f64 = self.texels.iter().map(|texel| f64::from(texel[3])).sum();
        let weighed = weighed && alpha > 0.0;
        let whole = if weighed {
            alpha
        } else {
            self.texels.len() as f64
        };
        let whole = [whole, whole, whole, self.texels.len() as f64];
        let weights = |texel: &[f32; 4]| {
            let colour = if weighed { f64::from(texel[3]) } else { 1.0 };
            [colour, colour, colour, 1.0]
        };
        let mut mean = [0.0_f64; 4];
        for texel in &self.texels {
            for ((sum, &value), weight) in mean.iter_mut().zip(texel).zip(weights(texel)) {
                *sum += weight * f64::from(value);
            }
        }
        let mean: [f64; 4] = std::array::from_fn(|c| mean[c] / whole[c]);
        let mut variance = [0.0_f64; 4];
        for texel in &self.texels {
            let weights = weights(texel);
            for c in 0..4 {
                let off = f64::from(texel[c]) - mean[c];
                variance[c] += weights[c] * (off * off);
            }
        }
        (
            mean.map(|m| m as f32),
            std::array::from_fn(|c| (variance[c] / whole[c]).sqrt() as f32),
        )
    }

    /// The variance of the slopes of its normals along each axis, summed in f64 in the order of the texels.
    fn slopes(&self, two_channels: bool) -> [f32; 2] {
        let count = self.texels.len() as f64;
        let slopes = || {
            self.texels.iter().map(|texel| {
                let [x, y, z] = [0, 1, 2].map(|i| f64::from(texel[i]) * 2.0 - 1.0);
                let z = match two_channels {
                    true => (1.0 - x * x - y * y).max(0.0).sqrt(),
                    false => z,
                };
                // One of 1 is all that the widest lobe has, and few steeper ones are seen from above.
                let length = x.hypot(y).max(1e-6);
                [x, y].map(|component| component / z.max(length))
            })
        };
        let mut mean = [0.0; 2];
        for slope in slopes() {
            for i in 0..2 {
                mean[i] += slope[i] / count;
            }
        }
        let mut variance = [0.0; 2];
        for slope in slopes() {
            for i in 0..2 {
                variance[i] += (slope[i] - mean[i]).powi(2) / count;
            }
        }
        variance.map(|variance| variance as f32)
    }
}
