//! A host without a window: draws a material from its lock at ten distances, to PNG files.
//!
//! ```sh
//! cargo run --release --example offscreen                                  # a wall of `tests/sample`
//! cargo run --release --example offscreen -- material.wgsl [material.lod.toml]
//! ```
//!
//! They go to `target/offscreen/`. What a renderer has to do for levels is in `drawing`; this is the loop around it.

#[path = "../drawing/mod.rs"]
#[allow(
    dead_code,
    reason = "every example takes what it needs of what they share"
)]
mod drawing;

use drawing::{Material, Renderer, Result, instance, open};
use lodc::emit::write_atomically;
use lodc::eval::image::encode_png;
use lodc::scene::Output;
use std::fmt;
use std::path::{Path, PathBuf};
use wgpu::TextureFormat;

/// How many pictures.
const PICTURES: usize = 10;

/// Drawn when nothing is named.
const WALL: &str = "tests/sample/shaders/wall.wgsl";

fn main() {
    let mut arguments = std::env::args().skip(1).map(PathBuf::from);
    let shader = arguments.next().unwrap_or_else(|| WALL.into());
    let lock = arguments.next();
    match run(&shader, lock.as_deref(), Path::new("target/offscreen")) {
        Ok(shots) => {
            println!("distance  autoLOD  level  error  from the original  picture");
            shots.iter().for_each(|shot| println!("{shot}"));
        }
        Err(error) => {
            eprintln!("{error}");
            std::process::exit(1);
        }
    }
}

/// A picture, and what was drawn in it.
pub(crate) struct Shot {
    /// From the eye to the object's centre.
    pub(crate) distance: f64,
    pub(crate) auto_lod: f64,
    pub(crate) level: usize,
    /// The error of the level and the original's own, both against many samples a pixel, as the search measured them.
    pub(crate) error: [f64; 2],
    /// How far it is from a picture of the original, root mean square, in display values 0..1.
    pub(crate) apart: f64,
    pub(crate) file: PathBuf,
}

impl fmt::Display for Shot {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            distance,
            auto_lod,
            level,
            error: [error, _],
            apart,
            file,
        } = self;
        let file = file.display();
        write!(
            f,
            "{distance:8.2}  {auto_lod:7.2}  {level:5}  {error:5.3}  {apart:17.3}  {file}"
        )
    }
}

/// Draws all pictures to a folder.
///
/// # Errors
/// When the material cannot be replayed, or there is no device to draw it.
pub(crate) fn run(shader: &Path, lock: Option<&Path>, folder: &Path) -> Result<Vec<Shot>> {
    let material = Material::replay(shader, lock)?;
    let (_, gpu) = open(&instance(), None)?;
    let format = format(&material);
    let original = Renderer::of_original(gpu.clone(), &material, format)?;
    let renderer = Renderer::new(gpu, &material, format)?;

    let scene = &material.scene;
    let [_, height] = scene.resolution;
    let target = renderer.target(scene.resolution, format);
    let mut shots: Vec<Shot> = Vec::new();
    for (number, distance) in (0..).zip(distances(scene.nearest, scene.farthest)) {
        // What an engine does for each object, each frame: where is it, which level is that, draw with its pipeline.
        let auto_lod = material.auto_lod(distance, height);
        let level = material.level(auto_lod, shots.last().map(|shot| shot.level));
        let frame = material.frame(scene.views[0], distance);
        renderer.draw(&frame, level, &target, [1.0; 3]);

        let pixels = renderer.pixels(&target)?;
        let file = folder.join(format!("{number}.png"));
        let png = encode_png(target.width(), target.height(), &pixels)?;
        write_atomically(&[(file.clone(), png)])?;
        original.draw(&frame, 0, &target, [1.0; 3]);
        shots.push(Shot {
            distance,
            auto_lod,
            level,
            error: material.errors[level],
            apart: apart(&pixels, &original.pixels(&target)?),
            file,
        });
    }
    Ok(shots)
}

/// How far pictures are apart where either has something: root mean square over channels, 0..1.
fn apart(one: &[[u8; 4]], other: &[[u8; 4]]) -> f64 {
    let pairs = one.iter().zip(other);
    let drawn = pairs.filter(|(one, other)| [**one, **other] != [[0; 4]; 2]);
    let (mut sum, mut count) = (0.0, 0.0f64);
    for (one, other) in drawn {
        for (a, b) in one.iter().zip(other).take(3) {
            sum += ((f64::from(*a) - f64::from(*b)) / 255.0).powi(2);
            count += 1.0;
        }
    }
    (sum / count.max(1.0)).sqrt()
}

/// From the nearest of a scene to a little beyond the farthest, each by the same factor farther than the one before.
fn distances(nearest: f64, farthest: f64) -> impl Iterator<Item = f64> {
    let factor = (1.1 * farthest / nearest).powf(1.0 / (PICTURES - 1) as f64);
    (0..PICTURES).map(move |i| nearest * factor.powi(i as i32))
}

/// Shaders return linear light for a target that encodes it, or have encoded it themselves.
fn format(material: &Material) -> TextureFormat {
    match material.scene.output {
        Output::Encoded => TextureFormat::Rgba8Unorm,
        _ => TextureFormat::Rgba8UnormSrgb,
    }
}
