//! Pictures and images: sRGB encoding, box filter, PNG and JPEG files.
//!
//! All arithmetic is addition, multiplication, division and square root in a fixed order, so that the
//! same bits come out everywhere.

use crate::{Diagnostic, Result};
pub use lodc_machine::texture::Image;
use std::io::Cursor;
use std::path::Path;
use std::sync::LazyLock;
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

/// The longest edge of an image that is read, in pixels: what WebGPU promises for textures.
pub const MAX_EDGE: u32 = 8192;

/// A drawn picture, row by row from the top left.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// What the shader returned, times `covered`; 0 where nothing was drawn.
    pub pixels: Vec<[f32; 4]>,
    /// The share of each pixel that was drawn to, 0..1.
    pub covered: Vec<f32>,
}

/// What the numbers in an image file stand for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Space {
    /// Colours encoded as sRGB: decoded to linear light, alpha apart.
    Srgb,
    /// 0..1.
    Linear,
    /// Integers as they are (greys of less than 8 bits are scaled to 8).
    Integer,
}

/// Linear light to sRGB, both 0..1. Values outside, and NaN, are clamped first (NaN to 0).
/// Off by less than 3e-7; exact at 0 and 1.
#[inline]
pub fn srgb_encode(linear: f32) -> f32 {
    // NaN fails the comparison.
    let x = if linear > 0.0 { linear } else { 0.0 };
    let x = if x < 1.0 { x } else { 1.0 };
    // 1.055 x^(5/12) = 1.055 z^(10/3) with z the eighth root, over 0.486..1: a polynomial that
    // interpolates at the Chebyshev nodes, about z = 0.75. Three roots and six products vectorise; a power does not.
    let t = x.sqrt().sqrt().sqrt() - 0.75;
    let power = -0.033_461_91 + t * 0.012_893_52;
    let power = 0.184_038_61 + t * power;
    let power = 1.656_745 + t * power;
    let power = 2.795_716_4 + t * power;
    let power = 1.797_245_6 + t * power;
    // The last coefficient has the curve's -0.055 in it.
    let curve = 0.349_380_3 + t * power;
    let curve = if curve < 1.0 { curve } else { 1.0 };
    if x <= 0.003_130_8 { 12.92 * x } else { curve }
}

/// sRGB to linear light, both 0..1. Values outside, and NaN, are clamped first (NaN to 0).
/// Off by less than 5e-7. For the 256 values of a byte see [`srgb_byte`].
#[inline]
pub fn srgb_decode(encoded: f32) -> f32 {
    let x = if encoded > 0.0 { encoded } else { 0.0 };
    let x = if x < 1.0 { x } else { 1.0 };
    // y^(12/5) = y^2 w^(8/5) with w the fourth root, over 0.548..1, as above.
    let y = (x + 0.055) / 1.055;
    let t = y.sqrt().sqrt() - 0.75;
    let power = -0.030_011_794 + t * 0.020_041_44;
    let power = 0.044_822_954 + t * power;
    let power = -0.095_708_475 + t * power;
    let power = 0.538_536_1 + t * power;
    let power = 1.346_346 + t * power;
    let power = 0.631_099_8 + t * power;
    let curve = y * y * power;
    if x <= 0.040_45 { x / 12.92 } else { curve }
}

/// The linear light of an sRGB byte, correct to the last bit but one.
pub fn srgb_byte(byte: u8) -> f32 {
    static TABLE: LazyLock<[f32; 256]> =
        LazyLock::new(|| std::array::from_fn(|i| srgb_exact(i as f64 / 255.0) as f32));
    TABLE[usize::from(byte)]
}

/// The standard's formula, in software arithmetic that is the same on every machine.
fn srgb_exact(x: f64) -> f64 {
    if x <= 0.04045 {
        x / 12.92
    } else {
        libm::pow((x + 0.055) / 1.055, 2.4)
    }
}

/// A value of 0..1 as a byte, rounded to nearest; what is outside is clamped, NaN is 0.
pub fn to_byte(value: f32) -> u8 {
    // A conversion saturates, and takes NaN to 0.
    (value * 255.0 + 0.5) as u8
}

