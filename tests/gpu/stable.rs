//! Numerical stability on a GPU: how far single operations are from `f64`, in units in the last place; materials on the inputs
//! of their batteries on which they are stable; and what the traps fail on.

use super::fixtures::{shaders, small_materials};
use super::pictures::{drawn, evaluated, open, pipeline, programs};
use super::{read, scratch, written};
use lodc::compile::normal_form;
use lodc::eval::lane::{LANES, Mask};
use lodc::eval::machine::{Machine, Outcome, Watcher};
use lodc::eval::program::Program;
use lodc::eval::programs::Stand;
use lodc::eval::shadow::Both;
use lodc::gpu::{Feeder, Gpu, Renderer, Stages};
use lodc::scene::Scene;
use lodc::search::{SampleSet, Samples};
use lodc::stability::{Battery, Fed};
use lodc_passes::semantics::Op;
use lodc_passes::{Shader, Stage, all_passes, recipe};
use naga::Module;
use std::collections::BTreeMap;

/// A shader's fragment stage.
fn fragment(shader: &Shader) -> (&Module, usize) {
    let entry = shader.index(Stage::Fragment).expect("it has one");
    (shader.module(), entry)
}

/// What the evaluator and a GPU give for each input; nothing where either discards it.
fn colours(
    (gpu, feeder): (&Gpu, &Feeder),
    (shader, scene): (&Shader, &Scene),
    fed: &Fed,
) -> Vec<Option<[[f32; 4]; 2]>> {
    let frame = feeder.frame(fed);
    let stages = feeder.stages(fragment(shader));
    let mut renderer = Renderer::new(gpu);
    let pipeline = pipeline(&renderer, stages, scene);
    let by_gpu = drawn(&mut renderer, &pipeline, scene, &frame);
    let by_evaluator = evaluated(&programs(stages), scene, &frame);
    let pixels = Feeder::pixels(fed.inputs.len()).map(|at| {
        let both = [&by_evaluator, &by_gpu];
        both.iter()
            .all(|picture| picture.covered[at] > 0.0)
            .then(|| both.map(|picture| picture.pixels[at]))
    });
    pixels.collect()
}

/// How many numbers of `f32` lie between two numbers: of the size of the first, and as a part of one.
fn ulps(truth: f64, given: f32) -> f64 {
    let size = truth.abs().max(f64::from(f32::MIN_POSITIVE));
    let ulp = 2.0_f64.powf(size.log2().floor()) * f64::from(f32::EPSILON);
    (f64::from(given) - truth).abs() / ulp
}

/// Keeps what the last operation gave.
#[derive(Debug)]
struct Last([Both; LANES]);

impl Watcher<Both> for Last {
    fn done(
        &mut self,
        _: Op,
        _: u32,
        _: Option<Mask>,
        _: &[[Both; LANES]],
        outcome: Outcome<'_, Both>,
    ) {
        if let Outcome::Floats(floats) = outcome {
            self.0 = *floats;
        }
    }
}

