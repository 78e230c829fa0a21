//! Makes the textures that passes have thought of: runs their bakes texel by texel, and rounds what comes out to a format
//! that holds it.
//!
//! ```text
//! Generated x images --Machine--> texels of each MIP level --Format--> Texture, as a host will have it
//! ```
//!
//! A texel is computed at its centre. Each MIP level is computed of the levels of the sources that a sample of the new
//! texture would have met there.

mod format;
mod ktx2;

use format::STEP;
pub use format::TexelFormat;

use super::image::{Space, decode_png, encoded_png, srgb_encode};
use super::lane::{LANES, Mask, Words};
use super::machine::{Bindings, Machine, Resource};
use super::program::{Program, Refused};
use super::texture::{Dimension, Level, Texture, cube_direction};
use crate::{Diagnostic, Result as Outcome};
use lodc_passes::generated::{COORDINATES, Generated, Read};
use lodc_passes::{Fingerprint, Shader, Stage};
use naga::Binding;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// The longest edge of a generated texture in texels.
pub const MAX_EDGE: u32 = 4096;

/// Up to so many texels along an edge, each is the mean of 4 x 4 points; of 2 x 2 beyond.
const FINER_UP_TO: u32 = 256;

/// A texture that was made.
#[derive(Clone, Debug)]
pub struct Baked {
    /// What a sample of it returns.
    pub texture: Arc<Texture>,
    /// How it is stored.
    pub format: TexelFormat,
    /// Whether it is one flat image, and its MIP levels are those that a box filter makes of the finest one.
    pub is_chain: bool,
    /// By how much the format changes a texel at most, in display values for colours.
    pub rounding: f32,
}

impl Baked {
    /// Its size in memory, all MIP levels, in bytes.
    pub fn bytes(&self) -> u64 {
        let texels = self.texture.levels().iter().map(|level| level.texels.len());
        (texels.sum::<usize>() * self.format.bytes()) as u64
    }

    /// It as a file, and the extension of that: a PNG where that says all, since whoever loads one makes the MIP levels by a
    /// box filter in linear light; else a KTX2 of all levels.
    ///
    /// # Errors
    /// When it is no image that a PNG can hold; no bake makes such a one.
    pub fn file(&self) -> Outcome<(&'static str, Vec<u8>)> {
        let finest = &self.texture.levels()[0];
        if !self.is_chain {
            return Ok((ktx2::EXTENSION, ktx2::write(&self.texture, self.format)));
        }
        let texels = finest.texels.iter();
        let pixels: Vec<[u8; 4]> = texels
            .map(|texel| {
                let bytes = self.format.encode(*texel);
                [0, 1, 2, 3].map(|i| bytes.get(i).copied().unwrap_or(0))
            })
            .collect();
        let is_srgb = self.format == TexelFormat::Rgba8UnormSrgb;
        let size = [finest.width, finest.height];
        Ok((PNG, encoded_png(size, &pixels, is_srgb)?))
    }
}

/// The extension of the files that hold one level.
const PNG: &str = "png";

/// The extensions of [`Baked::file`].
pub const EXTENSIONS: [&str; 2] = [PNG, ktx2::EXTENSION];

/// Whether a PNG says that its colours are encoded as sRGB.
fn is_srgb(png: &[u8]) -> bool {
    // Behind the signature, chunks of a length, a name, so many bytes and a sum.
    let mut at = 8;
    while let Some(head) = png.get(at..at + 8) {
        match &head[4..] {
            b"sRGB" => return true,
            b"IDAT" => return false,
            _ => {}
        }
        let length = u32::from_be_bytes([head[0], head[1], head[2], head[3]]);
        at = at.saturating_add(12).saturating_add(length as usize);
    }
    false
}

/// Reads a file as [`Baked::file`] writes it; `name` is the file's.
///
/// # Errors
/// When it is no such file.
pub fn read(name: &str, bytes: &[u8]) -> Outcome<Texture> {
    if bytes.starts_with(b"\x89PNG") {
        let space = match is_srgb(bytes) {
            true => Space::Srgb,
            false => Space::Linear,
        };
        let image = decode_png(name, bytes, space)?;
        return Ok(Texture::of_levels(
            Dimension::D2,
            vec![Level {
                width: image.width,
                height: image.height,
                layers: 1,
                texels: image.texels,
            }],
        )
        .with_mip_chain());
    }
    ktx2::read(bytes).ok_or_else(|| {
        Diagnostic::error(format!("`{name}` is no KTX2 texture that lodc has written"))
            .with_note("make it again: run lodc on the shader that it belongs to")
    })
}

