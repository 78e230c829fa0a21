//! KTX2 files of uncompressed textures: two dimensions or a cube, or arrays of them, all MIP levels (Khronos Texture File
//! Format, version 2).

use super::{MAX_EDGE, TexelFormat};
use crate::eval::texture::{Dimension, Level, Texture};

/// The extension of such files.
pub(super) const EXTENSION: &str = "ktx2";

/// What a file begins with.
const IDENTIFIER: [u8; 12] = *b"\xabKTX 20\xbb\r\n\x1a\n";

/// Where the index of levels begins, in bytes.
const INDEX: usize = 80;

/// The size of an entry of the index.
const ENTRY: usize = 24;

/// How many layers an array may have: WebGPU's default `maxTextureArrayLayers`.
const MOST_LAYERS: u32 = 256;

/// What is aligned to what: the texels of each level.
const ALIGNMENT: usize = 8;

/// The formats, as Vulkan numbers them.
const FORMATS: [(TexelFormat, u32); 3] = [
    (TexelFormat::Rgba8Unorm, 37),
    (TexelFormat::Rgba8UnormSrgb, 43),
    (TexelFormat::Rgba16Float, 97),
];

/// A texture as a file.
pub(super) fn write(texture: &Texture, format: TexelFormat) -> Vec<u8> {
    let levels = texture.levels();
    let [width, height, _] = texture.size(0);
    let faces: u32 = match texture.dimension() {
        Dimension::Cube => 6,
        _ => 1,
    };
    let mut numbers = FORMATS.iter();
    let number = numbers
        .find(|(known, _)| *known == format)
        .map_or(0, |(_, n)| *n);
    let described = description(format);
    let begins = INDEX + ENTRY * levels.len();
    let type_size = format.bytes() as u32 / 4;

    let mut out = IDENTIFIER.to_vec();
    let header = [
        number,
        type_size,
        width,
        height,
        0,
        // None where it is no array.
        if texture.layers() > 1 {
            texture.layers()
        } else {
            0
        },
        faces,
        levels.len() as u32,
        0,
        begins as u32,
        described.len() as u32,
        0,
        0,
        0,
        0,
        0,
        0,
    ];
    out.extend(header.iter().flat_map(|word| word.to_le_bytes()));
    // The coarsest comes first.
    let mut data = Vec::new();
    let mut entries = vec![[0_u64; 3]; levels.len()];
    let first = (begins + described.len()).next_multiple_of(ALIGNMENT);
    for (level, entry) in levels.iter().zip(&mut entries).rev() {
        data.resize(data.len().next_multiple_of(ALIGNMENT), 0);
        let bytes: Vec<u8> = level
            .texels
            .iter()
            .flat_map(|texel| format.encode(*texel))
            .collect();
        let length = bytes.len() as u64;
        *entry = [(first + data.len()) as u64, length, length];
        data.extend(bytes);
    }
    out.extend(entries.iter().flatten().flat_map(|word| word.to_le_bytes()));
    out.extend(described);
    out.resize(first, 0);
    out.extend(data);
    out
}

/// The description of the format: a block of one texel with four channels.
fn description(format: TexelFormat) -> Vec<u8> {
    let (srgb, float) = match format {
        TexelFormat::Rgba8Unorm => (false, false),
        TexelFormat::Rgba8UnormSrgb => (true, false),
        TexelFormat::Rgba16Float => (false, true),
    };
    let bits = format.bytes() as u32 * 2;
    const CHANNELS: [u32; 4] = [0, 1, 2, 15];
    let block = 24 + 16 * CHANNELS.len() as u32;
    let transfer = if srgb { 2 } else { 1 };
    let mut words = vec![
        block + 4,
        0,
        2 | (block << 16),
        // The colour model and the primaries are RGB and those of BT.709.
        1 | (1 << 8) | (transfer << 16),
        0,
        format.bytes() as u32,
        0,
    ];
    for (at, channel) in (0..).zip(CHANNELS) {
        // Floats are signed; alpha is linear whatever the colours are.
        let qualifiers = match (float, srgb && channel == 15) {
            (true, _) => 0xc0,
            (false, true) => 0x10,
            (false, false) => 0,
        };
        let (least, most) = match float {
            true => ((-1.0_f32).to_bits(), 1.0_f32.to_bits()),
            false => (0, 255),
        };
        words.extend([
            (at * bits) | ((bits - 1) << 16) | ((channel | qualifiers) << 24),
            0,
            least,
            most,
        ]);
    }
    words.iter().flat_map(|word| word.to_le_bytes()).collect()
}