/// An operation, the ranges of its operands, whether it is measured in units of 1, and the limits of both renderers.
type Operation = (&'static str, [[f32; 2]; 2], bool, [f64; 2]);

/// Operations of two operands, `a` and `b`, with the ranges of both, and how far the evaluator and a GPU may be from `f64`: in
/// units in the last place of the result, or of 1 where that is marked.
const OPERATIONS: [Operation; 20] = [
    ("a + b", [[-9.0, 9.0], [-9.0, 9.0]], false, [0.5, 0.5]),
    ("a - b", [[-9.0, 9.0], [-9.0, 9.0]], false, [0.5, 0.5]),
    ("a * b", [[-9.0, 9.0], [-9.0, 9.0]], false, [0.5, 0.5]),
    ("a / b", [[-9.0, 9.0], [0.01, 9.0]], false, [0.5, 2.5]),
    ("sqrt(a)", [[0.0, 90.0], [0.0, 0.0]], false, [0.5, 2.5]),
    (
        "inverseSqrt(a)",
        [[0.01, 90.0], [0.0, 0.0]],
        false,
        [2.0, 3.0],
    ),
    ("exp(a)", [[-20.0, 20.0], [0.0, 0.0]], false, [2.0, 43.0]),
    ("exp2(a)", [[-30.0, 30.0], [0.0, 0.0]], false, [2.0, 63.0]),
    ("log(a)", [[2.0, 900.0], [0.0, 0.0]], false, [2.0, 3.0]),
    ("log2(a)", [[2.0, 900.0], [0.0, 0.0]], false, [2.0, 3.0]),
    ("log2(a)", [[0.5, 2.0], [0.0, 0.0]], true, [2.0, 4.0]),
    ("pow(a, b)", [[0.01, 9.0], [0.1, 5.0]], false, [16.0, 80.0]),
    ("sin(a)", [[-3.0, 3.0], [0.0, 0.0]], true, [2.0, 4096.0]),
    ("cos(a)", [[-3.0, 3.0], [0.0, 0.0]], true, [2.0, 4096.0]),
    ("tan(a)", [[-1.5, 1.5], [0.0, 0.0]], false, [4.0, 4096.0]),
    ("asin(a)", [[-1.0, 1.0], [0.0, 0.0]], true, [4.0, 4700.0]),
    ("acos(a)", [[-1.0, 1.0], [0.0, 0.0]], true, [4.0, 4700.0]),
    (
        "atan2(a, b)",
        [[0.1, 9.0], [0.1, 9.0]],
        false,
        [4.0, 4096.0],
    ),
    (
        "mix(a, b, 0.3)",
        [[0.0, 9.0], [0.0, 9.0]],
        false,
        [2.0, 2.0],
    ),
    (
        "smoothstep(-10.0, 10.0, a)",
        [[-9.0, 9.0], [0.0, 0.0]],
        false,
        [8.0, 8.0],
    ),
];

#[test]
fn single_operations_are_as_far_from_f64_as_is_said() {
    let Some(gpu) = open("vulkan") else { return };
    let mut wrong = Vec::new();
    println!(
        "operation                    evaluator        GPU, in units in the last place of f64's result"
    );
    for (number, (operation, ranges, of_one, limits)) in OPERATIONS.into_iter().enumerate() {
        let text = format!(
            "@fragment fn fs(@location(0) uv: vec2f) -> @location(0) vec4f {{
                 let a = uv.x;
                 let b = uv.y;
                 return vec4f({operation});
             }}"
        );
        let subject = written(&format!("operation-{number}"), &text, "object = \"plane\"");
        let (source, scene) = read(&subject.shader);
        let shader = normal_form(&source).unwrap_or_else(|e| panic!("{e}"));
        let feeder = Feeder::of(fragment(&shader)).expect("it takes two floats");
        let inputs = (0..4 * LANES).map(|i| {
            let share = [(i % 64) as f32 / 63.0, (i * 37 % 1024) as f32 / 1023.0];
            let number = |c: usize, share: f32| {
                let [low, high] = ranges[c];
                low + (high - low) * share
            };
            BTreeMap::from([(0, vec![number(0, share[1]), number(1, share[0])])])
        });
        let fed = Fed {
            frame: scene.frames(3.0).swap_remove(0),
            inputs: inputs.collect(),
        };
        let colours = colours((&gpu, &feeder), (&shader, &scene), &fed);
        let entry = shader.index(Stage::Fragment).expect("it has one");
        let program = Program::compile(shader.module(), entry, &[]);
        let program = program.unwrap_or_else(|refused| panic!("{}", refused.what));
        let mut worst = [0.0_f64; 2];
        for (block, colours) in colours.chunks(LANES).enumerate() {
            let mut words = vec![[0; LANES]; program.inputs().len()];
            for lane in 0..LANES {
                for (c, words) in words.iter_mut().enumerate() {
                    words[lane] = fed.inputs[block * LANES + lane][&0][c].to_bits();
                }
            }
            let mut last = Last([Both::default(); LANES]);
            let mut outputs = vec![[0; LANES]; program.outputs().len()];
            let bindings = &fed.frame.bindings;
            let mut machine = Machine::<Both>::watched(&program, bindings, 0, Some(&mut last));
            machine.run(&words, Mask::ALL, Mask::ALL, &mut outputs);
            drop(machine);
            for (both, colours) in last.0.iter().zip(colours) {
                let [evaluator, gpu] = colours.expect("nothing is discarded");
                assert_eq!(evaluator[0].to_bits(), both.narrow.to_bits(), "{operation}");
                for (worst, given) in worst.iter_mut().zip([evaluator[0], gpu[0]]) {
                    let off = match of_one {
                        true => (f64::from(given) - both.wide).abs() / f64::from(f32::EPSILON),
                        false => ulps(both.wide, given),
                    };
                    *worst = worst.max(if off.is_nan() { f64::INFINITY } else { off });
                }
            }
        }
        let [evaluator, gpu] = worst;
        let of = if of_one { ", of 1" } else { "" };
        println!("{operation:<28} {evaluator:8.2} {gpu:10.2}{of}");
        if evaluator > limits[0] || gpu > limits[1] {
            wrong.push(format!(
                "{operation}: {worst:?}, and {limits:?} are allowed"
            ));
        }
    }
    assert!(wrong.is_empty(), "too far from f64:\n{}", wrong.join("\n"));
}

