//! Pictures of both renderers, and how far they are apart.
#![allow(
    dead_code,
    reason = "every test takes what it needs of a shared module"
)]

use lodc::error::{displayed, encoded, held, through};
use lodc::eval::draw::{Shading, resolve, shade_into};
use lodc::eval::image::{Image, Picture};
use lodc::eval::machine::{Bindings, Resource};
use lodc::eval::program::Program;
use lodc::eval::raster::{Frame, rasterize};
use lodc::eval::texture::{Level, Texture};
use lodc::gpu::{Gpu, Pipeline, Renderer, Stages};
use lodc::scene::Scene;
use naga::Module;
use std::sync::Arc;

/// How far the renderers may be apart, in sRGB-encoded values 0..1 as a display shows them, over the pixels that
/// both draw.
#[derive(Clone, Copy)]
pub(crate) struct Tolerance {
    /// On the mean.
    pub(crate) mean: f64,
    /// On every channel of every pixel.
    pub(crate) most: f32,
    /// Whether [`DECISIONS`] may be further apart.
    pub(crate) jumps: bool,
}

impl Tolerance {
    /// That of a shader, by its name.
    pub(crate) fn of(self, shader: &str) -> Self {
        Self {
            jumps: JUMPS.iter().any(|(jumps, _)| *jumps == shader),
            ..self
        }
    }
}

/// The scenes as they are. What the renderers differ in:
/// - Texture filters. The evaluator's weights are exact; Mesa's have 8 bits, as GPUs' have, so that a sample
///   may be off by half a 256th of the difference of two texels; and an implementation may choose a level of detail
///   by derivatives that are not quite those, as Mesa's OpenGL does for cube maps. A mirrored lamp makes much of
///   that. That nothing else is behind it is what [`ROUNDED`] shows.
/// - The precision of textures. OpenGL of Mesa does not filter textures of single precision, so they are of half.
pub(crate) const FILTERED: Tolerance = Tolerance {
    mean: 2e-3,
    most: 0.08,
    jumps: false,
};

/// The same scenes with even textures, whose filter has nothing to do. What is left is rounding: WGSL lets `pow`,
/// `exp`, `sin` and their like be off by some units in the last place, and a driver may fuse a multiplication with
/// an addition; where a shader subtracts what is nearly alike, a few bits become many. A G-buffer of 8 bits makes steps
/// of them: without one, Vulkan's mean is below 2e-5; and OpenGL's one texel is still of half precision.
pub(crate) const ROUNDED: Tolerance = Tolerance {
    mean: 8e-4,
    most: STEP,
    jumps: false,
};

/// The step of an 8-bit target: how far pictures of the GPU may be apart that should be alike.
pub(crate) const STEP: f32 = 1.0 / 255.0;

/// Shaders that jump, and where: a value that is rounded otherwise is on the other side of it.
const JUMPS: [(&str, &str); 4] = [
    ("derivatives", "coarse derivatives"),
    ("integers", "the colour is a `fract`"),
    ("terrain_blend", "the band at its border"),
    ("texture_functions", "the colour is a `fract`"),
];

/// The share of channels that a jump may set further apart.
const DECISIONS: f64 = 1e-3;

/// Pixels on the silhouette that one of the two alone covers, in a hundred that are drawn: positions are rounded
/// to 1/256 pixel, and the matrices' products before that.
const EDGES: f64 = 0.1;

/// The best adapter of an interface; `None` when there is none, which is said.
pub(crate) fn open(interface: &str) -> Option<Gpu> {
    match Gpu::open(Some(interface)) {
        Ok(gpu) => Some(gpu),
        Err(error) if std::env::var_os("CI").is_some() => panic!("{error}"),
        Err(error) => {
            eprintln!("SKIPPED: {error}");
            None
        }
    }
}

/// The evaluator's picture in fine pixels.
pub(crate) fn evaluated(
    (vertex, fragment): &(Program, Program),
    scene: &Scene,
    frame: &Frame,
) -> Picture {
    let coverage = rasterize(vertex, fragment, frame);
    let mut shading = Shading::default();
    match scene.lit(frame, &coverage) {
        Some(lit) => lit.shade_into(fragment, &coverage, &frame.bindings, &mut shading),
        None => shade_into(fragment, &coverage, &frame.bindings, &mut shading),
    }
    if coverage.blends() {
        for colour in &mut shading.colours {
            *colour = held(scene.output, *colour);
        }
    }
    resolve(&coverage, &shading)
}

pub(crate) fn programs(stages: Stages<'_>) -> (Program, Program) {
    let compile = |(module, at): (&Module, usize)| {
        Program::compile(module, at, &[]).unwrap_or_else(|r| panic!("{}", r.what))
    };
    (compile(stages.vertex), compile(stages.fragment))
}

