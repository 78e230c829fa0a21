//! What errors are measured over: the frames of a scene at one distance, rasterised once, with the pixels of
//! the reference beside them. A variant is then one run of its fragment program.

use super::frame::{Executed, Part, Pen, Rasterised, shown};
use crate::error::{Details, ErrorFigures, ErrorSum};
use crate::eval::generated::Baked;
use crate::eval::program::{Program, Refused};
use crate::eval::programs::{self, Programs, Stand};
use crate::eval::raster::{Frame, Shape, shape};
use crate::scene::{
    SceneLighting, Split,
    chance::{child, unit},
};
use crate::time::model::{Extent, Features, Invocation};
use lodc_passes::{Shader, Used};
use naga::{Binding, Interpolation, ScalarKind};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::OnceLock;

/// Squares of 2 x 2 pixels that a search set has, over all of its frames; a frame has at least one block full.
const SEARCH_SQUARES: usize = 1024;

/// The most tiles of 8 x 8 pixels that a set has, over all frames and offsets: of larger sets some are chosen, so that
/// memory does not grow with the scene. That is 6 million fragments, all of 24 pictures of 256 x 256 at four offsets.
const MOST_TILES: usize = 96 * 1024;

/// How many pictures a held-out split has.
const HELD_OUT: usize = 16;

/// The most tiles of a set of [`Samples::Tiles`], over all frames and offsets: 200,000 fragments.
#[cfg(feature = "mesh")]
const SOME_TILES: usize = 3 * 1024;

/// The least bound that errors are weighed by, so that a bound of 0 weighs them too.
const LEAST_BOUND: f64 = 1e-6;

/// A tile that uses up less than this part of its squared error is not close to its bound.
const CLOSE: f64 = 0.5;

/// Which samples of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Samples {
    /// A part that is quick to shade: squares of pixels spread evenly over every frame, each frame at one of the
    /// offsets in turn.
    Search,
    /// A part that tells all that the strain asks for: whole tiles of every frame, at every offset.
    #[cfg(feature = "mesh")]
    Tiles,
    /// All of them: every pixel of every frame at every offset.
    Full,
    /// Pictures that the search does not see, every pixel of each: independent draws of a view, of the uniforms and of
    /// an offset, from the ranges of the scene.
    HeldOut(Split),
}

/// What was measured of a variant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measured {
    /// Its error against the reference.
    pub error: ErrorSum,
    /// How much of its bound it uses up at this distance; feasible when at most 1 (see [`ErrorFigures::strain`]). Of a
    /// search set, which has no whole tiles and each pixel at one offset only, that of the excess and of the worst view.
    pub strain: f64,
    /// `E^2` less the original's, in units of the square of the bound: what a search weighs against work.
    pub load: f64,
    /// What it uses up: the executed work of a covered fragment, and textures.
    pub used: Used,
    /// What that costs by the scene's goal; with the original's a share, and of the time alone [`lodc_passes::Work::total`].
    pub cost: f64,
    /// What one invocation of each stage executes, by class.
    pub invocation: Invocation,
}

/// A picture as a display shows it over black, one sample a pixel, at its centre.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct OverBlack {
    /// In pixels.
    pub width: u32,
    /// In pixels.
    pub height: u32,
    /// sRGB-encoded colours, 0..1, row by row from the top.
    pub pixels: Vec<[f32; 3]>,
}

/// Tiles of frames: by the number of the frame, their columns and rows.
pub(super) type Tiles = BTreeMap<usize, BTreeSet<(u32, u32)>>;

/// The samples at one distance.
pub struct SampleSet<'a> {
    pub(super) stand: &'a Stand<'a>,
    distance: f64,
    /// Whether it has all that the strain asks for: whole tiles, at every offset.
    whole: bool,
    pub(super) frames: Vec<Rasterised>,
    original: Drawn,
    extent: OnceLock<Extent>,
}

/// What was drawn of a shader.
#[derive(Clone, Default)]
struct Drawn {
    details: Details,
    used: Used,
    invocation: Invocation,
}

impl<'a> SampleSet<'a> {
    /// Draws the reference: the original, 4 x 4 samples a pixel, and keeps the fragments to be shaded.
    ///
    /// # Errors
    /// When the evaluator refuses the original.
    pub fn new(stand: &'a Stand<'a>, distance: f64, samples: Samples) -> Result<Self, Refused> {
        let mut sets = Self::beside(&[stand], distance, samples)?;
        // One for each stand.
        Ok(sets.swap_remove(0))
    }

