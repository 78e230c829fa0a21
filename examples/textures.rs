//! Makes the textures of the test materials: seeded, and the same pixels on every machine.
//!
//! `cargo run --example textures [FOLDER]` writes them, by default to `testdata/materials/textures/`.
//! Every texture has detail at several scales, so that an error grows gradually as it is averaged away.

use std::f64::consts::PI;
use std::path::{Path, PathBuf};

/// An image of 8 bits a channel, row by row from the top.
pub(crate) struct Image {
    /// The file's name, without its extension.
    pub(crate) name: String,
    /// Width and height in pixels.
    pub(crate) size: u32,
    /// 1 grey, 3 red, green and blue, 4 with alpha.
    pub(crate) channels: usize,
    /// `size * size * channels` values.
    pub(crate) pixels: Vec<u8>,
}

impl Image {
    /// Colours of every pixel; `colour` gets u and v of its centre, in 0..1, and channels are clamped to 0..1.
    fn new<const N: usize>(name: &str, size: u32, colour: impl Fn(f64, f64) -> [f64; N]) -> Self {
        let at = |i: u32| (f64::from(i) + 0.5) / f64::from(size);
        let pixels = (0..size)
            .flat_map(|y| (0..size).map(move |x| (x, y)))
            .flat_map(|(x, y)| colour(at(x), at(y)))
            .map(|c| (c.clamp(0.0, 1.0) * 255.0 + 0.5) as u8)
            .collect();
        Self {
            name: name.to_owned(),
            size,
            channels: N,
            pixels,
        }
    }

    /// The tangent-space normals of a height field that repeats; `depth` is its height in widths of the image.
    fn normals(name: &str, size: u32, depth: f64, height: impl Fn(f64, f64) -> f64) -> Self {
        let step = 1.0 / f64::from(size);
        Self::new(name, size, |u, v| {
            let slope_u = (height(u + step, v) - height(u - step, v)) / (2.0 * step) * depth;
            let slope_v = (height(u, v + step) - height(u, v - step)) / (2.0 * step) * depth;
            // The bitangent runs along increasing v, so both slopes have the same sign.
            let length = (slope_u * slope_u + slope_v * slope_v + 1.0).sqrt();
            [-slope_u, -slope_v, 1.0].map(|c| c / length * 0.5 + 0.5)
        })
    }
}

/// A random number in 0..1 for a lattice point.
fn random(seed: u32, x: i32, y: i32) -> f64 {
    let mut h = seed.wrapping_mul(0x9e37_79b9)
        ^ x.cast_unsigned().wrapping_mul(0x85eb_ca6b)
        ^ y.cast_unsigned().wrapping_mul(0xc2b2_ae35);
    for factor in [0x7feb_352d_u32, 0x846c_a68b, 0x9e37_79b9] {
        h = (h ^ (h >> 16)).wrapping_mul(factor);
    }
    f64::from(h ^ (h >> 15)) / f64::from(u32::MAX)
}

fn mix(a: f64, b: f64, t: f64) -> f64 {
    a + (b - a) * t
}

fn mix3(a: [f64; 3], b: [f64; 3], t: f64) -> [f64; 3] {
    [0, 1, 2].map(|i| mix(a[i], b[i], t))
}

fn scale(a: [f64; 3], by: f64) -> [f64; 3] {
    a.map(|c| c * by)
}

fn smoothstep(from: f64, to: f64, x: f64) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// The lattice cell that holds a point and where in it; `cells` of them make the repeating square.
fn cell(cells: i32, u: f64, v: f64) -> ([i32; 2], [f64; 2]) {
    let (x, y) = (u * f64::from(cells), v * f64::from(cells));
    (
        [x.floor() as i32, y.floor() as i32],
        [x - x.floor(), y - y.floor()],
    )
}

/// Gradient noise in about 0..1 that repeats after 1, with `cells` bumps a side.
fn noise(seed: u32, cells: i32, u: f64, v: f64) -> f64 {
    let ([x, y], [fu, fv]) = cell(cells, u, v);
    let corner = |dx: i32, dy: i32| {
        let angle = random(seed, (x + dx).rem_euclid(cells), (y + dy).rem_euclid(cells)) * 2.0 * PI;
        libm::cos(angle) * (fu - f64::from(dx)) + libm::sin(angle) * (fv - f64::from(dy))
    };
    let fade = |t: f64| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let top = mix(corner(0, 0), corner(1, 0), fade(fu));
    let bottom = mix(corner(0, 1), corner(1, 1), fade(fu));
    mix(top, bottom, fade(fv)) * 0.75 + 0.5
}

