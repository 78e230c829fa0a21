//! Textures and samplers: MIP levels, filtering, wrap modes, depth comparison.

/// The shape of a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dimension {
    /// One image, or an array of them.
    D2,
    /// Six faces, or an array of such.
    Cube,
    /// A volume.
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
    /// `width * height * layers` texels.
    pub texels: Vec<[f32; 4]>,
}

/// A texture with its MIP chain, finest level first.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// Its shape.
    pub dimension: Dimension,
    /// The levels, at least one.
    pub levels: Vec<Level>,
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

/// How a texture is read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampler {
    /// Per coordinate.
    pub wrap: [Wrap; 3],
    /// Linear rather than nearest, when magnified.
    pub linear_magnification: bool,
    /// Linear rather than nearest, when minified.
    pub linear_minification: bool,
    /// Linear rather than nearest, between MIP levels.
    pub linear_mip: bool,
}

impl Default for Sampler {
    /// Trilinear, repeating.
    fn default() -> Self {
        Self {
            wrap: [Wrap::Repeat; 3],
            linear_magnification: true,
            linear_minification: true,
            linear_mip: true,
        }
    }
}
