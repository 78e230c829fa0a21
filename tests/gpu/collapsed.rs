//! Textures that are made for levels, sampled by both renderers: one fixture for each way to collapse.

use super::pictures::{Apart, FILTERED, Tolerance, drawn, evaluated, open, pipeline, programs};
use super::{INTERFACES, read, written};
use lodc::compile::normal_form;
use lodc::eval::generated::GeneratedTextures;
use lodc::eval::program::Program;
use lodc::eval::programs::Stand;
use lodc::gpu::{Gpu, Renderer, Stages};
use lodc::scene::Scene;
use lodc::search::{SampleSet, Samples};
use lodc_passes::texture_collapse::TextureCollapse;
use lodc_passes::{Pass, Shader, Stage, recipe};
use std::path::Path;

/// A way to collapse.
struct Fixture {
    name: &'static str,
    /// Declarations of textures.
    declared: &'static str,
    /// What a fragment stage makes of them.
    value: &'static str,
    /// Their lines in the scene, with names of images.
    images: &'static str,
    /// What the choice starts with.
    choice: &'static str,
}

const FIXTURES: [Fixture; 7] = [
    Fixture {
        name: "levels",
        declared: "@group(0) @binding(3) var hide: texture_2d<f32>; @group(0) @binding(4) var grime: texture_2d<f32>;",
        value: "textureSample(hide, smooth_sampler, in.uv) * textureSample(grime, smooth_sampler, in.uv)",
        images: "hide = \"hide_albedo\"\ngrime = \"grime\"",
        choice: "levels ",
    },
    Fixture {
        name: "resampled",
        declared: "@group(0) @binding(3) var hide: texture_2d<f32>; @group(0) @binding(4) var grime: texture_2d<f32>;",
        value: "textureSample(hide, smooth_sampler, in.uv) * textureSample(grime, smooth_sampler, vec2f(-in.uv.y, in.uv.x) * 3.0 + 0.25)",
        images: "hide = \"hide_albedo\"\ngrime = \"grime\"",
        choice: "resampled ",
    },
    Fixture {
        name: "period",
        declared: "@group(0) @binding(3) var hide: texture_2d<f32>; @group(0) @binding(4) var grime: texture_2d<f32>;",
        value: "textureSample(hide, smooth_sampler, 2.0 * in.uv) * textureSample(grime, smooth_sampler, 3.0 * in.uv)",
        images: "hide = \"hide_albedo\"\ngrime = \"grime\"",
        choice: "resampled ",
    },
    Fixture {
        name: "cube",
        declared: "@group(0) @binding(3) var sky: texture_cube<f32>;",
        value: "sqrt(textureSample(sky, smooth_sampler, normalize(in.normal)))",
        images: "sky = { faces = [\"studio_px\", \"studio_nx\", \"studio_py\", \"studio_ny\", \"studio_pz\", \"studio_nz\"] }",
        choice: "levels ",
    },
    Fixture {
        name: "array",
        declared: "@group(0) @binding(3) var tiles: texture_2d_array<f32>; @group(0) @binding(4) var shades: texture_2d_array<f32>;",
        value: "textureSample(tiles, smooth_sampler, in.uv, u32(3.0 * in.uv.y)) * textureSample(shades, smooth_sampler, in.uv, u32(3.0 * in.uv.y))",
        images: "tiles = { layers = [\"hide_albedo\", \"cliff_albedo\", \"grass_albedo\"] }\nshades = { layers = [\"grime\", \"rock_albedo\", \"panel_albedo\"] }",
        choice: "levels ",
    },
    Fixture {
        name: "layer",
        declared: "@group(0) @binding(3) var tiles: texture_2d_array<f32>;",
        value: "textureSample(tiles, smooth_sampler, in.uv, 2) * textureSample(tiles, smooth_sampler, in.uv, 1)",
        images: "tiles = { layers = [\"hide_albedo\", \"cliff_albedo\", \"grass_albedo\"] }",
        choice: "levels ",
    },
    Fixture {
        name: "bake",
        declared: "@group(0) @binding(3) var grime: texture_2d<f32>;
         fn waves(p: vec2f) -> f32 {
             var sum = 0.0;
             for (var i = 1; i < 6; i++) { sum += sin(p.x * 7.0 * f32(i)) * cos(p.y * 9.0 * f32(i)) / f32(i); }
             return sum;
         }",
        value: "vec4f(0.5 + 0.2 * waves(in.uv + 0.1 * waves(in.uv.yx)), pow(in.uv, vec2f(1.7)), 1.0) * textureSample(grime, smooth_sampler, in.uv)",
        images: "grime = \"grime\"",
        choice: "bake ",
    },
];