/// Octaves of noise, each twice as fine and 0.55 times as strong as the one before; in about 0..1.
fn fractal(seed: u32, cells: i32, octaves: u32, u: f64, v: f64) -> f64 {
    let (mut sum, mut total, mut weight) = (0.0, 0.0, 1.0);
    for octave in 0..octaves {
        sum += weight * noise(seed + octave, cells << octave, u, v);
        total += weight;
        weight *= 0.55;
    }
    sum / total
}

/// Noise folded at its middle: creases of 1 on a ground of 0.
fn creases(seed: u32, cells: i32, octaves: u32, u: f64, v: f64) -> f64 {
    1.0 - (fractal(seed, cells, octaves, u, v) * 2.0 - 1.0)
        .abs()
        .min(0.25)
        * 4.0
}

/// Distances to the nearest and second nearest of one random point a cell, in cells, and a random number of the nearest.
fn pebbles(seed: u32, cells: i32, u: f64, v: f64) -> [f64; 3] {
    let ([x, y], [fu, fv]) = cell(cells, u, v);
    let mut best = [9.0, 9.0, 0.0];
    for (dx, dy) in (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy))) {
        let at = [(x + dx).rem_euclid(cells), (y + dy).rem_euclid(cells)];
        let pu = f64::from(dx) + random(seed, at[0], at[1]) - fu;
        let pv = f64::from(dy) + random(seed + 1, at[0], at[1]) - fv;
        let distance = (pu * pu + pv * pv).sqrt();
        if distance < best[0] {
            best = [distance, best[0], random(seed + 2, at[0], at[1])];
        } else if distance < best[1] {
            best[1] = distance;
        }
    }
    best
}

/// Painted metal panels: what is where.
struct Panel {
    /// 0 in the groove between panels, 1 on the panel.
    plate: f64,
    /// 1 on a rivet.
    rivet: f64,
    /// 1 where the paint has come off.
    chipped: f64,
    /// 1 on a lamp.
    lamp: f64,
    /// Slow and fine variation of the paint, 0..1.
    dirt: f64,
    /// A random number of the panel.
    id: f64,
}

impl Panel {
    fn at(u: f64, v: f64) -> Self {
        let ([x, y], [fu, fv]) = cell(4, u, v);
        let id = random(7, x.rem_euclid(4), y.rem_euclid(4));
        let edge = fu.min(1.0 - fu).min(fv).min(1.0 - fv);
        let plate = smoothstep(0.025, 0.06, edge);
        let (ru, rv) = (fu.min(1.0 - fu) - 0.14, fv.min(1.0 - fv) - 0.14);
        let rivet = 1.0 - smoothstep(0.03, 0.05, (ru * ru + rv * rv).sqrt());
        let wear = fractal(11, 5, 6, u, v) + 0.16 * (1.0 - smoothstep(0.0, 0.18, edge));
        let scratch = creases(23, 6, 3, u, v * 1.0);
        let chipped =
            smoothstep(0.57, 0.61, wear).max(0.8 * smoothstep(0.93, 0.99, scratch) * plate);
        let bar = (fu - 0.5).abs() < 0.22 && (fv - 0.5).abs() < 0.05;
        let lamp = if id > 0.7 && bar {
            smoothstep(0.22, 0.19, (fu - 0.5).abs()) * smoothstep(0.05, 0.03, (fv - 0.5).abs())
        } else {
            0.0
        };
        Self {
            plate,
            rivet,
            chipped: chipped * (1.0 - lamp),
            lamp,
            dirt: fractal(31, 3, 7, u, v),
            id,
        }
    }

    fn height(u: f64, v: f64) -> f64 {
        let p = Self::at(u, v);
        p.plate + 0.35 * p.rivet - 0.12 * p.chipped + 0.06 * fractal(41, 24, 3, u, v) + 0.1 * p.lamp
    }
}

