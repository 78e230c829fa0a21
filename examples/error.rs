//! Draws the picture of the manual's page on error: the reference, the original, a level, and where they differ.
//!
//! `cargo run --release --example error -- testdata/materials/pbr.wgsl 3 docs/error.png` searches the levels of a material
//! with its scene and draws level 3 at its distance, in the first picture of the scene. From left to right: the
//! reference, the original, the level; below each of the two drawings its difference from the reference, four times as
//! large, as light on black. Each pixel is a square of 6 x 6.

use lodc::compile::normal_form;
use lodc::eval::draw::{draw, resolve, shade};
use lodc::eval::image::{Picture, encode_png, srgb_encode, to_byte};
use lodc::eval::program::Program;
use lodc::eval::programs::Stand;
use lodc::eval::raster::{Frame, rasterize};
use lodc::front::Source;
use lodc::scene::Scene;
use lodc::search::{Kept, Scope, find};
use lodc_passes::{Shader, Stage};
use std::error::Error;
use std::path::Path;

/// Edge of a pixel's square.
const SCALE: usize = 6;
/// How much larger differences are drawn.
const GAIN: f32 = 4.0;

/// A picture's encoded colours, over black.
type Shown = Vec<[f32; 3]>;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [shader, level, output] = arguments.as_slice() else {
        return Err("usage: error SHADER LEVEL OUTPUT".into());
    };
    let source = Source::read(Path::new(shader)).map_err(|e| e.to_string())?;
    let scene = Scene::read(&source, None).map_err(|e| e.to_string())?;
    let base = normal_form(&source).map_err(|e| e.to_string())?;
    let program = |shader: &Shader, stage| {
        let entry = shader.index(stage).ok_or("no such stage")?;
        Program::compile(shader.module(), entry, &[]).map_err(|refused| refused.what.clone())
    };
    let vertex = match &scene.vertex_stage {
        Some(stage) => {
            Program::compile(&stage.module, 0, &[]).map_err(|refused| refused.what.clone())?
        }
        None => program(&base, Stage::Vertex)?,
    };
    let stand = Stand {
        base: &base,
        vertex: &vertex,
        scene: &scene,
    };
    let wanted = (Scope::None, &Kept::default());
    let found = find(&stand, wanted, None, &|_| {}).map_err(|refused| refused.what.clone())?;
    let level = level.parse().ok().and_then(|i: usize| found.levels.get(i));
    let level = level.ok_or("there is no such level")?;
    let frame = scene.frames(level.distance).swap_remove(0);
    let original = program(&base, Stage::Fragment)?;
    let simple = program(&level.shader, Stage::Fragment)?;

    let reference = filtered(&vertex, &original, &frame);
    let drawings = [&original, &simple].map(|program| shown(&draw(&vertex, program, &frame).0));
    let differences = drawings.each_ref().map(|drawing| -> Shown {
        let pairs = drawing.iter().zip(&reference);
        pairs
            .map(|(a, b)| [0, 1, 2].map(|i| GAIN * (a[i] - b[i]).abs()))
            .collect()
    });
    let empty = vec![[0.0; 3]; reference.len()];
    let rows = [
        [&reference, &drawings[0], &drawings[1]],
        [&empty, &differences[0], &differences[1]],
    ];
    let bounds = bounds(&reference, frame.width as usize);
    std::fs::write(output, sheet(&rows, frame.width as usize, bounds)?)?;
    let error = &level.error;
    println!(
        "distance {:.2}: error {:.3}, floor {:.3}, excess {:.3}, bound {:.3}",
        level.distance,
        error.rmse,
        error.floor,
        error.excess(),
        error.bound
    );
    Ok(())
}

/// What a display shows of a picture in linear light.
fn shown(picture: &Picture) -> Shown {
    let pixels = picture.pixels.iter();
    pixels
        .map(|p| [p[0], p[1], p[2]].map(srgb_encode))
        .collect()
}

/// The reference: 4 x 4 samples a pixel, clamped as a display does and averaged in linear light.
fn filtered(vertex: &Program, fragment: &Program, frame: &Frame) -> Shown {
    let mut fine = frame.clone();
    fine.grid = 4;
    let coverage = rasterize(vertex, fragment, &fine);
    let mut picture = resolve(&coverage, &shade(fragment, &coverage, &fine.bindings));
    for pixel in &mut picture.pixels {
        *pixel = pixel.map(|c| c.clamp(0.0, 1.0));
    }
    shown(&picture.box_filtered(4))
}

/// The first and last column and row in which something is drawn, with a pixel of margin.
fn bounds(picture: &Shown, width: usize) -> [usize; 4] {
    let drawn = (0..picture.len()).filter(|i| picture[*i] != [0.0; 3]);
    let (columns, rows): (Vec<_>, Vec<_>) = drawn.map(|i| (i % width, i / width)).unzip();
    let range = |all: &[usize], end: usize| {
        let (low, high) = (all.iter().min(), all.iter().max());
        let low = low.map_or(0, |low| low.saturating_sub(1));
        (low, high.map_or(end, |high| (high + 2).min(end)))
    };
    let (left, right) = range(&columns, width);
    let (top, bottom) = range(&rows, picture.len() / width);
    [left, right, top, bottom]
}

/// Pictures side by side and below each other, cut to the bounds and enlarged.
fn sheet(
    rows: &[[&Shown; 3]],
    width: usize,
    [left, right, top, bottom]: [usize; 4],
) -> Result<Vec<u8>, Box<dyn Error>> {
    let mut pixels = Vec::new();
    for row in rows {
        for y in top..bottom {
            let line: Vec<[u8; 4]> = row
                .iter()
                .flat_map(|picture| (left..right).map(|x| picture[y * width + x]))
                .flat_map(|[r, g, b]| [[to_byte(r), to_byte(g), to_byte(b), 255]; SCALE])
                .collect();
            for _ in 0..SCALE {
                pixels.extend_from_slice(&line);
            }
        }
    }
    let wide = (right - left) * 3 * SCALE;
    let (width, height) = (wide as u32, (pixels.len() / wide.max(1)) as u32);
    Ok(encode_png(width, height, &pixels).map_err(|e| e.to_string())?)
}