/// The textures that were made of the images of a scene, by what defines them. Clones share them.
#[derive(Clone, Debug, Default)]
pub struct Store(Arc<Mutex<BTreeMap<Fingerprint, Arc<OnceLock<Baked>>>>>);

impl Store {
    /// A texture that is there, or is made now, once.
    fn get(&self, definition: Fingerprint, make: impl FnOnce() -> Baked) -> Baked {
        let slot = {
            // A thread that panicked has left nothing half done.
            let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            Arc::clone(known.entry(definition).or_default())
        };
        slot.get_or_init(make).clone()
    }
}

/// The generated textures that a variant reads, their bakes compiled.
#[derive(Debug, Default)]
pub struct GeneratedTextures(Vec<Bake>);

/// A bake, compiled.
#[derive(Debug)]
struct Bake {
    binding: (u32, u32),
    dimension: Dimension,
    is_array: bool,
    definition: Fingerprint,
    program: Program,
    /// What the bake itself reads of generated textures.
    textures: GeneratedTextures,
    reads: Vec<Read>,
    edge: Option<u32>,
    components: usize,
}

impl GeneratedTextures {
    /// Those of a variant.
    ///
    /// # Errors
    /// When the evaluator refuses one; of a variant of an original that runs, it runs.
    pub fn of(shader: &Shader) -> Result<Self, Refused> {
        Self::new(
            shader
                .generated()
                .into_iter()
                .map(|(_, generated)| generated),
        )
    }

    /// Some, in their order.
    ///
    /// # Errors
    /// As [`GeneratedTextures::of`].
    pub fn new<'g>(all: impl IntoIterator<Item = &'g Generated>) -> Result<Self, Refused> {
        let bakes = all.into_iter().map(Bake::of);
        Ok(Self(bakes.collect::<Result<_, _>>()?))
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Makes them of the images that are bound, as far as they are not in the store.
    pub fn baked(&self, bindings: &Bindings, store: &Store) -> Vec<Baked> {
        let all = self.0.iter();
        all.map(|bake| store.get(bake.definition, || bake.run(bindings, store)))
            .collect()
    }

    /// Makes them and binds them beside the other resources.
    pub fn bind(&self, bindings: &mut Bindings, store: &Store) {
        let baked = self.baked(bindings, store);
        for (bake, baked) in self.0.iter().zip(baked) {
            bindings.insert(bake.binding, Resource::Texture(baked.texture));
        }
    }
}

impl Bake {
    fn of(generated: &Generated) -> Result<Self, Refused> {
        let shader = &*generated.bake;
        // A shader always has a fragment stage.
        let entry = shader.index(Stage::Fragment).unwrap_or(0);
        Ok(Self {
            binding: generated.binding,
            dimension: match generated.is_cube {
                true => Dimension::Cube,
                false => Dimension::D2,
            },
            is_array: generated.is_array,
            definition: generated.definition(),
            program: Program::compile(shader.module(), entry, &[])?,
            textures: GeneratedTextures::of(shader)?,
            reads: generated.reads.clone(),
            edge: generated.edge,
            components: generated.components,
        })
    }