    /// The samples of two shaders of one scene at a distance, for [`crate::scene::Scene::read_both`]. The first is the
    /// original, and each picture is of the same view with the same uniforms. What the second set measures, of the
    /// second shader, is against the first one's reference, floor and work.
    ///
    /// # Errors
    /// When the evaluator refuses one of them.
    pub fn of_two(
        stands: [&'a Stand<'a>; 2],
        distance: f64,
        samples: Samples,
    ) -> Result<[Self; 2], Refused> {
        let mut sets = Self::beside(&stands, distance, samples)?;
        let second = sets.swap_remove(1);
        Ok([sets.swap_remove(0), second])
    }

    /// The same of one shader in scenes that differ in their meshes alone: one set for each, against the pictures of the first.
    ///
    /// # Errors
    /// When the evaluator refuses it.
    #[cfg(feature = "mesh")]
    pub(crate) fn of_meshes(
        stands: &[&'a Stand<'a>],
        distance: f64,
        samples: Samples,
    ) -> Result<Vec<Self>, Refused> {
        Self::beside(stands, distance, samples)
    }

    /// The samples of several shaders, of which there is at least one, the original first.
    fn beside(
        stands: &[&'a Stand<'a>],
        distance: f64,
        samples: Samples,
    ) -> Result<Vec<Self>, Refused> {
        let programs = stands
            .iter()
            .map(|stand| programs::fragment(stand.base, &[]));
        let mut programs: Vec<Program> = programs.collect::<Result<_, _>>()?;
        let scene = stands[0].scene;
        let frames = match samples {
            Samples::HeldOut(split) => scene.held_out(distance, split, HELD_OUT),
            _ => scene.frames(distance),
        };
        let count = frames.len().max(1);
        let part = match samples {
            Samples::Search => Part::Squares((SEARCH_SQUARES / count).max(64)),
            #[cfg(feature = "mesh")]
            Samples::Tiles => Part::Tiles(SOME_TILES / (count * scene.offsets)),
            Samples::Full => Part::Tiles(MOST_TILES / (count * scene.offsets)),
            Samples::HeldOut(_) => Part::Tiles(MOST_TILES / count),
        };
        let rasterised: Vec<Vec<Rasterised>> = frames
            .into_par_iter()
            .enumerate()
            .map(|(index, frame)| {
                let seed = child(scene.seed, index as u64);
                let (view, offsets) = match samples {
                    Samples::HeldOut(_) => (index, vec![frame.offset]),
                    Samples::Search => {
                        let view = index / scene.uniform_samples();
                        let mut offsets = offsets(scene.offsets, seed);
                        (view, vec![offsets.swap_remove(index % scene.offsets)])
                    }
                    _ => {
                        let view = index / scene.uniform_samples();
                        (view, offsets(scene.offsets, seed))
                    }
                };
                let pens = stands.iter().zip(&programs).map(|(stand, fragment)| {
                    let pen = Pen {
                        vertex: stand.vertex,
                        fragment,
                        scene: stand.scene,
                    };
                    (pen, stand.scene.again(&frame))
                });
                let pens: Vec<_> = pens.collect();
                Rasterised::new(&pens, view, &offsets, (part, seed))
            })
            .collect();
        let sets = stands.iter().map(|stand| Self {
            stand,
            distance,
            whole: samples != Samples::Search,
            frames: Vec::with_capacity(count),
            original: Drawn::default(),
            extent: OnceLock::new(),
        });
        let mut sets: Vec<Self> = sets.collect();
        for of_all in rasterised {
            for (set, mut frame) in sets.iter_mut().zip(of_all) {
                // Full sets meet few variants, and would take too much memory.
                if samples == Samples::Search {
                    frame.remember();
                }
                set.frames.push(frame);
            }
        }
        let original = Programs::with(stands[0].base, programs.swap_remove(0))?;
        let original = sets[0].draw(&original);
        for set in &mut sets {
            set.original = original.clone();
        }
        Ok(sets)
    }

