//! The stages of the main job on `testdata/materials/pbr.wgsl`: normal form, whole search, lock to emitted shader.

use criterion::Criterion;
use lodc::compile::{self, Request, normal_form};
use lodc::emit::write_atomically;
use lodc::front::Source;
use std::path::Path;
use std::time::{Duration, Instant};

fn main() {
    let shader = Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata/materials/pbr.wgsl");
    let mut criterion = Criterion::default()
        .measurement_time(Duration::from_secs(2))
        .warm_up_time(Duration::from_millis(500))
        .configure_from_args();

    let source = Source::read(&shader).expect("the material is there");
    criterion.bench_function("normalise pbr.wgsl", |b| {
        b.iter(|| normal_form(&source).expect("it has a normal form"));
    });

    // A search takes seconds: once is enough, and its lock is what is replayed.
    let request = Request {
        shader,
        output: Some(std::env::temp_dir().join("lodc-bench/pbr.lod.wgsl")),
        ..Request::default()
    };
    let began = Instant::now();
    let compiled = compile::compile(&request, &|_| {}).expect("it compiles");
    println!(
        "search pbr.wgsl         {:.1} s, {} variants",
        began.elapsed().as_secs_f64(),
        compiled.report.variants
    );
    write_atomically(&compiled.files).expect("the temporary folder can be written");

    criterion.bench_function("lock to emitted shader, pbr.wgsl", |b| {
        b.iter(|| compile::locked(&request).expect("the lock replays"));
    });
}