/// Decodes an image file, PNG or JPEG, told from its first bytes; `name` is the file's.
///
/// # Errors
/// When it is neither, is damaged, or an edge is longer than [`MAX_EDGE`].
pub fn decode(name: &str, bytes: &[u8], space: Space) -> Result<Image> {
    let kind = match bytes {
        [0xff, 0xd8, 0xff, ..] => return decode_jpeg(name, bytes, space),
        [0x89, b'P', b'N', b'G', ..] => return decode_png(name, bytes, space),
        [0xab, b'K', b'T', b'X', ..] => "a KTX texture",
        [
            b'R',
            b'I',
            b'F',
            b'F',
            _,
            _,
            _,
            _,
            b'W',
            b'E',
            b'B',
            b'P',
            ..,
        ] => "a WebP image",
        [b'D', b'D', b'S', b' ', ..] => "a DDS texture",
        [b'G', b'I', b'F', b'8', ..] => "a GIF image",
        [0x76, 0x2f, 0x31, 0x01, ..] => "an OpenEXR image",
        [b'#', b'?', ..] => "a Radiance image",
        // The PNG reader says what is wrong with anything else.
        _ => return decode_png(name, bytes, space),
    };
    Err(
        Diagnostic::error(format!("cannot read the image `{name}`: it is {kind}"))
            .with_note("images are PNG or JPEG files: convert this one"),
    )
}

/// Decodes a JPEG file, baseline or progressive; alpha is 1. Vector instructions are left alone, so that the bits
/// are the same on every machine.
///
/// # Errors
/// As [`decode_png`].
pub fn decode_jpeg(name: &str, bytes: &[u8], space: Space) -> Result<Image> {
    let refuse = |why: String| {
        Diagnostic::error(format!("cannot read the image `{name}`: {why}"))
            .with_note("images are PNG or JPEG files; convert or export this one again")
    };
    let failed =
        |e: zune_jpeg::errors::DecodeErrors| refuse(e.to_string().trim_end_matches('.').to_owned());
    let options = DecoderOptions::default()
        .set_use_unsafe(false)
        .set_strict_mode(true)
        // Checked here, with a message of our own.
        .set_max_width(usize::from(u16::MAX))
        .set_max_height(usize::from(u16::MAX))
        .jpeg_set_out_colorspace(ColorSpace::RGB);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().map_err(failed)?;
    let (width, height) = match decoder.info() {
        Some(info) => (u32::from(info.width), u32::from(info.height)),
        None => return Err(refuse("it has no size".to_owned())),
    };
    if width > MAX_EDGE || height > MAX_EDGE {
        return Err(too_large(name, width, height));
    }
    let pixels = decoder.decode().map_err(failed)?;
    let count = width as usize * height as usize;
    if pixels.len() != 3 * count {
        return Err(refuse(
            "its colours are neither grey nor red, green and blue".to_owned(),
        ));
    }
    let value = |byte: u8| match space {
        Space::Integer => f32::from(byte),
        Space::Srgb => srgb_byte(byte),
        Space::Linear => f32::from(byte) / 255.0,
    };
    let alpha = if space == Space::Integer { 255.0 } else { 1.0 };
    Ok(Image {
        width,
        height,
        texels: pixels
            .chunks_exact(3)
            .map(|rgb| [value(rgb[0]), value(rgb[1]), value(rgb[2]), alpha])
            .collect(),
    })
}

fn too_large(name: &str, width: u32, height: u32) -> Box<Diagnostic> {
    Diagnostic::error(format!(
        "cannot read the image `{name}`: it has {width} x {height} pixels, and at most {MAX_EDGE} x {MAX_EDGE} are read"
    ))
    .with_note("make it smaller: levels of detail are for distances at which it is not seen")
}

/// Reads a PNG file.
///
/// # Errors
/// Names the file, and says what is wrong with it.
pub fn read_png(path: &Path, space: Space) -> Result<Image> {
    let name = path.display().to_string();
    let bytes = std::fs::read(path).map_err(|e| {
        Diagnostic::error(format!("cannot read the image `{name}`: {e}"))
            .with_note("paths in a scene are relative to the scene file")
    })?;
    decode_png(&name, &bytes, space)
}