fn panel(images: &mut Vec<Image>) {
    images.push(Image::new("panel_albedo", 256, |u, v| {
        let p = Panel::at(u, v);
        let paint = mix3(
            [0.62, 0.16, 0.09],
            [0.75, 0.62, 0.38],
            smoothstep(0.45, 0.55, p.id),
        );
        let paint = scale(paint, 0.8 + 0.4 * p.dirt);
        let metal = scale([0.72, 0.7, 0.67], 0.75 + 0.35 * fractal(53, 16, 4, u, v));
        let colour = mix3(paint, metal, p.chipped);
        let grimy = mix3([0.1, 0.09, 0.08], colour, 0.25 + 0.75 * p.plate);
        mix3(grimy, [0.95, 0.92, 0.85], p.lamp)
    }));
    images.push(Image::normals("panel_normal", 256, 0.012, Panel::height));
    images.push(Image::new("panel_metallic_roughness", 256, |u, v| {
        let p = Panel::at(u, v);
        let roughness = mix(
            0.35 + 0.3 * p.dirt,
            0.2 + 0.35 * fractal(61, 20, 4, u, v),
            p.chipped,
        );
        let roughness = mix(0.9, roughness, p.plate);
        [1.0, mix(roughness, 0.3, p.lamp), p.chipped * p.plate]
    }));
    images.push(Image::new("panel_occlusion", 256, |u, v| {
        // Darker where the surroundings are higher.
        let around = (0..8)
            .map(|i| {
                let angle = f64::from(i) * PI / 4.0;
                Panel::height(u + 0.012 * libm::cos(angle), v + 0.012 * libm::sin(angle))
            })
            .sum::<f64>();
        let blocked = (around / 8.0 - Panel::height(u, v)).max(0.0);
        [(0.35 + 0.65 * Panel::at(u, v).plate) * (1.0 - 1.2 * blocked)]
    }));
    images.push(Image::new("panel_emissive", 256, |u, v| {
        let p = Panel::at(u, v);
        let flicker = 0.6 + 0.4 * noise(71, 64, u, v);
        scale(
            mix3(
                [1.0, 0.55, 0.15],
                [0.3, 0.8, 1.0],
                smoothstep(0.8, 0.9, p.id),
            ),
            p.lamp * flicker,
        )
    }));
}

/// Grain of leather: pebbles divided by furrows, with pores.
fn grain(u: f64, v: f64) -> f64 {
    let (wu, wv) = (
        u + 0.012 * noise(101, 8, u, v),
        v + 0.012 * noise(102, 8, u, v),
    );
    let [near, far, id] = pebbles(103, 26, wu, wv);
    let furrow = smoothstep(0.02, 0.32, far - near);
    let pore = 1.0 - smoothstep(0.05, 0.12, near);
    furrow * (0.7 + 0.3 * id) - 0.25 * pore + 0.15 * fractal(107, 40, 2, u, v)
}

fn leather(images: &mut Vec<Image>) {
    images.push(Image::new("hide_albedo", 256, |u, v| {
        let slow = fractal(111, 2, 6, u, v);
        let fine = fractal(112, 30, 3, u, v);
        let freckle = smoothstep(0.66, 0.75, fractal(113, 14, 3, u, v));
        let base = mix3([0.72, 0.62, 0.5], [0.95, 0.88, 0.78], slow);
        mix3(
            scale(base, 0.75 + 0.5 * fine),
            [0.4, 0.28, 0.2],
            0.6 * freckle,
        )
    }));
    images.push(Image::new("grain_height", 256, |u, v| [grain(u, v)]));
    images.push(Image::new("wrinkle_height", 256, |u, v| {
        let long = creases(121, 3, 4, u, v);
        let short = creases(122, 9, 3, u, v);
        [0.85 - 0.5 * long * long - 0.25 * short * short + 0.1 * fractal(123, 5, 4, u, v)]
    }));
    images.push(Image::new("wear_mask", 256, |u, v| {
        [smoothstep(0.3, 0.75, fractal(131, 3, 7, u, v))]
    }));
    images.push(Image::new("diffuse_lut", 64, |u, v| {
        // A cosine wrapped round the terminator, further for red and for curved skin, as light that travels inside does.
        let cosine = u * 2.0 - 1.0;
        [0.9, 0.45, 0.25].map(|reach| {
            let wrap = reach * v * 0.6;
            let lit = ((cosine + wrap) / (1.0 + wrap)).max(0.0);
            lit * (1.0 + 0.25 * lit * (1.0 - v)) * 0.8
        })
    }));
    images.push(Image::new("specular_lut", 64, |u, v| {
        // A normalised Blinn-Phong lobe, stored as its square root so that its tail keeps some bits.
        let exponent = 2.0 / (0.02 + v * v * v * v) - 1.0;
        [(libm::pow(u, exponent.max(1.0)) * (exponent + 8.0) / 110.0).sqrt()]
    }));
}