/// How many inputs of each group a material is drawn on.
const INPUTS: usize = 16;

/// How far apart the two may be where a material is stable, in units in the last place of a colour's largest channel: half of
/// the inputs, and 9 in 10. The rest is told: the filters of textures, hashes of coordinates of 10^6, and jumps.
const STABLE: [(f64, f64); 2] = [(0.5, 16.0), (0.9, 131_072.0)];

/// The share of inputs on which the GPU may fail where the battery found nothing: what cancels there wholly and here nearly, as
/// a tangent along the normal does.
const CANCELS: f64 = 0.02;

#[test]
fn materials_are_alike_on_inputs_that_no_picture_shows_where_they_are_stable() {
    let Some(gpu) = open("vulkan") else { return };
    let (mut wrong, mut seen) = (Vec::new(), 0);
    for path in small_materials(&scratch("stable"), 64, &[]) {
        let (source, scene) = read(&path);
        let name = path.file_stem().unwrap_or_default().display().to_string();
        let base = normal_form(&source).unwrap_or_else(|e| panic!("{e}"));
        let own = Stages::of_shader(&base, &scene).expect("it has both stages");
        let (vertex, _) = programs(own);
        let stand = Stand {
            base: &base,
            vertex: &vertex,
            scene: &scene,
        };
        let (Some(feeder), None) = (Feeder::of(fragment(&base)), &scene.lighting) else {
            println!("{name}: its inputs cannot be fed");
            continue;
        };
        let battery = Battery::new(&stand).unwrap_or_else(|refused| panic!("{}", refused.what));
        let mut apart = Vec::new();
        let mut fails = 0_u32;
        for fed in battery.sound(INPUTS) {
            if fed.inputs.is_empty() {
                continue;
            }
            let colours = colours((&gpu, &feeder), (&base, &scene), &fed);
            for [evaluator, gpu] in colours.into_iter().flatten() {
                if evaluator.iter().all(|x| x.is_finite()) && gpu.iter().any(|x| !x.is_finite()) {
                    fails += 1;
                    continue;
                }
                let largest = evaluator.iter().fold(0.0_f32, |most, x| most.max(x.abs()));
                let pairs = evaluator.into_iter().zip(gpu);
                let most = pairs
                    .map(|(a, b)| f64::from(a - b).abs())
                    .fold(0.0, f64::max);
                let size = f64::from(largest.max(1e-6));
                apart.push(ulps(size, (size + most) as f32));
            }
        }
        apart.sort_unstable_by(f64::total_cmp);
        let within = |share: f64| apart[((apart.len() - 1) as f64 * share) as usize];
        println!(
            "{name}: {} inputs, half within {:.0}, 9 in 10 within {:.0}, 99 in 100 within {:.0} units in the last place; {fails} fail on the GPU",
            apart.len(),
            within(0.5),
            within(0.9),
            within(0.99)
        );
        seen += 1;
        if f64::from(fails) > CANCELS * apart.len() as f64 {
            wrong.push(format!("{name}: {fails} fail on the GPU"));
        }
        for (share, limit) in STABLE {
            if within(share) > limit {
                wrong.push(format!("{name}: {share} within {}", within(share)));
            }
        }
    }
    assert!(wrong.is_empty(), "apart:\n{}", wrong.join("\n"));
    assert!(seen >= 8, "{seen}");
}