    /// The textures that it reads.
    fn sources<'b>(&'b self, bindings: &'b Bindings) -> Vec<(&'b Texture, &'b Read)> {
        let reads = self.reads.iter();
        reads
            .filter_map(|read| {
                let bound = bindings.get(&read.binding)?.of_draw(0)?;
                match bound {
                    Resource::Texture(texture) => Some((&**texture, read)),
                    _ => None,
                }
            })
            .collect()
    }

    fn run(&self, bindings: &Bindings, store: &Store) -> Baked {
        let mut own = bindings.clone();
        self.textures.bind(&mut own, store);
        if let (Some(edge), true) = (self.edge, self.reads.is_empty()) {
            return self.rounded(self.filtered(edge.max(1), &own));
        }
        let sources = self.sources(&own);
        let mut size = [1.0_f32; 2];
        let mut levels = 1;
        let mut layers = 1;
        for (texture, read) in &sources {
            let [width, height, _] = texture.size(0);
            let edges = [width, height].into_iter().zip(read.repeats);
            for (size, (edge, repeats)) in size.iter_mut().zip(edges) {
                *size = size.max(edge as f32 * repeats);
            }
            levels = levels.max(texture.level_count());
            if read.is_layered {
                layers = layers.max(texture.layers());
            }
        }
        // Halved, so that the texels of the sources still fall together.
        let most = self.edge.unwrap_or(MAX_EDGE).clamp(1, MAX_EDGE) as f32;
        while size.iter().any(|edge| *edge > most) {
            size = size.map(|edge| edge / 2.0);
        }
        let size = size.map(|edge| (edge.round() as u32).max(1));
        let chain = size[0].max(size[1]).ilog2() + 1;
        let levels = if levels > 1 { chain } else { 1 };
        // The level of each source at which its texels are as large as those of the finest new one.
        let offsets: Vec<f64> = sources
            .iter()
            .map(|(texture, read)| {
                let [width, height, _] = texture.size(0);
                let scale = |edge: u32, repeats: f32, new: u32| {
                    f64::from(edge) * f64::from(repeats) / f64::from(new)
                };
                let across = scale(width, read.repeats[0], size[0]);
                across.max(scale(height, read.repeats[1], size[1])).log2()
            })
            .collect();
        let layers = layers * self.faces();
        let mut made: Vec<Level> = Vec::new();
        for level in 0..levels {
            let [width, height] = size.map(|edge| (edge >> level).max(1));
            let details = offsets
                .iter()
                .map(|offset| (f64::from(level) + offset).max(0.0) as f32);
            let details: Vec<f32> = details.collect();
            made.push(Level {
                width,
                height,
                layers,
                texels: self.texels([width, height, layers], &details, &own),
            });
        }
        self.rounded(made)
    }

    /// How many images each of its layers has.
    fn faces(&self) -> u32 {
        match self.dimension {
            Dimension::Cube => 6,
            _ => 1,
        }
    }

    /// The levels of a texture without sources, so many texels along each edge: means of points that are closer than texels.
    fn filtered(&self, edge: u32, bindings: &Bindings) -> Vec<Level> {
        let finer: u32 = if edge <= FINER_UP_TO { 2 } else { 1 };
        let size = [edge << finer, edge << finer, 1];
        let points = Level {
            width: size[0],
            height: size[1],
            layers: 1,
            texels: self.texels(size, &[], bindings),
        };
        let all = Texture::of_levels(self.dimension, vec![points]).with_mip_chain();
        all.levels()[finer as usize..].to_vec()
    }

    /// The texels of a level, with the level of each read.
    fn texels(&self, size: [u32; 3], details: &[f32], bindings: &Bindings) -> Vec<[f32; 4]> {
        let [width, height, layers] = size.map(|edge| edge as usize);
        let count = width * height * layers;
        let mut machine = Machine::of_draw(&self.program, bindings, 0);
        let mut inputs: Vec<Words> = vec![[0; LANES]; self.program.inputs().len()];
        let mut outputs: Vec<Words> = vec![[0; LANES]; self.program.outputs().len()];
        let mut texels = Vec::with_capacity(count);
        for first in (0..count).step_by(LANES) {
            let lanes = LANES.min(count - first);
            for (slot, words) in self.program.inputs().iter().zip(&mut inputs) {
                let Binding::Location { location, .. } = slot.binding else {
                    continue;
                };
                if self.is_array && location as usize == self.reads.len() + 1 {
                    for (lane, word) in words.iter_mut().enumerate() {
                        let image = (first + lane).min(count - 1) / (width * height);
                        *word = image as u32 / self.faces();
                    }
                    continue;
                }
                if location > COORDINATES {
                    let detail = details.get(location as usize - 1);
                    *words = [detail.copied().unwrap_or(0.0).to_bits(); LANES];
                    continue;
                }
                for (lane, word) in words.iter_mut().enumerate() {
                    // Lanes behind the last texel do again what that does.
                    let at = (first + lane).min(count - 1);
                    let (x, y) = (at % width, at / width % height);
                    let s = (x as f32 + 0.5) / width as f32;
                    let t = (y as f32 + 0.5) / height as f32;
                    let point = match self.dimension {
                        Dimension::Cube => cube_direction(at / (width * height) % 6, s, t),
                        _ => [s, t, 0.0],
                    };
                    *word = point[slot.component.min(2)].to_bits();
                }
            }
            machine.run(&inputs, Mask::ALL, Mask::ALL, &mut outputs);
            for lane in 0..lanes {
                let mut texel = [0.0, 0.0, 0.0, 1.0];
                for (slot, words) in self.program.outputs().iter().zip(&outputs) {
                    let number = f32::from_bits(words[lane]);
                    // What is infinite or undefined would spread to its neighbours.
                    texel[slot.component & 3] = if number.is_finite() { number } else { 0.0 };
                }
                texels.push(texel);
            }
        }
        texels
    }

    /// The smallest format that holds the texels, and what it leaves of them.
    fn rounded(&self, levels: Vec<Level>) -> Baked {
        let used = self.components;
        let texels = || levels.iter().flat_map(|level| &level.texels);
        let mut formats = vec![TexelFormat::Rgba8Unorm, TexelFormat::Rgba8UnormSrgb];
        formats.retain(|format| texels().all(|texel| format.holds(&texel[..used])));
        if formats.is_empty() {
            formats = vec![TexelFormat::Rgba16Float];
        }
        // As a display shows it: dark colours have more steps there.
        let off = |format: TexelFormat, texel: &[f32; 4]| {
            let rounded = format.rounded(*texel);
            let mut off = [0.0_f32; 4];
            for i in 0..used {
                off[i] = match (format, i) {
                    (TexelFormat::Rgba16Float, _) | (_, 3) => rounded[i] - texel[i],
                    _ => srgb_encode(rounded[i]) - srgb_encode(texel[i]),
                };
            }
            off
        };
        let square = |format: TexelFormat| {
            let finest = levels.iter().take(1).flat_map(|level| &level.texels);
            let squares = finest.map(|texel| {
                off(format, texel)
                    .iter()
                    .map(|x| f64::from(x * x))
                    .sum::<f64>()
            });
            squares.sum::<f64>()
        };
        let format = match formats[..] {
            [first, second] if square(second) < square(first) => second,
            _ => formats[0],
        };
        let rounding = texels().fold(0.0_f32, |most, texel| {
            let off = off(format, texel);
            off.iter().fold(most, |most, x| most.max(x.abs()))
        });
        let rounded: Vec<Level> = levels
            .iter()
            .map(|level| Level {
                texels: level
                    .texels
                    .iter()
                    .map(|texel| format.rounded(*texel))
                    .collect(),
                ..level.clone()
            })
            .collect();
        let alone = rounded.iter().take(1).cloned().collect();
        let chain = match levels.len() {
            1 => Texture::of_levels(self.dimension, alone),
            _ => Texture::of_levels(self.dimension, alone).with_mip_chain(),
        };
        let is_chain = format != TexelFormat::Rgba16Float
            && self.dimension == Dimension::D2
            && !self.is_array
            && chain.levels().iter().zip(&levels).all(|(chain, level)| {
                let mut pairs = chain.texels.iter().zip(&level.texels);
                pairs.all(|(a, b)| is_step_apart(format, a, b, used))
            });
        let texture = match is_chain {
            true => chain,
            false => Texture::of_levels(self.dimension, rounded),
        };
        Baked {
            texture: Arc::new(texture),
            format,
            is_chain,
            rounding,
        }
    }
}

/// Whether two texels are a step of a format of eight bits apart at most.
fn is_step_apart(format: TexelFormat, a: &[f32; 4], b: &[f32; 4], used: usize) -> bool {
    (0..used).all(|i| {
        let encoded = |x: f32| match (format, i) {
            (TexelFormat::Rgba8UnormSrgb, 0..3) => srgb_encode(x),
            _ => x,
        };
        (encoded(a[i]) - encoded(b[i])).abs() <= STEP
    })
}
