//! Levels that work in the vertex stage, in every form of the emitted text: drawn as the variants are.

use super::fixtures::small_materials;
use super::pictures::{Apart, FILTERED, ROUNDED, drawn, evaluated, open, pipeline, programs};
use super::{INTERFACES, read, scratch};
use lodc::compile::normal_form;
use lodc::emit::{EmitLevel, Form, Output, emit};
use lodc::eval::machine::Resource;
use lodc::front::Source;
use lodc::gpu::{Gpu, Renderer, Stages};
use lodc_passes::vertex_motion::VertexMotion;
use lodc_passes::{Facts, Pass};
use std::sync::Arc;

#[test]
fn levels_that_work_in_the_vertex_stage_are_drawn_alike() {
    let adapters: Vec<Gpu> = INTERFACES.into_iter().filter_map(open).collect();
    let (mut wrong, mut seen) = (Vec::new(), 0);
    for path in small_materials(&scratch("vertices"), 64, &[]) {
        if adapters.is_empty() {
            break;
        }
        let (source, scene) = read(&path);
        let base = normal_form(&source).unwrap_or_else(|e| panic!("{e}"));
        let mut shader = base.clone();
        for _ in 0..3 {
            let candidates = VertexMotion.candidates(&shader, &Facts::default());
            if let Some(candidate) = candidates.get(candidates.len() / 2) {
                shader = VertexMotion.apply(&shader, candidate);
            }
        }
        if shader.fingerprint() == base.fingerprint() {
            continue;
        }
        seen += 1;
        let variant = shader.clone();
        let variant = Stages::of_shader(&variant, &scene).expect("it has both stages");
        let level = EmitLevel {
            autolod: 1.0,
            shader,
            distance: scene.nearest,
            error: 0.0,
            cost: 1.0,
            time: None,
            says: "moved".into(),
        };
        let near = scene.frames(scene.distances[0]).swap_remove(0);
        let truth = evaluated(&programs(variant), &scene, &near);
        let name = path.file_stem().unwrap_or_default().display();
        let mut of_gpu = Vec::new();
        for gpu in &adapters {
            let mut renderer = Renderer::new(gpu);
            let pipeline = pipeline(&renderer, variant, &scene);
            let picture = drawn(&mut renderer, &pipeline, &scene, &near);
            let mut apart = Apart::default();
            apart.add(&scene, &picture, &truth);
            let what = format!("{} {name}", gpu.label().backend);
            // OpenGL chooses cubes' levels in a way of its own, which other tests hold.
            if what.starts_with("Vulkan") {
                wrong.extend(apart.judge(&what, FILTERED));
            }
            of_gpu.push((picture, what));
        }
        for form in [Form::Override, Form::Uniform] {
            let output = Output {
                form,
                ..Output::default()
            };
            let files = emit(&source, &base, std::slice::from_ref(&level), output);
            let (file, text) = files.unwrap_or_else(|e| panic!("{e}")).swap_remove(0);
            let text = String::from_utf8(text).expect("WGSL is text");
            let whole = Source::parse(&file.display().to_string(), text);
            let whole = whole.unwrap_or_else(|e| panic!("{e}"));
            let mut near = near.clone();
            let mut globals = whole.module.global_variables.iter();
            let level = globals.find(|(_, g)| g.name.as_deref() == Some("level_of_detail"));
            if let Some(at) = level.and_then(|(_, global)| global.binding) {
                let bytes = [1.0f32, 0.0, 0.0, 0.0].map(f32::to_le_bytes).concat();
                let buffer = Resource::Buffer(Arc::new(bytes));
                near.bindings.insert((at.group, at.binding), buffer);
            }
            let stages = Stages {
                auto_lod: (form == Form::Override).then_some(1.0),
                ..Stages::of_source(&whole, &scene).expect("it has both stages")
            };
            for (gpu, (variant, what)) in adapters.iter().zip(&of_gpu) {
                let mut renderer = Renderer::new(gpu);
                let whole = pipeline(&renderer, stages, &scene);
                let picture = drawn(&mut renderer, &whole, &scene, &near);
                let mut apart = Apart::default();
                apart.add(&scene, &picture, variant);
                wrong.extend(apart.judge(&format!("{what}, by {}", form.name()), ROUNDED));
            }
        }
    }
    assert!(wrong.is_empty(), "too far apart:\n{}", wrong.join("\n"));
    assert!(adapters.is_empty() || seen > 3, "{seen}");
}