/// Decodes a PNG file of any colour type and depth. Greys fill red, green and blue; without alpha it is 1
/// (or, for integers, the largest value). Of an animation it is the first frame.
///
/// # Errors
/// When the bytes are no PNG file, are damaged or cut off, or an edge is longer than [`MAX_EDGE`]; `name` is the file's.
pub fn decode_png(name: &str, bytes: &[u8], space: Space) -> Result<Image> {
    let refuse = |why: String| {
        Diagnostic::error(format!("cannot read the image `{name}`: {why}"))
            .with_note("images are PNG or JPEG files; convert or export this one again")
    };
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::EXPAND | png::Transformations::ALPHA);
    let failed = |e: png::DecodingError| refuse(e.to_string().trim_end_matches('.').to_string());
    let (width, height) = decoder.read_header_info().map_err(failed)?.size();
    if width > MAX_EDGE || height > MAX_EDGE {
        return Err(too_large(name, width, height));
    }
    let mut reader = decoder.read_info().map_err(failed)?;
    let Some(size) = reader.output_buffer_size() else {
        return Err(refuse("it is too large".to_string()));
    };
    let mut buffer = vec![0; size];
    let frame = reader.next_frame(&mut buffer).map_err(failed)?;
    let buffer = &buffer[..frame.buffer_size()];
    let grey = match frame.color_type {
        png::ColorType::GrayscaleAlpha => true,
        png::ColorType::Rgba => false,
        other => return Err(refuse(format!("its colour type {other:?} did not expand"))),
    };
    let channels = if grey { 2 } else { 4 };
    // Texels are made one by one: a buffer of all values beside them would double the peak.
    let texel = |value: &dyn Fn(usize, bool) -> f32| match grey {
        true => {
            let grey = value(0, true);
            [grey, grey, grey, value(1, false)]
        }
        false => [
            value(0, true),
            value(1, true),
            value(2, true),
            value(3, false),
        ],
    };
    let texels = match frame.bit_depth {
        png::BitDepth::Sixteen => buffer
            .chunks_exact(2 * channels)
            .map(|bytes| {
                texel(&|i, colour| {
                    let value = u16::from_be_bytes([bytes[2 * i], bytes[2 * i + 1]]);
                    match space {
                        Space::Integer => f32::from(value),
                        Space::Srgb if colour => srgb_exact(f64::from(value) / 65535.0) as f32,
                        _ => f32::from(value) / 65535.0,
                    }
                })
            })
            .collect(),
        _ => buffer
            .chunks_exact(channels)
            .map(|bytes| {
                texel(&|i, colour| match space {
                    Space::Integer => f32::from(bytes[i]),
                    Space::Srgb if colour => srgb_byte(bytes[i]),
                    _ => f32::from(bytes[i]) / 255.0,
                })
            })
            .collect(),
    };
    Ok(Image {
        width: frame.width,
        height: frame.height,
        texels,
    })
}

/// Encodes red, green, blue and alpha bytes as a PNG file. The bytes are the same on every run.
///
/// # Errors
/// When the size is 0 or there are not `width * height` pixels.
pub fn encode_png(width: u32, height: u32, pixels: &[[u8; 4]]) -> Result<Vec<u8>> {
    encoded_png([width, height], pixels, false)
}

/// The same, which says whether its colours are encoded as sRGB.
///
/// # Errors
/// As [`encode_png`].
pub(crate) fn encoded_png(
    [width, height]: [u32; 2],
    pixels: &[[u8; 4]],
    is_srgb: bool,
) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    if is_srgb {
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    }
    encoder
        .write_header()
        .and_then(|mut writer| {
            writer.write_image_data(pixels.as_flattened())?;
            writer.finish()
        })
        .map_err(|e| Diagnostic::error(format!("cannot encode an image: {e}")))?;
    Ok(bytes)
}

impl Picture {
    /// A picture in which nothing is drawn.
    pub fn empty(width: u32, height: u32) -> Self {
        let count = width as usize * height as usize;
        Self {
            width,
            height,
            pixels: vec![[0.0; 4]; count],
            covered: vec![0.0; count],
        }
    }