    /// Some tiles alone, each as all samples have it.
    ///
    /// # Errors
    /// When the evaluator refuses the original.
    pub(super) fn of_tiles(
        stand: &'a Stand<'a>,
        distance: f64,
        tiles: &Tiles,
    ) -> Result<Self, Refused> {
        let original = Programs::of(stand.base)?;
        let scene = stand.scene;
        let frames = scene.frames(distance).into_par_iter().enumerate();
        let frames: Vec<Vec<Rasterised>> = frames
            .filter_map(|(index, frame)| {
                let part = Part::These(tiles.get(&index)?);
                let seed = child(scene.seed, index as u64);
                let view = index / scene.uniform_samples();
                let offsets = offsets(scene.offsets, seed);
                let pen = Pen {
                    vertex: stand.vertex,
                    fragment: &original.fragment,
                    scene,
                };
                Some(Rasterised::new(
                    &[(pen, frame)],
                    view,
                    &offsets,
                    (part, seed),
                ))
            })
            .collect();
        let mut set = Self {
            stand,
            distance,
            whole: true,
            frames: frames.into_iter().flatten().collect(),
            original: Drawn::default(),
            extent: OnceLock::new(),
        };
        set.original = set.draw(&original);
        Ok(set)
    }

    /// The distance of its frames, in world units.
    pub fn distance(&self) -> f64 {
        self.distance
    }

    /// What was measured of the original: the floor.
    pub fn original(&self) -> Measured {
        self.judge(&self.original)
    }

    /// All error figures of the original.
    pub fn floor(&self) -> ErrorFigures {
        self.figures_of(&self.original.details)
    }

    /// Measures a variant.
    ///
    /// # Errors
    /// When the evaluator refuses it; a variant of an original that runs, runs.
    pub fn measure(&self, shader: &Shader) -> Result<Measured, Refused> {
        Ok(self.measure_programs(&Programs::of(shader)?))
    }

    /// Measures the programs of a variant.
    pub fn measure_programs(&self, programs: &Programs) -> Measured {
        self.judge(&self.draw(programs))
    }

    /// Measures a variant, with all that was measured of it.
    pub(crate) fn in_full(&self, programs: &Programs) -> (Details, Measured) {
        let drawn = self.draw(programs);
        let measured = self.judge(&drawn);
        (drawn.details, measured)
    }

    /// Whether two shaders draw the same pictures, to the last bit of what is displayed.
    ///
    /// # Errors
    /// When the evaluator refuses one of them.
    pub fn same(&self, one: &Shader, other: &Shader) -> Result<bool, Refused> {
        let programs = [Programs::of(one)?, Programs::of(other)?];
        let output = self.stand.scene.output;
        Ok(self.frames.par_iter().all(|frame| {
            let differences = frame.differences(&programs, output);
            let bits = |all: &[[f32; 6]]| -> Vec<[u32; 6]> {
                all.iter().map(|pixel| pixel.map(f32::to_bits)).collect()
            };
            matches!(&differences[..], [one, other] if bits(one) == bits(other))
        }))
    }

    /// What a variant leaves at each pixel of every picture, as it is displayed, over both backgrounds. Sets that were made together have
    /// the same pixels in the same order.
    #[cfg(feature = "mesh")]
    pub(crate) fn left(&self, programs: &Programs) -> Vec<[f32; 6]> {
        let output = self.stand.scene.output;
        let one = std::slice::from_ref(programs);
        let frames = self.frames.par_iter();
        let frames: Vec<Vec<Vec<[f32; 6]>>> =
            frames.map(|frame| frame.differences(one, output)).collect();
        frames.into_iter().flatten().flatten().collect()
    }

    /// All error figures of a variant, against the original's and the bound at this distance.
    ///
    /// # Errors
    /// When the evaluator refuses it.
    pub fn figures(&self, shader: &Shader) -> Result<ErrorFigures, Refused> {
        let drawn = self.draw(&Programs::of(shader)?);
        Ok(self.figures_of(&drawn.details))
    }

