//! How long an image-driven simplification takes, and how far it comes: `cargo bench --bench mesh -- [TRIANGLES..]`.
//!
//! A rock of so many triangles (40,000 and 70,000 by default) with `testdata/materials/pbr.wgsl`, five textures, seen where the
//! whole of it is in the picture, down to an excess of 0.05. Beside the meshes on the way stand meshoptimizer's with as many triangles, both on
//! pictures that had no part in it.

#[path = "../examples/models/shapes.rs"]
mod shapes;

use lodc::compile::normal_form;
use lodc::eval::program::Program;
use lodc::front::Source;
use lodc::mesh::{Pictures, Settings, Simplifier, Subject, Triangles, Until, baseline};
use lodc::scene::{Scene, Split};
use std::cell::Cell;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// What the error of a mesh is told by.
const HELD_OUT: usize = 24;

fn main() {
    let numbers = std::env::args().skip(1).filter_map(|a| a.parse().ok());
    let mut wanted: Vec<u32> = numbers.collect();
    if wanted.is_empty() {
        wanted = vec![40_000, 70_000];
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let shader = root.join("testdata/materials/pbr.wgsl");
    let source = Source::read(&shader).expect("it parses");
    let base = normal_form(&source).expect("it is small");
    let [vertex, fragment] =
        [lodc_passes::Stage::Vertex, lodc_passes::Stage::Fragment].map(|stage| {
            let entry = base.index(stage).expect("it has one");
            Program::compile(base.module(), entry, &[]).expect("it runs")
        });
    for triangles in wanted {
        let mut scene = Scene::read(&source, None).expect("it resolves");
        let rock = shapes::shape("rock", triangles).expect("it is one");
        scene.mesh = Arc::new(rock);
        let subject = Subject {
            vertex: &vertex,
            fragment: &fragment,
            scene: &scene,
        };
        let distance = scene.sphere.radius / (scene.fov.to_radians() / 2.0).sin();
        let start = Instant::now();
        let mut simplifier = Simplifier::new(subject, Settings::default());
        let rounds = Cell::new(0);
        let sequence = simplifier.run(distance, Until::Error(0.05), &|_| {
            rounds.set(rounds.get() + 1);
        });
        println!(
            "{} triangles, {} edges in {} rounds, {:.1} s",
            sequence.triangles,
            sequence.steps.len(),
            rounds.get(),
            start.elapsed().as_secs_f64(),
        );
        let judge = Pictures::held_out(subject, distance, Split::Test, HELD_OUT);
        println!(
            "excess of RMSE over the original's own, {:.4}",
            judge.floor().sqrt()
        );
        println!("triangles  pictures  meshopt  with attributes");
        for share in [0.75, 0.5, 0.35, 0.25, 0.175, 0.125] {
            let count = (share * sequence.triangles as f64) as usize;
            let steps = sequence.steps.iter();
            let steps = steps.take_while(|step| step.triangles >= count).count();
            let own = Triangles::left(&sequence.surface(steps), &scene.mesh);
            if own.count() > count + 10 {
                break;
            }
            let [plain, all] =
                [false, true].map(|all| baseline::to_triangles(&scene.mesh, count, all));
            println!(
                "{count:9}  {:8.4}  {:7.4}  {:15.4}",
                judge.excess(&own),
                judge.excess(&plain),
                judge.excess(&all),
            );
        }
    }
}
