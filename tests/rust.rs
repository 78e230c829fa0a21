//! The parameter stage as Rust: compiled here as lodc wrote it, and held against the evaluator on many uniforms.
//!
//! What is only added, multiplied, divided, compared and rooted is equal to the bit, and so is everything about integers.
//! Functions that `libm` and the evaluator each approximate are within the units in the last place that stand here.
#![deny(warnings)]

mod moved;

use lodc::compile::normal_form;
use lodc::eval::machine::{Bindings, Resource};
use lodc::eval::parameters::ParameterStage;
use lodc::front::Source;
use lodc_passes::to_parameter::ToParameter;
use lodc_passes::{Facts, Pass, Shader};
use moved::{Chance, apart, bytes, of_words};
use naga::TypeInner;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// As a host has it: in a module of its own.
mod functions {
    include!("../testdata/parameters/functions.lod.rs");
}
mod integers {
    include!("../testdata/parameters/integers.lod.rs");
}
mod lights {
    include!("../testdata/parameters/lights.lod.rs");
}
mod loops {
    include!("../testdata/parameters/loops.lod.rs");
}
mod matrices {
    include!("../testdata/parameters/matrices.lod.rs");
}

/// Uniforms that each fixture is run with.
const RUNS: usize = 4000;

fn path(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata/parameters");
    folder.join(name).with_extension("wgsl")
}

/// A fixture, and what the evaluator makes of its parameters.
struct Fixture {
    shader: Shader,
    stage: ParameterStage,
}

impl Fixture {
    fn new(name: &str) -> Self {
        Self::of(moved::with_parameters(&path(name)).0)
    }

    fn of(shader: Shader) -> Self {
        let stage = ParameterStage::of(&shader).unwrap_or_else(|r| panic!("{}", r.what));
        let stage = stage.expect("it has parameters");
        Self { shader, stage }
    }

    /// What the evaluator fills the block with.
    fn block(&self, buffers: &[&[u32]]) -> Vec<u8> {
        let mut bindings = Bindings::default();
        for (at, words) in (0..).zip(buffers) {
            bindings.insert((0, at), Resource::Buffer(Arc::new(bytes(words))));
        }
        self.stage.blocks(&bindings, 1).0.swap_remove(0)
    }

    /// Holds parameters against the evaluator's for buffers with these words, at bindings from 0 on. `within` says how many
    /// units in the last place a member may be away from the evaluator's float, if that is a question. Returns how many
    /// each is.
    fn hold(
        &self,
        buffers: &[&[u32]],
        found: &[u8],
        within: impl Fn(&str, f32) -> Option<u32>,
    ) -> BTreeMap<String, u32> {
        let mut seen: BTreeMap<String, u32> = BTreeMap::new();
        let block = self.block(buffers);
        for member in self.shader.parameters() {
            let name = member.name.as_deref().unwrap_or_default();
            let (count, is_float) = match self.shader.module().types[member.ty].inner {
                TypeInner::Vector { size, scalar } => {
                    (size as usize, scalar.kind == naga::ScalarKind::Float)
                }
                TypeInner::Scalar(scalar) => (1, scalar.kind == naga::ScalarKind::Float),
                ref other => panic!("{name} is {other:?}"),
            };
            for component in 0..count {
                let at = member.offset as usize + 4 * component;
                let word = |bytes: &[u8]| {
                    u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
                };
                let [found, wanted] = [found, &block].map(word);
                let [a, b] = [found, wanted].map(f32::from_bits);
                let far = match is_float {
                    true => apart(found, wanted),
                    false => found.abs_diff(wanted),
                };
                let Some(most) = within(name, b) else {
                    continue;
                };
                assert!(
                    far <= most,
                    "{name}[{component}] is {a:e}, and by the evaluator {b:e}: {far} units of {most}\n{buffers:x?}"
                );
                let all = seen.entry(name.to_owned()).or_default();
                *all = far.max(*all);
            }
        }
        seen
    }
}

fn exact(_: &str, _: f32) -> Option<u32> {
    Some(0)
}

#[test]
fn a_sum_over_lights_is_the_evaluators() {
    let fixture = Fixture::new("lights");
    let mut chance = Chance(1);
    for _ in 0..RUNS {
        let camera = chance.words(&"f".repeat(20));
        let lights = chance.words(&format!("fffi{}", "fffffffi".repeat(40)));
        let found = lights::lod_parameters(&of_words(&camera), &of_words(&lights));
        fixture.hold(&[&camera, &lights], &found.to_bytes(), exact);
    }
}