#[test]
fn textures_that_are_made_are_sampled_as_the_evaluator_samples_them() {
    let textures = Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata/materials/textures");
    let mut wrong = Vec::new();
    for Fixture {
        name,
        declared,
        value,
        images,
        choice,
    } in FIXTURES
    {
        let text = format!(
            "@group(0) @binding(0) var<uniform> camera: mat4x4f;
             @group(0) @binding(1) var<uniform> model: mat4x4f;
             @group(0) @binding(2) var smooth_sampler: sampler;
             {declared}
             struct Surface {{ @builtin(position) clip: vec4f, @location(0) normal: vec3f, @location(1) uv: vec2f }}
             @vertex fn vs(@location(0) position: vec3f, @location(1) normal: vec3f, @location(2) uv: vec2f) -> Surface {{
                 return Surface(camera * model * vec4f(position, 1.0), (model * vec4f(normal, 0.0)).xyz, uv);
             }}
             @fragment fn fs(in: Surface) -> @location(0) vec4f {{
                 let made = {value};
                 return vec4f(made.rgb * (0.6 + 0.4 * in.normal.y), 1.0);
             }}"
        );
        let images = images.split('"').enumerate().map(|(i, part)| match i % 2 {
            0 => part.to_owned(),
            _ => format!("{:?}", textures.join(part).with_extension("png")),
        });
        let images: String = images.collect();
        let scene = format!(
            "object = \"sphere\"\nlevels = 3\nviews = {{ count = 1 }}\n[distance]\nnearest = 2.5\nfarthest = 10.0
             [uniforms]\ncamera = \"view-projection\"\nmodel = \"model\"\n[textures]\n{images}\n"
        );
        let subject = written(&format!("collapsed-{name}"), &text, &scene);
        let (source, mut scene) = read(&subject.shader);
        scene.resolution = [64, 64];
        let base = normal_form(&source).unwrap_or_else(|e| panic!("{e}"));
        let vertex = base.index(Stage::Vertex).expect("it has one");
        let vertex = Program::compile(base.module(), vertex, &[]).expect("it runs");
        let stand = Stand {
            base: &base,
            vertex: &vertex,
            scene: &scene,
        };
        let set = SampleSet::new(&stand, scene.nearest, Samples::Search).expect("it runs");
        let offered = TextureCollapse.candidates(&base, &set.facts(&base));
        let candidate = offered.iter().find(|c| c.choice.starts_with(choice));
        let candidate = candidate.unwrap_or_else(|| panic!("{name}: {offered:?}"));
        let variant = recipe::apply(&base, candidate).expect("it was offered");
        assert_eq!(variant.generated().len(), 1, "{name}");
        for interface in INTERFACES {
            let Some(gpu) = open(interface) else { continue };
            let name = format!("{interface} {name}");
            wrong.extend(judge(&gpu, &name, (&base, &variant), &scene));
        }
    }
    assert!(wrong.is_empty(), "too far apart:\n{}", wrong.join("\n"));
}

/// What is wrong with a variant as a GPU draws it, and with the picture itself.
fn judge(gpu: &Gpu, name: &str, (base, variant): (&Shader, &Shader), scene: &Scene) -> Vec<String> {
    let mut renderer = Renderer::new(gpu);
    let [original, stages] =
        [base, variant].map(|shader| Stages::of_shader(shader, scene).expect("it has both stages"));
    let pipeline = pipeline(&renderer, stages, scene);
    let generated = GeneratedTextures::of(variant).expect("it runs");
    let (mut apart, mut changed) = (Apart::default(), Apart::default());
    for distance in &scene.distances {
        let mut frame = scene.frames(*distance).swap_remove(0);
        generated.bind(&mut frame.bindings, &frame.baked);
        let by_evaluator = evaluated(&programs(stages), scene, &frame);
        apart.add(
            scene,
            &drawn(&mut renderer, &pipeline, scene, &frame),
            &by_evaluator,
        );
        changed.add(
            scene,
            &evaluated(&programs(original), scene, &frame),
            &by_evaluator,
        );
    }
    let changes = changed.judge(&format!("{name}, from the original"), CHANGED);
    apart
        .judge(name, FILTERED)
        .into_iter()
        .chain(changes)
        .collect()
}

/// How far a level may be from the original, which aliases: another texture would be further.
const CHANGED: Tolerance = Tolerance {
    mean: 0.02,
    most: 0.5,
    jumps: false,
};