/// What a trap fails on is drawn by the original and by the variant. That the GPU fails there as well is not asked: a failure
/// may take roundings that it does not have. It is told; and the original holds.
#[test]
fn what_traps_fail_on_leaves_originals_finite() {
    let Some(gpu) = open("vulkan") else { return };
    let (mut wrong, mut seen, mut fails) = (Vec::new(), 0, 0);
    for path in shaders("testdata/stability") {
        let name = path.file_stem().unwrap_or_default().display().to_string();
        let source = lodc::front::Source::read(&path).unwrap_or_else(|e| panic!("{e}"));
        let line = source.text.lines().nth(1).unwrap_or_default();
        let Some(steps) = line.strip_prefix("// trap: ") else {
            continue;
        };
        let file = path.with_extension("toml");
        let scene = Scene::read(&source, Some(&*file).filter(|file| file.is_file()));
        let scene = scene.unwrap_or_else(|e| panic!("{e}"));
        let base = normal_form(&source).unwrap_or_else(|e| panic!("{e}"));
        let own = Stages::of_shader(&base, &scene).expect("it has both stages");
        let (vertex, _) = programs(own);
        let stand = Stand {
            base: &base,
            vertex: &vertex,
            scene: &scene,
        };
        let set = SampleSet::new(&stand, scene.nearest, Samples::Search);
        let set = set.unwrap_or_else(|refused| panic!("{}", refused.what));
        let mut made = base.clone();
        for wanted in steps.split(" then ") {
            let facts = set.facts(&made);
            let mut offered = all_passes().flat_map(|pass| pass.candidates(&made, &facts));
            let step = offered.find(|candidate| candidate.to_string().starts_with(wanted));
            let step = step.unwrap_or_else(|| panic!("{name}: `{wanted}` is not offered"));
            made = recipe::apply(&made, &step).expect("it was offered");
        }
        let Some(feeder) = Feeder::of(fragment(&base)) else {
            println!("{name}: its inputs cannot be fed");
            continue;
        };
        if made.handing_over().is_some() {
            println!("{name}: it fails in the vertex stage");
            continue;
        }
        if made.made().next().is_some() {
            println!("{name}: it reads a texture that was made for it");
            continue;
        }
        let battery = Battery::new(&stand).unwrap_or_else(|refused| panic!("{}", refused.what));
        let judged = battery.judge_and_hunt(&made);
        let judged = judged.unwrap_or_else(|refused| panic!("{}", refused.what));
        let Some(failure) = judged.failures.first() else {
            println!("{name}: it fails otherwise");
            continue;
        };
        let fed = battery.fed(failure);
        let colour = |shader: &Shader| colours((&gpu, &feeder), (shader, &scene), &fed)[0];
        let finite = |colour: Option<[[f32; 4]; 2]>| {
            colour.map(|both| both.map(|colour| colour.iter().all(|x| x.is_finite())))
        };
        let [original, variant] = [&base, &made].map(|shader| finite(colour(shader)));
        let word = |finite: Option<[bool; 2]>| match finite {
            None => "discarded".to_owned(),
            Some([evaluator, gpu]) => {
                let word = |finite| if finite { "finite" } else { "not finite" };
                format!("{} and {} on the GPU", word(evaluator), word(gpu))
            }
        };
        println!(
            "{name}: the original is {}, the variant {}",
            word(original),
            word(variant)
        );
        seen += 1;
        fails += usize::from(variant.is_some_and(|[_, gpu]| !gpu));
        if original.is_some_and(|[_, gpu]| !gpu) {
            wrong.push(name);
        }
    }
    println!("{fails} of {seen} traps fail on the GPU too");
    assert!(
        wrong.is_empty(),
        "originals that fail: {}",
        wrong.join(", ")
    );
    assert!(seen >= 8 && fails >= 4, "{fails} of {seen}");
}