/// A file as a texture; `None` when it is none of those that are written here.
pub(super) fn read(bytes: &[u8]) -> Option<Texture> {
    bytes.strip_prefix(&IDENTIFIER)?;
    let word = |at: usize| {
        let four = bytes.get(at..at + 4)?;
        Some(u32::from_le_bytes(four.try_into().ok()?))
    };
    let long = |at: usize| {
        let eight = bytes.get(at..at + 8)?;
        usize::try_from(u64::from_le_bytes(eight.try_into().ok()?)).ok()
    };
    let number = word(12)?;
    let (format, _) = FORMATS.iter().find(|(_, known)| *known == number)?;
    let [width, height, depth, layers, faces, count, compression] =
        [20, 24, 28, 32, 36, 40, 44].map(word);
    let (width, height, count) = (width?, height?, count?);
    if width.max(height) > MAX_EDGE {
        return None;
    }
    let dimension = match faces? {
        1 => Dimension::D2,
        6 if width == height => Dimension::Cube,
        _ => return None,
    };
    let layers = layers?.max(1);
    if depth? != 0 || layers > MOST_LAYERS || compression? != 0 || !(1..32).contains(&count) {
        return None;
    }
    let mut levels = Vec::new();
    for level in 0..count {
        let entry = INDEX + ENTRY * level as usize;
        let (start, length) = (long(entry)?, long(entry + 8)?);
        let data = bytes.get(start..start.checked_add(length)?)?;
        let made = Level {
            width: (width >> level).max(1),
            height: (height >> level).max(1),
            layers: layers * faces?,
            texels: data
                .chunks_exact(format.bytes())
                .map(|texel| format.decode(texel))
                .collect(),
        };
        let expected = u64::from(made.width) * u64::from(made.height) * u64::from(made.layers);
        if expected == 0 || expected != made.texels.len() as u64 {
            return None;
        }
        levels.push(made);
    }
    Some(Texture::of_levels(dimension, levels))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texture((dimension, layers): (Dimension, u32), format: TexelFormat) -> Texture {
        let level = |edge: u32, layers: u32| {
            let texel = |i: u32| [0, 1, 2, 3].map(|c| ((i * 7 + c * 31) % 256) as f32 / 255.0);
            Level {
                width: edge,
                height: edge,
                layers,
                texels: (0..edge * edge * layers)
                    .map(|i| format.rounded(texel(i)))
                    .collect(),
            }
        };
        let faces = if dimension == Dimension::Cube { 6 } else { 1 };
        let layers = layers * faces;
        let levels = [4, 2, 1].map(|edge| level(edge, layers));
        Texture::of_levels(dimension, levels.to_vec())
    }

    #[test]
    fn what_was_written_reads_the_same_and_what_is_damaged_is_refused() {
        for (format, _) in FORMATS {
            for dimension in [
                (Dimension::D2, 1),
                (Dimension::Cube, 1),
                (Dimension::D2, 3),
                (Dimension::Cube, 2),
            ] {
                let texture = texture(dimension, format);
                let bytes = write(&texture, format);
                assert_eq!(read(&bytes), Some(texture), "{format:?} {dimension:?}");
                for length in 0..bytes.len() {
                    assert_eq!(read(&bytes[..length]), None, "{format:?} {length}");
                }
                let mut other = bytes.clone();
                other[36] = 5;
                assert_eq!(read(&other), None);
                let mut vast = bytes.clone();
                vast[20..28].fill(0xff);
                assert_eq!(read(&vast), None);
                let mut vast = bytes.clone();
                vast[32..36].fill(0xff);
                assert_eq!(read(&vast), None);
            }
        }
    }
}