#[test]
fn sums_of_loops_that_were_joined_are_what_each_is_alone() {
    let fixture = Fixture::new("loops");
    let source = Source::read(&path("loops")).unwrap_or_else(|e| panic!("{e}"));
    let base = normal_form(&source).unwrap_or_else(|e| panic!("{e}"));
    let alone = ToParameter.candidates(&base, &Facts::default());
    let alone: Vec<Fixture> = alone
        .iter()
        .map(|candidate| Fixture::of(ToParameter.apply(&base, candidate)))
        .collect();
    let mut chance = Chance(5);
    let mut held = 0;
    for _ in 0..RUNS {
        let given = chance.words(&format!("{}iiif", "f".repeat(32)));
        let found = loops::lod_parameters(&of_words(&given));
        fixture.hold(&[&given], &found.to_bytes(), exact);
        let joined = fixture.block(&[&given]);
        for one in &alone {
            let block = one.block(&[&given]);
            for member in one.shader.parameters() {
                let mut others = fixture.shader.parameters().iter();
                let other = others.find(|other| other.name == member.name);
                let other = other.expect("all are moved").offset as usize;
                let ty = &one.shader.module().types[member.ty].inner;
                let size = ty.size(one.shader.module().to_ctx()) as usize;
                let at = member.offset as usize;
                assert_eq!(
                    block[at..at + size],
                    joined[other..other + size],
                    "{:?}\n{given:x?}",
                    member.name
                );
                held += 1;
            }
        }
    }
    assert_eq!(held, 8 * RUNS);
}

#[test]
fn matrices_and_lists_are_the_evaluators() {
    let fixture = Fixture::new("matrices");
    let mut chance = Chance(2);
    for run in 0..RUNS {
        let object = chance.words(&"f".repeat(68));
        let pose = chance.words(&format!("i{}", "f".repeat(19)));
        let bones = chance.words(&"f".repeat(16 * (1 + run % 3)));
        let weights = chance.words(&"f".repeat(1 + run % 7));
        let all: Vec<matrices::Bone> = bones.chunks(16).map(of_words).collect();
        let given: Vec<f32> = weights.iter().copied().map(f32::from_bits).collect();
        let found = matrices::lod_parameters(&of_words(&object), &of_words(&pose), &all, &given);
        let pose: Vec<u32> = pose.into_iter().chain(bones).collect();
        fixture.hold(&[&object, &pose, &weights], &found.to_bytes(), exact);
    }
}

#[test]
fn integers_and_bits_are_the_evaluators() {
    let fixture = Fixture::new("integers");
    let mut chance = Chance(3);
    for _ in 0..RUNS {
        let given = chance.words(&format!("{}{}", "i".repeat(16), "f".repeat(8)));
        let found = integers::lod_parameters(&of_words(&given));
        fixture.hold(&[&given], &found.to_bytes(), exact);
    }
}

#[test]
fn functions_of_floats_are_within_few_units_of_the_evaluators() {
    let fixture = Fixture::new("functions");
    let mut chance = Chance(4);
    for _ in 0..RUNS {
        let given = chance.words(&"f".repeat(20));
        let found = functions::lod_parameters(&of_words(&given));
        fixture.hold(&[&given], &found.to_bytes(), |name, _| {
            (name.starts_with("exact")).then_some(0)
        });
    }
    let mut most: BTreeMap<String, u32> = BTreeMap::new();
    for _ in 0..RUNS {
        let given = chance.words(&"a".repeat(20));
        let found = functions::lod_parameters(&of_words(&given));
        let seen = fixture.hold(&[&given], &found.to_bytes(), |name, wanted| {
            Some(match name {
                "hyperbolas" | "areas" => 0,
                "powers" | "logarithms" | "turns" => 3,
                "slopes" | "angles" | "quadrants" => 6,
                // The logarithm's error grows with the exponent.
                "raised" => 4 + 4 * wanted.abs().log2().abs().min(150.0) as u32,
                _ => 0,
            })
        });
        for (name, far) in seen {
            let most = most.entry(name).or_default();
            *most = far.max(*most);
        }
    }
    println!("units in the last place from the evaluator: {most:?}");
}