/// The studio that is mirrored: a ceiling with soft boxes, walls, and a floor with a seam.
fn studio([x, y, z]: [f64; 3]) -> [f64; 3] {
    if y < -0.02 {
        // Where the ray meets the floor.
        let (fu, fv) = (x / -y, z / -y);
        let far = smoothstep(1.0, 9.0, (fu * fu + fv * fv).sqrt());
        let tile = cell(1, fu * 1.5, fv * 1.5);
        let dark = (tile.0[0] + tile.0[1]).rem_euclid(2) == 0;
        let shade = 0.2 + if dark { 0.0 } else { 0.12 } + 0.1 * random(201, tile.0[0], tile.0[1]);
        return mix3(scale([0.9, 0.85, 0.8], shade), [0.3, 0.32, 0.36], far);
    }
    let wall = mix3(
        [0.3, 0.32, 0.36],
        [0.12, 0.15, 0.22],
        smoothstep(0.0, 0.9, y),
    );
    let angle = libm::atan2(z, x);
    // Pillars along the walls.
    let pillar = 0.5 + 0.5 * libm::sin(angle * 14.0 + 0.4 * libm::sin(y * 20.0));
    let wall = scale(wall, 0.75 + 0.4 * pillar * (1.0 - y));
    // Soft boxes on the ceiling: two long ones and a row of small ones.
    let (cu, cv) = (x / (y + 0.02), z / (y + 0.02));
    let strip = |c: f64| smoothstep(0.3, 0.24, (cu - c).abs()) * smoothstep(1.6, 1.5, cv.abs());
    let row = smoothstep(0.16, 0.1, (cu).abs())
        * smoothstep(0.3, 0.2, (cv * 2.0 - (cv * 2.0 + 0.5).floor()).abs())
        * smoothstep(2.3, 2.2, cv.abs());
    let light = (strip(-0.9) + strip(0.9) + row).min(1.0);
    mix3(wall, [1.0, 0.97, 0.92], light)
}

fn environment(images: &mut Vec<Image>) {
    type Direction = fn(f64, f64) -> [f64; 3];
    // Across and down the face to a direction, in the order and handedness of cube maps.
    let faces: [(&str, Direction); 6] = [
        ("studio_px", |s, t| [1.0, -t, -s]),
        ("studio_nx", |s, t| [-1.0, -t, s]),
        ("studio_py", |s, t| [s, 1.0, t]),
        ("studio_ny", |s, t| [s, -1.0, -t]),
        ("studio_pz", |s, t| [s, -t, 1.0]),
        ("studio_nz", |s, t| [-s, -t, -1.0]),
    ];
    for (name, direction) in faces {
        images.push(Image::new(name, 128, |u, v| {
            // Two by two samples a texel: edges of lights are sharp.
            let mut sum = [0.0; 3];
            for (du, dv) in [(-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25)] {
                let [x, y, z] =
                    direction((u + du / 128.0) * 2.0 - 1.0, (v + dv / 128.0) * 2.0 - 1.0);
                let length = (x * x + y * y + z * z).sqrt();
                let colour = studio([x / length, y / length, z / length]);
                sum = [0, 1, 2].map(|i| sum[i] + colour[i] * 0.25);
            }
            sum
        }));
    }
}

fn rock_height(u: f64, v: f64) -> f64 {
    let [near, far, id] = pebbles(301, 7, u + 0.05 * noise(304, 6, u, v), v);
    let crack = smoothstep(0.0, 0.12, far - near);
    0.35 * crack * (0.6 + 0.4 * id) + 0.65 * fractal(305, 4, 7, u, v)
}

fn rock(images: &mut Vec<Image>) {
    images.push(Image::new("rock_albedo", 256, |u, v| {
        let height = rock_height(u, v);
        let hue = fractal(311, 3, 5, u, v);
        let base = mix3(
            [0.5, 0.45, 0.4],
            [0.66, 0.58, 0.46],
            smoothstep(0.35, 0.65, hue),
        );
        let grit = 0.8 + 0.4 * noise(312, 90, u, v);
        let lichen = smoothstep(0.62, 0.7, fractal(313, 6, 5, u, v));
        mix3(
            scale(base, (0.45 + 0.9 * height) * grit),
            [0.66, 0.67, 0.52],
            0.6 * lichen,
        )
    }));
    images.push(Image::normals("rock_normal", 256, 0.09, rock_height));
}

