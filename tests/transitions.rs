//! Sweeps of distances: how much a picture changes from one frame to the next where a level begins.
#![cfg(feature = "search")]

mod fixtures;

use lodc::compile::{self, Request};
use lodc::emit::{Form, Transition, write_atomically};
use lodc::eval::draw::shade;
use lodc::eval::program::Program;
use lodc::eval::raster::rasterize;
use lodc::front::Source;
use lodc::scene::Scene;
use lodc_passes::autolod;
use naga::ShaderStage;
use std::path::{Path, PathBuf};

/// Frames to a halving of scale.
const FRAMES: f64 = 100.0;
/// How much further than a band a sweep goes on both sides, in halvings.
const BEYOND: f64 = 0.05;

/// A shader as it stands, in its scene.
struct Drawn {
    scene: Scene,
    vertex: Program,
    fragment: Program,
}

impl Drawn {
    fn new(source: &Source, scene: &Path) -> Self {
        let scene = Scene::read(source, Some(scene)).unwrap_or_else(|e| panic!("{e}"));
        let program = |stage: ShaderStage| {
            let mut entries = source.module.entry_points.iter();
            let entry = entries
                .position(|e| e.stage == stage)
                .expect("it has the stage");
            Program::compile(&source.module, entry, &[]).unwrap_or_else(|r| panic!("{}", r.what))
        };
        Self {
            vertex: program(ShaderStage::Vertex),
            fragment: program(ShaderStage::Fragment),
            scene,
        }
    }

    /// The first picture at an autoLOD, in sRGB-encoded colours over black, and the work of a covered fragment.
    fn picture(&mut self, value: f64) -> (Vec<[f32; 3]>, f64) {
        self.scene.set_auto_lod(value);
        let view = self.scene.view(self.scene.nearest);
        let distance = autolod::distance_of(value, self.scene.rho0(), &view);
        let frame = self.scene.frames(distance).remove(0);
        let coverage = rasterize(&self.vertex, &self.fragment, &frame);
        let shading = shade(&self.fragment, &coverage, &frame.bindings);
        let mut pixels = vec![[0.0; 3]; (frame.width * frame.height) as usize];
        for (pixel, colour) in coverage.pixels().zip(&shading.colours) {
            let [r, g, b, _] = colour.map(|light| {
                let light = light.clamp(0.0, 1.0);
                match light <= 0.003_130_8 {
                    true => 12.92 * light,
                    false => 1.055 * light.powf(1.0 / 2.4) - 0.055,
                }
            });
            pixels[pixel as usize] = [r, g, b];
        }
        let profile = &shading.profile;
        (pixels, profile.work.total() / profile.lanes.max(1) as f64)
    }

    /// The largest change from one frame of a sweep to the next, root mean square over the pixels that are covered; and
    /// the most work of a fragment.
    fn sweep(&mut self, from: f64, until: f64) -> (f64, f64) {
        let count = ((until - from) * FRAMES).ceil() as usize;
        let (mut largest, mut most) = (0.0_f64, 0.0_f64);
        let mut before: Option<Vec<[f32; 3]>> = None;
        for frame in 0..=count {
            let (now, work) = self.picture(from + frame as f64 / FRAMES);
            most = most.max(work);
            if let Some(before) = before {
                let (mut sum, mut covered) = (0.0, 0);
                for (a, b) in before.iter().zip(&now) {
                    covered += usize::from(*a != [0.0; 3] || *b != [0.0; 3]);
                    let square = a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2));
                    sum += square.sum::<f64>() / 3.0;
                }
                largest = largest.max((sum / covered.max(1) as f64).sqrt());
            }
            before = Some(now);
        }
        (largest, most)
    }
}

/// A material with few pixels whose levels have been searched, and their thresholds.
fn material(name: &str) -> (PathBuf, Vec<f64>) {
    let to = Path::new(env!("CARGO_TARGET_TMPDIR")).join("transitions");
    let materials = fixtures::small_materials(&to, 64, &["levels = 4", "offsets = 2"]);
    let mut materials = materials.into_iter();
    let path = materials.find(|path| path.file_stem().is_some_and(|stem| stem == name));
    let path = path.expect("it is there");
    let request = Request {
        shader: path.clone(),
        form: Some(Form::Uniform),
        ..Request::default()
    };
    let compiled = compile::compile(&request, &|_| {}).unwrap_or_else(|e| panic!("{e}"));
    write_atomically(&compiled.files).unwrap_or_else(|e| panic!("{e}"));
    let levels = compiled.report.levels.iter().skip(1);
    (path, levels.map(|level| level.autolod).collect())
}

/// The text of all levels with a transition, made from the lock.
fn emitted(shader: &Path, transition: Transition) -> Source {
    let request = Request {
        shader: shader.to_owned(),
        transition: Some(transition),
        ..Request::default()
    };
    let (files, _) = compile::locked(&request).unwrap_or_else(|e| panic!("{e}"));
    let (name, text) = &files[0];
    let text = String::from_utf8(text.clone()).expect("WGSL is text");
    Source::parse(&name.display().to_string(), text).unwrap_or_else(|e| panic!("{e}"))
}

/// Where levels are mixed, no frame differs more from the one before than the original's own do, by a fifth; where one is
/// chosen for each pixel, than half of what a pop does beyond that.
#[test]
fn nothing_pops_where_levels_pass_into_each_other() {
    let (path, thresholds) = material("pbr");
    assert!(thresholds.len() >= 2, "{thresholds:?}");
    let scene = path.with_extension("toml");
    let source = Source::read(&path).unwrap_or_else(|e| panic!("{e}"));
    let mut original = Drawn::new(&source, &scene);
    let kinds = [Transition::Pop, Transition::Blend, Transition::Dither];
    let mut drawn = kinds.map(|kind| Drawn::new(&emitted(&path, kind), &scene));
    println!(
        "largest change from frame to frame, {FRAMES} frames to a halving; the most work of a fragment, as a share"
    );
    println!("  autoLOD  original     pop   blend  dither    work: pop  blend  dither");
    let mut pops = 0;
    for from in thresholds {
        let ends = (from - BEYOND, from + f64::from(lodc::emit::BAND) + BEYOND);
        let (own, whole) = original.sweep(ends.0, ends.1);
        let of_kinds = drawn.each_mut().map(|drawn| drawn.sweep(ends.0, ends.1));
        let [pop, blend, dither] = of_kinds.map(|(change, _)| change);
        let work = of_kinds.map(|(_, work)| work / whole);
        println!(
            "  {from:7.2}  {own:8.4}  {pop:6.4}  {blend:6.4}  {dither:6.4}         {:4.2}   {:4.2}    {:4.2}",
            work[0], work[1], work[2]
        );
        pops += usize::from(pop > 1.2 * own);
        assert!(
            blend <= 1.2 * own,
            "at {from}: {blend}, the original's {own}"
        );
        assert!(
            dither <= own.max(0.5 * (own + pop)),
            "at {from}: {dither}, {own}, {pop}"
        );
    }
    assert!(pops > 0, "there is nothing to hide");
}