    /// FLIP of a variant: the mean over the pictures of the views and uniform samples, each at its first offset, over
    /// the pixels that the reference or the picture covers, and over a black and a white background. 0 to 1.
    ///
    /// # Errors
    /// When the evaluator refuses it.
    pub fn flip(&self, shader: &Shader) -> Result<f64, Refused> {
        let scene = self.stand.scene;
        let programs = Programs::of(shader)?;
        let sums: Vec<(f64, usize)> = self
            .frames
            .par_iter()
            .map(|frame| frame.flip(&programs, scene.output, scene.pixels_per_degree))
            .collect();
        let (sum, count) = sums
            .iter()
            .fold((0.0, 0), |(sum, count), (s, c)| (sum + s, count + c));
        Ok(sum / count.max(1) as f64)
    }

    /// A shader's pictures, one for each view, with the first sample of the uniforms, as a display shows them over black
    /// (see [`OverBlack`]).
    ///
    /// # Errors
    /// When the evaluator refuses it.
    pub fn pictures(&self, shader: &Shader) -> Result<Vec<OverBlack>, Refused> {
        let scene = self.stand.scene;
        let programs = Programs::of(shader)?;
        let own = programs.vertex.as_ref().map(|(program, _)| program);
        let pen = Pen {
            vertex: own.unwrap_or(self.stand.vertex),
            fragment: &programs.fragment,
            scene,
        };
        let frames = scene.frames(self.distance);
        let first_of_view = frames.par_iter().step_by(scene.uniform_samples());
        let pictures = first_of_view.map(|frame| OverBlack {
            width: frame.width,
            height: frame.height,
            pixels: shown(&pen, &programs.bound(frame).0),
        });
        Ok(pictures.collect())
    }

    /// Measures the original and a variant of it frame by frame: what a held-out split is judged by.
    pub(crate) fn pair(&self, shader: &Shader) -> Result<(Details, &Details), Refused> {
        let drawn = self.draw(&Programs::of(shader)?);
        Ok((drawn.details, &self.original.details))
    }

    /// The tiles that use up the most of their bound, at most so many; none that use up less than [`CLOSE`].
    pub(super) fn worst_tiles(&self, details: &Details, most: usize) -> Tiles {
        let frames = self.frames.iter().enumerate();
        let places = frames.flat_map(|(i, frame)| frame.tiles().iter().map(move |tile| (i, *tile)));
        let added = details.tiles.iter().zip(&self.original.details.tiles);
        let added = added.map(|(level, original)| level - original);
        let mut worst: Vec<_> = added.zip(places).collect();
        worst.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        worst.truncate(most);
        let least = CLOSE * self.figures_of(details).tile_limit();
        let mut tiles = Tiles::new();
        for (added, (frame, tile)) in worst {
            if added > least {
                tiles.entry(frame).or_default().insert(tile);
            }
        }
        tiles
    }

    /// How much of its bound the worst of its tiles uses up.
    pub(super) fn strain_of_tiles(&self, programs: &Programs) -> f64 {
        self.figures_of(&self.draw(programs).details)
            .strain_of_tiles()
    }

    pub(crate) fn figures_of(&self, details: &Details) -> ErrorFigures {
        let scene = self.stand.scene;
        let bound = (scene.bound(self.distance), scene.reading);
        ErrorFigures::new(details, &self.original.details, bound)
    }

    /// What a variant costs by the scene's goal.
    pub(super) fn cost(&self, used: &Used) -> f64 {
        self.stand.scene.goal.cost(used, &self.original.used)
    }

    /// A cost as a share of the original's; 1 where that costs nothing.
    pub(super) fn share(&self, cost: f64) -> f64 {
        let whole = self.cost(&self.original.used);
        if whole > 0.0 { cost / whole } else { 1.0 }
    }

    fn judge(&self, drawn: &Drawn) -> Measured {
        let Drawn {
            details,
            used,
            invocation,
        } = drawn;
        let figures = self.figures_of(details);
        let added = details.error.square() - self.original.details.error.square();
        let most = self.stand.scene.host.most_texture_bytes;
        let too_large = most.is_some_and(|most| used.generated_bytes > most);
        Measured {
            error: details.error,
            strain: match self.whole {
                _ if too_large => f64::INFINITY,
                true => figures.strain(),
                false => figures.strain_of_means(),
            },
            load: added / figures.bound.max(LEAST_BOUND).powi(2),
            used: *used,
            cost: self.cost(used),
            invocation: *invocation,
        }
    }

