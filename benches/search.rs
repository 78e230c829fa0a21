//! How many variants of `testdata/materials/pbr.wgsl` a search judges in a second, on all cores.
//!
//! An element is one variant at one distance: a candidate applied to the original, compiled, drawn on the search set and
//! compared with the reference, as each step of a descent does with every candidate.

use criterion::{Criterion, Throughput};
use lodc::compile::normal_form;
use lodc::eval::program::Program;
use lodc::eval::programs::Stand;
use lodc::front::Source;
use lodc::scene::Scene;
use lodc::search::{SampleSet, Samples, try_each};
use lodc_passes::{Stage, recipe};
use std::path::Path;
use std::time::Duration;

fn main() {
    let mut criterion = Criterion::default()
        .sample_size(10)
        .measurement_time(Duration::from_secs(10))
        .warm_up_time(Duration::from_secs(1))
        .configure_from_args();
    let shader = Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata/materials/pbr.wgsl");
    let source = Source::read(&shader).expect("the material is there");
    let scene = Scene::read(&source, None).expect("its scene is beside it");
    let base = normal_form(&source).expect("it has a normal form");
    let vertex = base.index(Stage::Vertex).expect("it has a vertex stage");
    let vertex = Program::compile(base.module(), vertex, &[]).expect("the evaluator runs it");
    let stand = Stand {
        base: &base,
        vertex: &vertex,
        scene: &scene,
    };
    let mut group = criterion.benchmark_group("variants of pbr.wgsl");
    for distance in [scene.nearest, 10.0, scene.farthest] {
        let set = SampleSet::new(&stand, distance, Samples::Search).expect("it runs");
        let candidates = recipe::candidates(&base, &set.facts(&base));
        group.throughput(Throughput::Elements(candidates.len() as u64));
        group.bench_function(format!("at distance {distance}"), |b| {
            b.iter(|| try_each(&set, &base, &candidates));
        });
    }
    group.finish();
}
