//! Pictures: sRGB encoding, box filter, PNG files.

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
