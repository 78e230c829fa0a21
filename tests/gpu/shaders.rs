//! The adversarial shaders, those in GLSL too, and single things that a shader may say, on a GPU.

use super::fixtures::shaders;
use super::pictures::{
    Apart, FILTERED, ROUNDED, Tolerance, drawn, evaluated, open, pipeline, programs,
};
use super::{INTERFACES, read, written};
use lodc::compile::normal_form;
use lodc::eval::raster::Frame;
use lodc::gpu::{Renderer, Stages};

/// What OpenGL's shading language has no words for, by a shader's name: it is refused there, not drawn wrong. Loads of
/// depth textures that are compared too; a texture with several samplers.
const BEYOND_OPENGL: [&str; 3] = ["depth_textures", "texture_arguments", "texture_functions"];

/// How far apart pictures may be of a shader that asks for coarse derivatives, of which WGSL leaves open whose they are:
/// the evaluator takes the first ones of a quad, and Mesa each row's and column's own.
const COARSE: (&str, Tolerance) = (
    "derivatives",
    Tolerance {
        mean: FILTERED.mean,
        most: 0.15,
        jumps: true,
    },
);

fn shaders_are_drawn_alike(interface: &str) {
    let Some(gpu) = open(interface) else { return };
    let (mut wrong, mut refused) = (Vec::new(), Vec::new());
    for path in shaders("testdata/shaders") {
        let (source, mut scene) = read(&path);
        scene.resolution = [40, 40];
        let name = path.file_stem().unwrap_or_default().display().to_string();
        let mut renderer = Renderer::new(&gpu);
        let written = Stages::of_source(&source, &scene).expect("it has both stages");
        let base = normal_form(&source).unwrap_or_else(|e| panic!("{e}"));
        let normal = Stages::of_shader(&base, &scene).expect("it has both stages");
        let by_evaluator = programs(written);
        let own = match renderer.pipeline(written, &scene) {
            Ok(own) => own,
            Err(why) => {
                assert!(!why.notes.is_empty(), "{why}");
                refused.push(name);
                continue;
            }
        };
        let pipelines = [own, pipeline(&renderer, normal, &scene)];
        let frame = Frame {
            offset: [0.1, -0.2],
            ..scene.frames(scene.distances[0]).swap_remove(0)
        };
        let truth = evaluated(&by_evaluator, &scene, &frame);
        let [written, normal] = pipelines
            .each_ref()
            .map(|pipeline| drawn(&mut renderer, pipeline, &scene, &frame));
        let [mut renderers, mut forms] = <[Apart; 2]>::default();
        renderers.add(&scene, &written, &truth);
        forms.add(&scene, &normal, &written);
        let tolerance = match COARSE {
            (coarse, tolerance) if coarse == name => tolerance,
            _ => FILTERED.of(&name),
        };
        let name = format!("{interface} {name}");
        wrong.extend(renderers.judge(&name, tolerance));
        wrong.extend(forms.judge(&format!("{name}, its normal form"), ROUNDED));
    }
    assert!(wrong.is_empty(), "too far apart:\n{}", wrong.join("\n"));
    let beyond: &[&str] = match interface {
        "opengl" => &BEYOND_OPENGL,
        _ => &[],
    };
    assert_eq!(refused, beyond);
}

#[test]
fn vulkan_draws_every_shader_as_the_evaluator_does() {
    shaders_are_drawn_alike("vulkan");
}

#[test]
fn opengl_draws_every_shader_as_the_evaluator_does() {
    shaders_are_drawn_alike("opengl");
}

/// Draws a fragment shader, with `autoLOD` as said, on every adapter; gives the colours of a pixel that it covers.
fn colours(name: &str, shader: &str, auto_lod: Option<f64>) -> Vec<[f32; 4]> {
    let subject = written(name, shader, "object = \"plane\"");
    let (source, scene) = read(&subject.shader);
    let frame = scene.frames(3.0).swap_remove(0);
    let stages = Stages {
        auto_lod,
        ..Stages::of_source(&source, &scene).expect("lodc supplies a vertex stage")
    };
    let colour = |interface| {
        let gpu = open(interface)?;
        let mut renderer = Renderer::new(&gpu);
        let pipeline = pipeline(&renderer, stages, &scene);
        let picture = drawn(&mut renderer, &pipeline, &scene, &frame);
        let covered = picture.covered.iter().position(|c| *c > 0.0);
        Some(picture.pixels[covered.expect("something is drawn")])
    };
    INTERFACES.into_iter().filter_map(colour).collect()
}

#[test]
fn a_varying_that_says_that_it_is_sampled_at_the_centre_links_with_the_supplied_vertex_stage() {
    let shader = "
        @fragment fn fs(
            @location(0) @interpolate(perspective, center) uv: vec2f,
            @location(1) @interpolate(linear, center) normal: vec3f,
            @location(2) @interpolate(perspective, centroid) tangent: vec4f,
        ) -> @location(0) vec4f { return vec4f(1.0 + 0.0 * (uv.x + normal.x + tangent.x)); }";
    for colour in colours("centre", shader, None) {
        assert_eq!(colour, [1.0; 4]);
    }
}

#[test]
fn an_auto_lod_that_is_told_by_a_number_is_set() {
    let shader = "
        @id(7) override autoLOD: f32 = 0.0;
        @fragment fn fs(@location(0) uv: vec2f) -> @location(0) vec4f { return vec4f(autoLOD, 0.0 * uv.x, 0.0, 1.0); }";
    for (auto_lod, red) in [(None, 0.0), (Some(2.5), 2.5)] {
        for colour in colours("numbered", shader, auto_lod) {
            assert_eq!(colour[0], red);
        }
    }
}