    /// What one squared difference of one pixel adds to the load.
    pub(super) fn load_of_square(&self) -> f64 {
        let bound = self.stand.scene.bound(self.distance).max(LEAST_BOUND);
        1.0 / (bound.powi(2) * self.original.details.error.coverage.max(1.0))
    }

    /// Draws every frame at every offset.
    fn draw(&self, programs: &Programs) -> Drawn {
        let output = self.stand.scene.output;
        let results: Vec<_> = self
            .frames
            .par_iter()
            .map(|frame| (frame.view(), frame.measure(programs, output)))
            .collect();
        let mut all = Executed::default();
        for (_, (_, executed)) in &results {
            all.fragments += executed.fragments;
            all.work += executed.work;
            all.mix += executed.mix;
            all.vertices += executed.vertices;
            all.vertex_mix += executed.vertex_mix;
            all.drawn += executed.drawn;
            all.elsewhere += executed.elsewhere;
        }
        let mut work = all.work * (1.0 / all.fragments.max(1) as f64);
        work.moved = programs.handing_over + all.elsewhere / all.drawn.max(1) as f64;
        let frames = results.into_iter().map(|(view, (error, _))| (view, error));
        let scene = self.stand.scene;
        let made = programs.generated.baked(scene.constant(), &scene.baked);
        let made: u64 = made.iter().map(Baked::bytes).sum();
        let used = Used {
            work,
            textures: programs.textures.len() as u32,
            texture_bytes: scene.texture_bytes(&programs.textures) + made,
            generated_bytes: made,
        };
        let read = programs.fragment.read_inputs();
        let (mut interpolated, mut flat) = (0.0, 0.0);
        for slot in read.filter(|slot| matches!(slot.binding, Binding::Location { .. })) {
            match (slot.kind, slot.interpolation) {
                (
                    ScalarKind::Float,
                    None | Some(Interpolation::Perspective | Interpolation::Linear),
                ) => {
                    interpolated += 1.0;
                }
                _ => flat += 1.0,
            }
        }
        Drawn {
            details: Details::new(frames),
            used,
            invocation: Invocation {
                fragment: all.mix * (1.0 / all.fragments.max(1) as f64),
                vertex: all.vertex_mix * (1.0 / all.vertices.max(1) as f64),
                interpolated,
                flat,
            },
        }
    }

    /// What one draw of the object executes with what a variant's invocations do, over the whole pictures of the scene's
    /// frames at this distance.
    pub fn features(&self, measured: &Measured) -> Features {
        Features {
            invocation: measured.invocation,
            extent: *self.extent.get_or_init(|| self.extent()),
        }
    }

    fn extent(&self) -> Extent {
        let Stand { vertex, scene, .. } = self.stand;
        let frames = scene.frames(self.distance);
        let shapes: Vec<Shape> = frames
            .par_iter()
            .map(|frame| shape(vertex, frame))
            .collect();
        let mean = |of: fn(&Shape) -> u64| {
            shapes.iter().map(of).sum::<u64>() as f64 / shapes.len().max(1) as f64
        };
        let fed = vertex.read_inputs();
        let fed = fed.filter(|slot| matches!(slot.binding, Binding::Location { .. }));
        let mesh = frames.first().map(|frame: &Frame| &frame.mesh);
        // A target of four bytes, or those that the lighting reads, and depth.
        let colours = scene
            .lighting
            .as_ref()
            .map_or(4, SceneLighting::target_bytes);
        Extent {
            fragments: mean(|shape| shape.fragments),
            lanes: 4.0 * mean(|shape| shape.quads),
            stamp_lanes: 16.0 * mean(|shape| shape.stamps),
            drawn_triangles: mean(|shape| shape.triangles),
            triangles: mesh.map_or(0.0, |mesh| (mesh.indices.len() / 3) as f64),
            vertices: mesh.map_or(0.0, |mesh| mesh.positions.len() as f64),
            vertex_bytes: 4.0 * fed.count() as f64,
            target_bytes: f64::from(colours + 4),
        }
    }
}