fn terrain(images: &mut Vec<Image>) {
    images.push(Image::new("grass_albedo", 256, |u, v| {
        // Blades are noise stretched in two directions; clumps are slow.
        let blades = noise(401, 80, u, v * 0.25).max(noise(402, 80, u * 0.25, v));
        let clump = fractal(403, 5, 4, u, v);
        let dry = smoothstep(0.55, 0.75, fractal(404, 3, 5, u, v));
        let green = mix3([0.16, 0.26, 0.07], [0.38, 0.5, 0.16], blades * clump * 1.6);
        let [r, g, b] = mix3(green, [0.6, 0.53, 0.28], 0.7 * dry);
        [r, g, b, 0.2 + 0.6 * blades * clump]
    }));
    images.push(Image::new("cliff_albedo", 256, |u, v| {
        let strata = noise(
            411,
            16,
            0.2 * noise(412, 4, u, v),
            v + 0.06 * noise(413, 5, u, v),
        );
        let grain = fractal(414, 12, 5, u, v);
        let base = mix3([0.34, 0.3, 0.27], [0.62, 0.55, 0.47], strata);
        let [r, g, b] = scale(base, 0.6 + 0.75 * grain);
        [r, g, b, 0.25 + 0.35 * strata + 0.35 * (grain - 0.3)]
    }));
    images.push(Image::new("splat_mask", 256, |u, v| {
        let rock = smoothstep(0.45, 0.62, fractal(421, 4, 6, u, v));
        let bright = fractal(422, 2, 6, u, v);
        let wet = smoothstep(0.4, 0.65, fractal(423, 5, 5, u, v));
        // A few ragged holes.
        let hole = smoothstep(0.70, 0.72, fractal(424, 4, 4, u, v));
        [rock, bright, wet, 1.0 - hole]
    }));
}

fn wall(images: &mut Vec<Image>) {
    images.push(Image::new("grime", 256, |u, v| {
        let stain = smoothstep(0.45, 0.8, fractal(501, 3, 7, u, v));
        // Streaks run down the wall.
        let streak = smoothstep(0.55, 0.8, noise(502, 32, u, v * 0.09));
        let [near, _, _] = pebbles(503, 48, u, v);
        [
            stain.max(0.5 * streak),
            fractal(504, 10, 5, u, v),
            smoothstep(0.1, 0.5, near),
        ]
    }));
}

fn ivy(images: &mut Vec<Image>) {
    images.push(Image::new("ivy_leaves", 256, |u, v| {
        let ragged = 0.06 * (fractal(601, 24, 3, u, v) - 0.5);
        let [near, next, leaf] = pebbles(602, 9, u, v);
        let cover = smoothstep(0.62, 0.5, near + ragged);
        let vein = smoothstep(0.1, 0.0, (next - near).abs()) + smoothstep(0.08, 0.02, near);
        let green = mix3([0.1, 0.24, 0.06], [0.42, 0.52, 0.14], leaf);
        let green = mix3(green, [0.6, 0.62, 0.3], 0.5 * vein.min(1.0));
        let old = smoothstep(0.55, 0.75, fractal(603, 5, 5, u, v));
        let tone = 0.7 + 0.6 * fractal(604, 12, 4, u, v);
        let lit = scale(mix3(green, [0.55, 0.3, 0.1], 0.8 * old), tone);
        // Between the leaves nothing is seen: a colour that no leaf has.
        let [r, g, b] = mix3([0.5, 0.1, 0.6], lit, smoothstep(0.0, 0.1, cover));
        [r, g, b, cover]
    }));
}

/// All textures, in the order of their materials.
pub(crate) fn all() -> Vec<Image> {
    let mut images = Vec::new();
    for make in [panel, leather, environment, rock, terrain, wall, ivy] {
        make(&mut images);
    }
    images
}

/// Where the textures live in the repository.
pub(crate) fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata/materials/textures")
}

fn write(image: &Image, path: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let file = std::io::BufWriter::new(std::fs::File::create(path)?);
    let mut encoder = png::Encoder::new(file, image.size, image.size);
    encoder.set_color(match image.channels {
        1 => png::ColorType::Grayscale,
        3 => png::ColorType::Rgb,
        _ => png::ColorType::Rgba,
    });
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::High);
    encoder.write_header()?.write_image_data(&image.pixels)?;
    Ok(())
}

#[cfg_attr(test, allow(dead_code, reason = "the test takes the pixels alone"))]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).map_or_else(folder, PathBuf::from);
    std::fs::create_dir_all(&folder)?;
    for image in all() {
        let path = folder.join(format!("{}.png", image.name));
        write(&image, &path)?;
        println!("{}", path.display());
    }
    Ok(())
}
