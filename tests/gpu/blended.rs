//! Blended draws in every way, against the evaluator.

use super::pictures::{Apart, ROUNDED, drawn, evaluated, open, pipeline, programs};
use super::{INTERFACES, read, written};
use lodc::eval::draw::{Blend, DrawState};
use lodc::eval::raster::Frame;
use lodc::gpu::{Renderer, Stages};
use lodc::scene::mesh::{Draw, Mesh};
use std::sync::Arc;

/// Spheres that cut each other, drawn in every way: two of them are the same, one hides a part of the others, and of one
/// only the front is seen.
fn spheres(sphere: &Mesh) -> (Mesh, Vec<DrawState>) {
    let draws = [
        ([0.0, 0.0], 0.5, Blend::Opaque),
        ([0.4, 0.0], 0.8, Blend::Alpha),
        ([-0.4, 0.2], 0.9, Blend::Additive),
        ([0.0, 0.5], 0.7, Blend::Premultiplied),
        ([0.4, 0.0], 0.8, Blend::Alpha),
    ];
    let mut mesh = Mesh::default();
    let mut states = Vec::new();
    for ([x, y], size, blend) in draws {
        let first = (mesh.positions.len(), mesh.indices.len() / 3);
        let moved = |[a, b, c]: &[f32; 3]| [size * a + x, size * b + y, size * c];
        mesh.positions.extend(sphere.positions.iter().map(moved));
        mesh.normals.extend(&sphere.normals);
        mesh.uvs.extend(&sphere.uvs);
        let own = sphere.indices.iter().map(|i| i + first.0 as u32);
        mesh.indices.extend(own);
        mesh.draws.push(Draw {
            vertices: first.0..mesh.positions.len(),
            triangles: first.1..mesh.indices.len() / 3,
        });
        states.push(DrawState {
            blend,
            front_only: blend == Blend::Premultiplied,
        });
    }
    (mesh, states)
}

#[test]
fn blended_draws_are_composed_in_the_order_of_the_evaluator() {
    // Colours and alpha beyond 0..1, and none in some places.
    let shade = "
        fn shade(normal: vec3f, uv: vec2f, front: bool) -> vec4f {
            if fract(uv.x * 12.0) < 0.2 { discard; }
            let alpha = 1.3 * fract(uv.y * 5.0) - 0.1;
            return vec4f(select(normal.zxy, normal, front) * 0.9 + 0.3, alpha);
        }";
    let plain = "
        @fragment fn fs(@location(0) normal: vec3f, @location(1) uv: vec2f, @builtin(front_facing) front: bool)
            -> @location(0) vec4f { return shade(normal, uv, front); }";
    // Depths that many fragments have, 0 among them, and some that are none.
    let deep = "
        struct Out { @location(0) colour: vec4f, @builtin(frag_depth) depth: f32 }
        @fragment fn fs(@location(0) normal: vec3f, @location(1) uv: vec2f, @builtin(front_facing) front: bool) -> Out {
            return Out(shade(normal, uv, front), floor(uv.y * 7.0) / 5.0 - 0.2);
        }";
    let mut wrong = Vec::new();
    for (name, entry) in [("plain", plain), ("deep", deep)] {
        for output in ["display", "encoded", "linear"] {
            let shader = format!("{shade}\n{entry}");
            let text = format!("object = \"sphere\"\noutput = \"{output}\"");
            let subject = written(&format!("blended-{name}-{output}"), &shader, &text);
            let (source, mut scene) = read(&subject.shader);
            scene.resolution = [64, 64];
            let (mesh, states) = spheres(&scene.frames(4.0).swap_remove(0).mesh);
            scene.states = states.into();
            let frame = Frame {
                mesh: Arc::new(mesh),
                grid: 2,
                ..scene.frames(4.0).swap_remove(0)
            };
            let stages = Stages::of_source(&source, &scene).expect("it has both stages");
            let truth = evaluated(&programs(stages), &scene, &frame);
            for gpu in INTERFACES.into_iter().filter_map(open) {
                let mut renderer = Renderer::new(&gpu);
                let pipeline = pipeline(&renderer, stages, &scene);
                let found = drawn(&mut renderer, &pipeline, &scene, &frame);
                let mut apart = Apart::default();
                apart.add(&scene, &found, &truth);
                let what = format!("{} blended, {name}, {output}", gpu.label().backend);
                wrong.extend(apart.judge(&what, ROUNDED));
            }
        }
    }
    assert!(wrong.is_empty(), "too far apart:\n{}", wrong.join("\n"));
}
