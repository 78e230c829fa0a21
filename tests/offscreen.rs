//! `examples/offscreen`, which draws materials from their locks as an engine does: its pictures are those of the evaluator, and far
//! ones are of cheaper levels.
//!
//! Without an adapter it is skipped, aloud; where `CI` is set that is a failure.
#![cfg(feature = "gpu")]

#[path = "../examples/offscreen/main.rs"]
#[allow(dead_code, reason = "the test calls what `main` calls")]
mod offscreen;
#[path = "pictures/mod.rs"]
mod pictures;

use lodc::eval::image::{Space, read_png};
use lodc::front::Source;
use lodc::gpu::Stages;
use lodc::scene::{Draw, Scene};
use offscreen::Shot;
use pictures::{evaluated, open, programs, shown};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// The mean difference between a picture of 8 bits, of textures of half precision, and the evaluator's.
const ALIKE: f64 = 3e-3;

fn root(file: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(file)
}

/// The pictures of a material; `None` where there is no adapter.
fn drawn(name: &str, shader: &str, lock: Option<&str>) -> Option<Vec<Shot>> {
    open("vulkan")?;
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("offscreen");
    let lock = lock.map(root);
    let shots = offscreen::run(&root(shader), lock.as_deref(), &folder.join(name));
    Some(shots.unwrap_or_else(|error| panic!("{error}")))
}

/// How far a picture is from the evaluator's of the author's shader, in the mean over the pixels that both draw.
fn from_evaluated(shader: &str, shot: &Shot) -> f64 {
    let source = Source::read(&root(shader)).unwrap_or_else(|error| panic!("{error}"));
    let scene = Scene::read(&source, None).unwrap_or_else(|error| panic!("{error}"));
    let stages = Stages::of_source(&source, &scene).expect("it has a vertex stage");
    let frame = scene.frame(scene.views[0], shot.distance, Draw::Listed(0));
    let picture = evaluated(&programs(stages), &scene, &frame);
    let read = read_png(&shot.file, Space::Linear).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((read.width, read.height), (picture.width, picture.height));
    let (mut sum, mut count) = (0.0, 0);
    for (at, drawn) in read.texels.iter().enumerate() {
        if picture.covered[at] == 0.0 || drawn[3] == 0.0 {
            continue;
        }
        let [wanted, _] = shown(&scene, picture.pixels[at]);
        for (a, b) in drawn.iter().zip(wanted) {
            sum += f64::from((a - b).abs());
            count += 1;
        }
    }
    assert!(count > 100, "{} shows nothing", shot.file.display());
    sum / f64::from(count)
}

#[test]
fn levels_change_with_the_distance_and_the_nearest_is_the_original() {
    for (name, shader, lock, count) in [
        ("wall", "tests/sample/shaders/wall.wgsl", None, 3),
        (
            "clay",
            "testdata/materials/clay.wgsl",
            Some("testdata/emitted/clay.lod.toml"),
            4,
        ),
    ] {
        let Some(shots) = drawn(name, shader, lock) else {
            return;
        };
        assert_eq!(shots.len(), 10);
        shots.iter().for_each(|shot| println!("{name}: {shot}"));
        let levels: Vec<usize> = shots.iter().map(|shot| shot.level).collect();
        assert!(levels.is_sorted(), "{name}: {levels:?}");
        let all: BTreeSet<usize> = levels.into_iter().collect();
        assert_eq!(all, (0..count).collect(), "{name}");
        for shot in &shots {
            let [error, floor] = shot.error;
            let file = shot.file.display();
            match shot.level {
                0 => assert_eq!(shot.apart, 0.0, "{file}"),
                // Neither is farther from many samples a pixel than was measured, so that they are not farther apart than both.
                _ => assert!(
                    shot.apart > 0.0 && shot.apart <= error + floor,
                    "{file}: {} of {error} and {floor}",
                    shot.apart
                ),
            }
        }
        let apart = from_evaluated(shader, &shots[0]);
        println!("{name}: {apart:.5} from the evaluator's");
        assert!(apart < ALIKE, "{name}: {apart}");
    }
}