pub(crate) fn pipeline(renderer: &Renderer<'_>, stages: Stages<'_>, scene: &Scene) -> Pipeline {
    let made = renderer.pipeline(stages, scene);
    made.unwrap_or_else(|error| panic!("{error}"))
}

pub(crate) fn drawn(
    renderer: &mut Renderer<'_>,
    pipeline: &Pipeline,
    scene: &Scene,
    frame: &Frame,
) -> Picture {
    let drawn = renderer.draw(pipeline, scene, frame);
    let picture = drawn.and_then(|drawn| drawn.picture(renderer.gpu()));
    picture.unwrap_or_else(|error| panic!("{error}"))
}

/// What a display shows of a covered pixel over black and over white.
pub(crate) fn shown(scene: &Scene, colour: [f32; 4]) -> [[f32; 3]; 2] {
    let black = displayed(scene.output, colour);
    let more = match scene.blends() {
        true => through(scene.output, colour),
        false => [0.0; 3],
    };
    let white = std::array::from_fn(|i| black[i] + more[i]);
    [black, white].map(encoded)
}

/// How far two pictures are apart.
#[derive(Default)]
pub(crate) struct Apart {
    /// One for each channel of each pixel that both cover, sorted.
    pub(crate) differences: Vec<f32>,
    /// How many pixels only one covers.
    edges: usize,
}

impl Apart {
    /// Over a black background, and over a white one where the scene blends.
    pub(crate) fn add(&mut self, scene: &Scene, a: &Picture, b: &Picture) {
        assert_eq!((a.width, a.height), (b.width, b.height));
        for (i, (l, r)) in a.pixels.iter().zip(&b.pixels).enumerate() {
            if a.covered[i] != b.covered[i] {
                self.edges += 1;
            } else if a.covered[i] > 0.0 {
                let [l, r] = [*l, *r].map(|c| shown(scene, c));
                for (l, r) in l.into_iter().zip(r).take(1 + usize::from(scene.blends())) {
                    for (l, r) in l.into_iter().zip(r) {
                        let both = l.is_nan() && r.is_nan();
                        self.differences
                            .push(if both { 0.0 } else { (l - r).abs() });
                    }
                }
            }
        }
        self.differences.sort_unstable_by(f32::total_cmp);
    }

    fn mean(&self) -> f64 {
        let sum: f64 = self.differences.iter().map(|d| f64::from(*d)).sum();
        sum / self.differences.len().max(1) as f64
    }

    /// The largest but for a share of the pixels.
    pub(crate) fn most(&self, but: f64) -> f32 {
        let last = self.differences.len().saturating_sub(1);
        let at = (last as f64 * (1.0 - but)).floor() as usize;
        self.differences.get(at).copied().unwrap_or(f32::NAN)
    }

    /// The share of those that are no larger.
    fn within(&self, step: f32) -> f64 {
        let count = self.differences.partition_point(|d| *d <= step);
        count as f64 / self.differences.len().max(1) as f64
    }

    fn edges(&self) -> f64 {
        300.0 * self.edges as f64 / self.differences.len().max(1) as f64
    }

    /// Prints how far they are apart, and whether that is too far.
    pub(crate) fn judge(&self, what: &str, tolerance: Tolerance) -> Option<String> {
        assert!(self.differences.len() > 1000, "{what}: nothing to see");
        let (mean, most, worst) = (self.mean(), self.most(DECISIONS), self.most(0.0));
        let line = format!(
            "{what}: mean {mean:.1e}, 999 in 1000 within {most:.4}, all within {worst:.4}, {:.1} in 100 within 1/255, edges {:.2} in 100",
            100.0 * self.within(STEP),
            self.edges()
        );
        println!("{line}");
        let bounded = if tolerance.jumps { most } else { worst };
        // A NaN in one of the two sorts last.
        let fine = mean <= tolerance.mean && bounded <= tolerance.most && self.edges() <= EDGES;
        (!fine).then_some(line)
    }
}

/// The frame with textures that have one colour each, their mean.
pub(crate) fn even(frame: &Frame) -> Frame {
    fn resource(bound: &Resource) -> Resource {
        match bound {
            Resource::Texture(texture) => Resource::Texture(Arc::new(even_texture(texture))),
            Resource::PerDraw(all) => Resource::PerDraw(all.iter().map(resource).collect()),
            other => other.clone(),
        }
    }
    let all = frame.bindings.iter();
    Frame {
        bindings: all
            .map(|(at, bound)| (*at, resource(bound)))
            .collect::<Bindings>(),
        ..frame.clone()
    }
}

fn even_texture(texture: &Texture) -> Texture {
    let Level {
        width,
        height,
        layers,
        ..
    } = texture.levels()[0];
    let mean = texture.facts(0.0, false).mean[0];
    let image = Image {
        width,
        height,
        texels: vec![mean; width as usize * height as usize],
    };
    let images = vec![image; layers as usize];
    let even = Texture::new(texture.dimension(), images).expect("it is as large as before");
    even.with_mip_chain()
}
