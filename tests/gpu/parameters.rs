//! Variants with a parameter block: the compute entry point against the evaluator, and their pictures.

use super::pictures::{Apart, ROUNDED, drawn, open, pipeline};
use lodc::compile::normal_form;
use lodc::eval::parameters::ParameterStage;
use lodc::front::Source;
use lodc::gpu::{Renderer, Stages};
use lodc::scene::Scene;
use lodc_passes::to_parameter::ToParameter;
use lodc_passes::{Facts, Pass};
use std::path::Path;

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