/// Where in a pixel pictures are sampled, from its centre, in pixels, -0.5..0.5: `count` points spread evenly over
/// the pixel, the same always for a seed. One alone is the centre. Every frame has a seed of its own: a few points,
/// always the same, lie further out than a pixel does on average, or less far, and the error with them.
///
/// The points are multiples of the plastic number's powers, which stay far from each other however many they are
/// (Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018), shifted by the seed.
pub(crate) fn offsets(count: usize, seed: u64) -> Vec<[f32; 2]> {
    if count <= 1 {
        return vec![[0.0; 2]];
    }
    const STEP: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_3];
    let shift = [0, 1].map(|axis| unit(child(seed, axis)));
    (0..count)
        .map(|i| {
            [0, 1].map(|axis| {
                let at = shift[axis] + STEP[axis] * i as f64;
                (at - at.floor() - 0.5) as f32
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compile::normal_form;
    use crate::eval::mix::{Class, Mix};
    use crate::front::Source;
    use crate::scene::Scene;
    use lodc_passes::Stage;
    use std::path::Path;

    #[test]
    fn features_are_what_a_draw_executes() {
        let source = Source::parse(
            "pane.wgsl",
            "struct Out { @builtin(position) at: vec4f, @location(0) uv: vec2f, @location(1) @interpolate(flat) k: u32 }
             @vertex fn vs_main(@location(0) at: vec3f, @location(1) uv: vec2f) -> Out {
                 return Out(vec4f(at.xy, 0.5, 1.0), uv * 2.0, 7);
             }
             @fragment fn fs_main(in: Out) -> @location(0) vec4f {
                 return vec4f(vec3f(sqrt(in.uv.x) * 0.9 + in.uv.y * f32(in.k)), 1.0);
             }",
        )
        .expect("it parses");
        let text = "resolution = [32, 32]\n[attributes]\nat = \"position\"\nuv = \"uv\"\n";
        let scene = Scene::resolve(&source, Some((Path::new("a.toml"), text)));
        let scene = scene.unwrap_or_else(|e| panic!("{e}"));
        let base = normal_form(&source).expect("it is small");
        let vertex = base.index(Stage::Vertex).expect("it has one");
        let vertex = Program::compile(base.module(), vertex, &[]).expect("it runs");
        let stand = Stand {
            base: &base,
            vertex: &vertex,
            scene: &scene,
        };
        let set = SampleSet::new(&stand, scene.nearest, Samples::Search).expect("it runs");
        let Features { invocation, extent } = set.features(&set.original());
        let of = |counts: &[(Class, f64)]| {
            let mut mix = Mix::default();
            counts
                .iter()
                .for_each(|(class, count)| mix[*class] = *count);
            mix
        };
        let fragment = [(Class::Float, 3.0), (Class::Word, 1.0), (Class::Root, 1.0)];
        assert_eq!(invocation.fragment, of(&fragment));
        assert_eq!(invocation.vertex, of(&[(Class::Float, 2.0)]));
        assert_eq!((invocation.interpolated, invocation.flat), (2.0, 1.0));
        let mesh = &scene.mesh;
        assert_eq!(extent.vertices, mesh.positions.len() as f64);
        assert_eq!(extent.triangles, (mesh.indices.len() / 3) as f64);
        // Of the position two components are read.
        assert_eq!((extent.vertex_bytes, extent.target_bytes), (16.0, 8.0));
        assert!(
            extent.fragments > 0.0 && extent.lanes > extent.fragments,
            "{extent:?}"
        );
        assert!(extent.stamp_lanes > extent.lanes, "{extent:?}");
    }

    #[test]
    fn offsets_are_spread_over_the_pixel_and_repeat() {
        assert_eq!(offsets(1, 7), [[0.0, 0.0]]);
        for seed in 0..50 {
            let four = offsets(4, seed);
            assert_eq!(four, offsets(4, seed));
            assert_eq!(four, offsets(9, seed)[..4]);
            let inside = |x: &f32| (-0.5..=0.5).contains(x);
            assert!(four.as_flattened().iter().all(inside), "{four:?}");
            // Around the edge too: the pattern repeats from pixel to pixel.
            let apart = |a: f32, b: f32| {
                let d = (a - b).abs();
                d.min(1.0 - d)
            };
            for (i, a) in four.iter().enumerate() {
                for b in &four[..i] {
                    let distance = apart(a[0], b[0]).hypot(apart(a[1], b[1]));
                    assert!(distance > 0.3, "{seed}: {a:?} {b:?}");
                }
            }
        }
        assert_ne!(offsets(4, 1), offsets(4, 2));
    }
}