    /// The mean over squares of `factor` x `factor` pixels, of colour and coverage alike, so that pixels stay
    /// multiplied by their coverage. Values are averaged as they are: encode or clamp before where that is meant.
    ///
    /// # Panics
    /// When `factor` is 0 or does not divide width and height.
    pub fn box_filtered(&self, factor: u32) -> Picture {
        assert!(
            self.width.is_multiple_of(factor) && self.height.is_multiple_of(factor),
            "a box filter takes whole squares"
        );
        if factor == 1 {
            return self.clone();
        }
        let mut out = Picture::empty(self.width / factor, self.height / factor);
        let (k, width) = (factor as usize, self.width as usize);
        let rows = self.pixels.chunks_exact(width);
        for (y, (row, covered)) in rows.zip(self.covered.chunks_exact(width)).enumerate() {
            let first = y / k * out.width as usize;
            for (x, (pixels, covered)) in
                row.chunks_exact(k).zip(covered.chunks_exact(k)).enumerate()
            {
                for (pixel, covered) in pixels.iter().zip(covered) {
                    for (sum, value) in out.pixels[first + x].iter_mut().zip(pixel) {
                        *sum += value;
                    }
                    out.covered[first + x] += covered;
                }
            }
        }
        let count = (k * k) as f32;
        for (pixel, covered) in out.pixels.iter_mut().zip(&mut out.covered) {
            *pixel = pixel.map(|sum| sum / count);
            *covered /= count;
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_matches_the_formula() {
        for i in 0..=100_000 {
            let x = i as f64 / 100_000.0;
            let encoded = if x <= 0.0031308 {
                12.92 * x
            } else {
                1.055 * libm::pow(x, 1.0 / 2.4) - 0.055
            };
            let got = f64::from(srgb_encode(x as f32));
            assert!((got - encoded).abs() < 3e-7, "encode {x}: {got} {encoded}");
            let got = f64::from(srgb_decode(x as f32));
            assert!((got - srgb_exact(x)).abs() < 5e-7, "decode {x}: {got}");
        }
        assert_eq!((srgb_encode(0.0), srgb_encode(1.0)), (0.0, 1.0));
        assert_eq!(srgb_encode(f32::NAN), 0.0);
        assert_eq!(srgb_encode(f32::INFINITY), 1.0);
        assert_eq!(srgb_encode(-3.0), 0.0);
    }

    #[test]
    fn bytes_go_round() {
        for byte in 0..=255 {
            assert_eq!(to_byte(srgb_encode(srgb_byte(byte))), byte);
        }
        assert_eq!(srgb_byte(255), 1.0);
        assert!((srgb_byte(128) - 0.215_860_5).abs() < 1e-7);
        assert_eq!([f32::NAN, -1.0, 2.0].map(to_byte), [0, 0, 255]);
    }

    #[test]
    fn png_round_trip() {
        let pixels = [
            [0, 64, 128, 255],
            [255, 1, 2, 3],
            [9, 8, 7, 6],
            [5, 4, 3, 2],
        ];
        let bytes = encode_png(2, 2, &pixels).unwrap();
        let linear = decode_png("a.png", &bytes, Space::Linear).unwrap();
        assert_eq!((linear.width, linear.height), (2, 2));
        for (texel, pixel) in linear.texels.iter().zip(&pixels) {
            assert_eq!(texel.map(to_byte), *pixel);
        }
        let srgb = decode_png("a.png", &bytes, Space::Srgb).unwrap();
        assert_eq!(srgb.texels[0][1], srgb_byte(64));
        assert_eq!(srgb.texels[1][3], 3.0 / 255.0, "alpha is linear");
        let integer = decode_png("a.png", &bytes, Space::Integer).unwrap();
        assert_eq!(integer.texels[2], [9.0, 8.0, 7.0, 6.0]);
        assert!(encode_png(3, 2, &pixels).is_err());
    }

    fn encoded(color: png::ColorType, depth: png::BitDepth, width: u32, data: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, width, 1);
        encoder.set_color(color);
        encoder.set_depth(depth);
        if color == png::ColorType::Indexed {
            encoder.set_palette(vec![10, 20, 30, 40, 50, 60]);
            encoder.set_trns(vec![255, 0]);
        }
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(data).unwrap();
        writer.finish().unwrap();
        bytes
    }

    #[test]
    fn every_colour_type_and_depth() {
        use png::{BitDepth, ColorType};
        let integers = |color, depth, width, data: &[u8]| {
            decode_png("a.png", &encoded(color, depth, width, data), Space::Integer)
                .unwrap()
                .texels
        };
        assert_eq!(
            integers(ColorType::Grayscale, BitDepth::One, 2, &[0b0100_0000]),
            [[0.0, 0.0, 0.0, 255.0], [255.0; 4]]
        );
        assert_eq!(
            integers(ColorType::Indexed, BitDepth::Eight, 2, &[1, 0]),
            [[40.0, 50.0, 60.0, 0.0], [10.0, 20.0, 30.0, 255.0]]
        );
        assert_eq!(
            integers(ColorType::Rgb, BitDepth::Eight, 1, &[1, 2, 3]),
            [[1.0, 2.0, 3.0, 255.0]]
        );
        assert_eq!(
            integers(
                ColorType::GrayscaleAlpha,
                BitDepth::Sixteen,
                1,
                &[1, 0, 0, 7]
            ),
            [[256.0, 256.0, 256.0, 7.0]]
        );
    }

    #[test]
    fn bad_files_are_errors_that_name_them() {
        let whole = encode_png(4, 4, &[[1, 2, 3, 4]; 16]).unwrap();
        let mut damaged = whole.clone();
        let middle = damaged.len() / 2;
        damaged[middle] ^= 0x55;
        for bytes in [&[][..], b"no image at all", &whole[..40], &damaged] {
            let error = decode_png("bad.png", bytes, Space::Linear).unwrap_err();
            assert!(error.message.contains("`bad.png`"), "{}", error.message);
        }
        let huge = encoded(
            png::ColorType::Grayscale,
            png::BitDepth::One,
            9000,
            &[0; 1125],
        );
        let error = decode_png("huge.png", &huge, Space::Linear).unwrap_err();
        assert!(error.message.contains("9000 x 1"), "{}", error.message);
        assert!(read_png(Path::new("/no/such/file.png"), Space::Linear).is_err());
        assert!(read_png(Path::new("/"), Space::Linear).is_err());
    }

    #[test]
    fn jpegs_are_read_and_other_formats_named() {
        // 8 x 8, one colour: what libjpeg makes of red 200, green 100, blue 50 at quality 95.
        let jpeg = include_bytes!("../../testdata/images/orange.jpg");
        let image = decode("orange.jpg", jpeg, Space::Integer).unwrap();
        assert_eq!((image.width, image.height, image.texels.len()), (8, 8, 64));
        for texel in &image.texels {
            for (got, expected) in texel.iter().zip([200.0, 100.0, 50.0, 255.0]) {
                assert!((got - expected).abs() <= 2.0, "{texel:?}");
            }
        }
        let linear = decode("orange.jpg", jpeg, Space::Srgb).unwrap().texels[0][0];
        assert_eq!(linear, srgb_byte(image.texels[0][0] as u8));
        let error = decode("a.webp", b"RIFF\0\0\0\0WEBPVP8 ", Space::Srgb).unwrap_err();
        assert_eq!(
            error.message,
            "cannot read the image `a.webp`: it is a WebP image"
        );
        assert!(decode("cut.jpg", &jpeg[..jpeg.len() / 2], Space::Srgb).is_err());
        // A size bomb: the frame header says 65,535 x 65,535, and nothing of that size is made.
        let mut bomb = jpeg.to_vec();
        let frame = bomb.windows(2).position(|w| w == [0xff, 0xc0]).unwrap();
        bomb[frame + 5..frame + 9].fill(0xff);
        let error = decode("bomb.jpg", &bomb, Space::Srgb).unwrap_err();
        assert!(error.message.contains("65535 x 65535"), "{error}");
    }

    #[test]
    fn box_filter_keeps_premultiplied_colour() {
        let mut fine = Picture::empty(4, 2);
        fine.pixels[0] = [1.0, 0.5, 0.0, 1.0];
        fine.covered[0] = 1.0;
        fine.pixels[5] = [1.0, 0.5, 0.0, 1.0];
        fine.covered[5] = 1.0;
        fine.pixels[7] = [4.0; 4];
        fine.covered[7] = 1.0;
        let coarse = fine.box_filtered(2);
        assert_eq!((coarse.width, coarse.height), (2, 1));
        assert_eq!(coarse.pixels, [[0.5, 0.25, 0.0, 0.5], [1.0; 4]]);
        assert_eq!(coarse.covered, [0.5, 0.25]);
        assert_eq!(fine.box_filtered(1), fine);
    }
}
