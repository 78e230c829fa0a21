//! Variants with a parameter block: the compute entry point against the evaluator, and their pictures.

use super::moved;
use super::pictures::{Apart, ROUNDED, drawn, open, pipeline};
use lodc::compile::normal_form;
use lodc::eval::machine::Resource;
use lodc::eval::parameters::ParameterStage;
use lodc::front::Source;
use lodc::gpu::{Gpu, Renderer, Stages};
use lodc::scene::Scene;
use lodc_passes::to_parameter::ToParameter;
use lodc_passes::{Facts, Pass, Shader};
use naga::TypeInner;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// What a variant with parameters is drawn with, in a scene with a light that moves.
const LIT: &str = "
    struct Light { direction: vec3f, strength: f32 }
    @group(0) @binding(0) var<uniform> light: Light;
    @group(0) @binding(1) var<uniform> camera: mat4x4f;
    struct Surface { @builtin(position) clip: vec4f, @location(0) normal: vec3f, @location(1) uv: vec2f }
    @vertex fn vs_main(@location(0) position: vec3f, @location(1) normal: vec3f, @location(2) uv: vec2f) -> Surface {
        return Surface(camera * vec4f(position, 1.0), normal, uv);
    }
    @fragment fn fs_main(in: Surface) -> @location(0) vec4f {
        let towards = normalize(light.direction);
        let lambert = max(dot(normalize(in.normal), towards), 0.0);
        let bright = pow(light.strength, 1.5) > 0.5;
        var sum = 0.0;
        for (var i = 0; i < 4; i++) {
            sum += light.strength / f32(i + 2);
        }
        let shine = pow(lambert, exp2(2.0 + 3.0 * light.strength)) * sin(light.strength * 3.0);
        let colour = select(vec3f(0.5), vec3f(0.9, 0.8, 0.7), bright) * in.uv.x;
        return vec4f(colour * (lambert + 0.1 * sum) + shine, 1.0);
    }";

const LIT_SCENE: &str = "object = \"sphere\"
    resolution = [64, 64]
    [uniforms]
    \"camera\" = \"model-view-projection\"
    \"light.strength\" = { samples = [0.25, 0.9] }
    \"light.direction\" = { from = [-0.9, 0.2, 0.6], to = [0.9, 0.3, 0.6], count = 3 }";

/// How far a parameter of a device may be from the evaluator's, in units in the last place: of `pow`, `exp2`, `sin`
/// and `normalize`, whose precision WGSL leaves open within some.
const ULPS: u32 = 16;

/// As a host has them.
mod functions {
    include!("../../testdata/parameters/functions.lod.rs");
}
mod lights {
    include!("../../testdata/parameters/lights.lod.rs");
}

/// The parameters of a fixture that the compute entry point stores, for buffers with these words.
fn stored(gpu: &Gpu, name: &str, scene: &str, draws: &[Vec<Vec<u32>>]) -> (Shader, Vec<Vec<u32>>) {
    let path = format!(
        "{}/testdata/parameters/{name}.wgsl",
        env!("CARGO_MANIFEST_DIR")
    );
    let (shader, _) = moved::with_parameters(Path::new(&path));
    let source = Source::read(Path::new(&path)).unwrap_or_else(|e| panic!("{e}"));
    let scene = Scene::resolve(&source, Some((Path::new("fixture.toml"), scene)));
    let scene = scene.unwrap_or_else(|e| panic!("{e}"));
    let mut frame = scene.frames(scene.nearest).remove(0);
    let blocks = draws.iter().map(|buffers| {
        for (at, words) in (0..).zip(buffers) {
            let buffer = Resource::Buffer(Arc::new(moved::bytes(words)));
            frame.bindings.insert((0, at), buffer);
        }
        lodc::gpu::parameters(gpu, &shader, &frame, 0).unwrap_or_else(|e| panic!("{e}"))
    });
    let blocks = blocks.collect();
    (shader, blocks)
}

/// How far members of the Rust text's block, by what their names begin with, may be from the compute entry point's, in units
/// of 2^-23 of the number, or of 1 below that. Arc sines and cosines of Mesa's are polynomials, right to some 3e-4; beside
/// them stands what a driver does by functions of its own, `refract` and `atan2` among them.
const OF_RUST: [(&str, f64); 3] = [("angles", 4096.0), ("exact ", 2.0), ("", 64.0)];

#[test]
fn parameters_of_the_rust_text_are_those_of_the_compute_entry_point() {
    let Some(gpu) = open("vulkan") else { return };
    let mut chance = moved::Chance(7);
    let mut lit = || {
        let mut lights = chance.words(&format!("ooo{}", "i".repeat(321)));
        lights[3] = 40;
        for light in lights[4..].chunks_mut(8) {
            light[..7].copy_from_slice(&chance.words("ooooooo"));
            light[7] %= 4;
        }
        vec![chance.words(&"o".repeat(20)), lights]
    };
    let draws: Vec<_> = (0..24).map(|_| lit()).collect();
    let (shader, blocks) = stored(
        &gpu,
        "lights",
        "[uniforms]\n\"camera\" = \"zero\"\n\"lights\" = \"zero\"",
        &draws,
    );
    let mut most = BTreeMap::new();
    for (buffers, block) in draws.iter().zip(&blocks) {
        let [camera, lights] = [&buffers[0], &buffers[1]];
        let found = lights::lod_parameters(&moved::of_words(camera), &moved::of_words(lights));
        hold(&shader, &found.to_bytes(), block, "exact ", &mut most);
    }
    let draws: Vec<_> = (0..64)
        .map(|_| vec![chance.words(&"o".repeat(20))])
        .collect();
    let scene = "[uniforms]\n\"given\" = \"zero\"";
    let (shader, blocks) = stored(&gpu, "functions", scene, &draws);
    for (buffers, block) in draws.iter().zip(&blocks) {
        let found = functions::lod_parameters(&moved::of_words(&buffers[0]));
        hold(&shader, &found.to_bytes(), block, "", &mut most);
    }
    println!("units of 2^-23 between the Rust text and the entry point on Vulkan: {most:.1?}");
    for (name, far) in &most {
        let bound = OF_RUST.iter().find(|(of, _)| name.starts_with(of));
        let most = bound.map_or(0.0, |(_, most)| *most);
        assert!(*far <= most, "{name} is {far} units away");
    }
}

/// Adds how far parameters are from a block, for each member.
fn hold(
    shader: &Shader,
    found: &[u8],
    block: &[u32],
    kind: &str,
    most: &mut BTreeMap<String, f64>,
) {
    for member in shader.parameters() {
        let count = match shader.module().types[member.ty].inner {
            TypeInner::Vector { size, .. } => size as usize,
            _ => 1,
        };
        for at in (0..count).map(|component| member.offset as usize / 4 + component) {
            let word = &found.as_chunks::<4>().0[at];
            let [ours, theirs] =
                [u32::from_le_bytes(*word), block[at]].map(|bits| f64::from(f32::from_bits(bits)));
            // Where one is not a number, WGSL leaves open what the other is.
            if !(ours.is_finite() && theirs.is_finite()) {
                continue;
            }
            let far = (ours - theirs).abs() / ours.abs().max(1.0) * f64::from(1 << 23);
            let name = format!("{kind}{}", member.name.as_deref().unwrap_or_default());
            let most = most.entry(name).or_insert(0.0);
            *most = far.max(*most);
        }
    }
}

#[test]
fn parameters_of_the_compute_entry_point_are_the_evaluators_and_are_drawn_alike() {
    let Some(gpu) = open("vulkan") else { return };
    let source = Source::parse("lit.wgsl", LIT).unwrap_or_else(|e| panic!("{e}"));
    let scene = Scene::resolve(&source, Some((Path::new("lit.toml"), LIT_SCENE)));
    let scene = scene.unwrap_or_else(|e| panic!("{e}"));
    let base = normal_form(&source).unwrap_or_else(|e| panic!("{e}"));
    let mut variant = base.clone();
    for candidate in ToParameter.candidates(&base, &Facts::default()) {
        variant = ToParameter.apply(&variant, &candidate);
    }
    assert!(variant.parameters().len() >= 4);
    let stage = ParameterStage::of(&variant).unwrap_or_else(|r| panic!("{}", r.what));
    let stage = stage.expect("it has parameters");
    let mut renderer = Renderer::new(&gpu);
    let stages = |shader| Stages::of_shader(shader, &scene).expect("it has both stages");
    let pipelines = [&base, &variant].map(|shader| pipeline(&renderer, stages(shader), &scene));
    let mut forms = Apart::default();
    let mut most = 0;
    for mut frame in scene.frames(scene.nearest) {
        let (blocks, _) = stage.blocks(&frame.bindings, 1);
        let stored = lodc::gpu::parameters(&gpu, &variant, &frame, 0);
        let stored = stored.unwrap_or_else(|e| panic!("{e}"));
        let words = blocks[0].as_chunks::<4>().0.iter();
        let words = words.map(|word| u32::from_le_bytes(*word));
        for (ours, theirs) in words.zip(stored) {
            most = most.max(ours.abs_diff(theirs));
        }
        let plain = drawn(&mut renderer, &pipelines[0], &scene, &frame);
        stage.bind(&mut frame.bindings, 1);
        let moved = drawn(&mut renderer, &pipelines[1], &scene, &frame);
        forms.add(&scene, &moved, &plain);
    }
    println!("parameters on Vulkan are within {most} units in the last place");
    assert!(most <= ULPS, "{most} units in the last place");
    let wrong = forms.judge("a variant with parameters", ROUNDED);
    assert!(wrong.is_none(), "{wrong:?}");
}
