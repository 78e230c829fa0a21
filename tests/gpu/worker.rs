//! The child that draws, and what goes wrong with it.

use super::pictures::{drawn, open, pipeline, programs};
use super::{INTERFACES, bits, read, scratch, written};
use lodc::compile::normal_form;
use lodc::eval::programs::Stand;
use lodc::gpu::worker::{Failure, Subject, Variant, Wanted, Worker};
use lodc::gpu::{Renderer, Stages};
use lodc::stability::Battery;
use std::path::PathBuf;
use std::time::Duration;

pub(crate) fn worker(adapter: &str) -> Worker {
    let program = PathBuf::from(env!("CARGO_BIN_EXE_lodc"));
    let patience = Duration::from_secs(120);
    Worker::new(program, Some(adapter.to_owned()), patience)
}

const WANTED: Wanted = Wanted {
    distance: 4.0,
    frame: 0,
    offset: [0.0; 2],
    grid: 1,
};

const PLAIN: &str =
    "@fragment fn fs(@location(0) uv: vec2f) -> @location(0) vec4f { return vec4f(uv, 0.5, 1.0); }";

#[test]
fn a_child_draws_what_its_parent_would() {
    let Some(gpu) = open("vulkan") else { return };
    let subject = written("child", PLAIN, "");
    let (source, scene) = read(&subject.shader);
    let mut renderer = Renderer::new(&gpu);
    let stages = Stages::of_source(&source, &scene).expect("it has both stages");
    let pipeline = pipeline(&renderer, stages, &scene);
    let frame = scene.frames(4.0).swap_remove(0);
    let own = drawn(&mut renderer, &pipeline, &scene, &frame);
    let mut worker = worker("vulkan");
    let childs = worker
        .picture(&subject, &Variant::default(), WANTED)
        .unwrap_or_else(|failure| panic!("{failure:?}"));
    assert_eq!(bits(&childs), bits(&own));
    // A variant of it, by the same child, and one that is no shader.
    let variant = |text: String| Variant {
        text: Some(text),
        ..Variant::default()
    };
    let blue = variant(PLAIN.replace("0.5", "1.0"));
    let other = worker
        .picture(&subject, &blue, WANTED)
        .expect("it draws on");
    assert!(other.pixels.iter().any(|p| p[2] == 1.0));
    let broken = worker.picture(&subject, &variant("fn".to_owned()), WANTED);
    assert!(matches!(broken, Err(Failure::Refused(_))), "{broken:?}");
    assert!(worker.picture(&subject, &blue, WANTED).is_ok());
}

#[test]
fn a_picture_that_takes_too_long_is_given_up_and_the_next_one_is_drawn() {
    let text = "@fragment fn fs(@location(0) uv: vec2f) -> @location(0) vec4f {
            var x = uv.x;
            loop { x = fract(pow(x + 1.5, 1.7) + sin(x)); if x > 2.0 { break; } }
            return vec4f(x);
        }";
    for interface in INTERFACES {
        if open(interface).is_none() {
            continue;
        }
        let subject = written(&format!("endless-{interface}"), PLAIN, "");
        let mut worker = worker(interface);
        let plain = Variant::default();
        let drawn = worker.picture(&subject, &plain, WANTED);
        assert!(drawn.is_ok(), "{drawn:?}");
        let endless = Variant {
            text: Some(text.to_owned()),
            ..Variant::default()
        };
        // Mesa ends a loop after 65,535 rounds: that takes minutes for as many pixels as these.
        let many = Wanted {
            grid: 128,
            ..WANTED
        };
        worker.set_patience(Duration::from_secs(2));
        let failed = worker.picture(&subject, &endless, many);
        assert!(matches!(failed, Err(Failure::Hung(_))), "{interface}");
        worker.set_patience(Duration::from_secs(120));
        let drawn = worker.picture(&subject, &plain, WANTED);
        assert!(drawn.is_ok(), "{drawn:?}");
    }
}

#[test]
fn what_cannot_be_drawn_is_said_with_a_way_out() {
    let subject = written("refused", PLAIN, "");
    let refused = |adapter: &str, subject: &Subject, wanted: Wanted| {
        let failed = worker(adapter).picture(subject, &Variant::default(), wanted);
        let Err(Failure::Refused(error)) = failed else {
            panic!("{failed:?}");
        };
        assert!(!error.notes.is_empty(), "{error}");
        error.to_string()
    };
    let error = refused("Voodoo 2", &subject, WANTED);
    assert!(error.contains("Voodoo 2") || error.contains("there is no GPU"));
    if open("vulkan").is_none() {
        return;
    }
    // More buffers than any stage may have.
    let names: Vec<String> = (0..300).map(|i| format!("part{i}x")).collect();
    let declared: Vec<String> = (0..)
        .zip(&names)
        .map(|(i, n)| format!("@group(0) @binding({i}) var<uniform> {n}: vec4f;"))
        .collect();
    let many = format!(
        "{}\n@fragment fn fs(@location(0) uv: vec2f) -> @location(0) vec4f {{ return {}; }}",
        declared.join("\n"),
        names.join(" + ")
    );
    let values: Vec<String> = names
        .iter()
        .map(|n| format!("{n} = [1, 1, 1, 1]"))
        .collect();
    let many = written("many", &many, &format!("[uniforms]\n{}", values.join("\n")));
    for interface in INTERFACES {
        let error = refused(interface, &many, WANTED);
        assert!(error.contains("compiling the shader"), "{error}");
    }
    // A picture that is larger than any texture.
    let huge = Wanted {
        grid: 4096,
        ..WANTED
    };
    let blended = written("huge", PLAIN, "blend = \"alpha\"");
    for subject in [&subject, &blended] {
        for interface in INTERFACES {
            let error = refused(interface, subject, huge);
            assert!(error.contains("drawing"), "{error}");
        }
    }
}

/// lodc with so little memory that a large picture does not fit.
#[cfg(unix)]
fn short_of_memory() -> PathBuf {
    use std::os::unix::fs::PermissionsExt;
    let path = scratch("memory").with_extension("sh");
    let text = format!(
        "#!/bin/sh\nulimit -v 3000000\nexec '{}' \"$@\"\n",
        env!("CARGO_BIN_EXE_lodc")
    );
    std::fs::write(&path, text).expect("the target folder can be written");
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).expect("it is there");
    path
}

#[cfg(unix)]
#[test]
fn a_picture_that_no_memory_is_left_for_is_an_error_and_the_next_one_is_drawn() {
    let subject = written("memory", PLAIN, "");
    for interface in INTERFACES {
        if open(interface).is_none() {
            continue;
        }
        let patience = Duration::from_secs(120);
        let mut worker = Worker::new(short_of_memory(), Some(interface.to_owned()), patience);
        let mut picture = |wanted| worker.picture(&subject, &Variant::default(), wanted);
        let drawn = picture(WANTED);
        assert!(drawn.is_ok(), "{interface}: {drawn:?}");
        // 16 bytes for each of 8192 x 8192 fine pixels, and more for their depth.
        let large = picture(Wanted {
            grid: 512,
            ..WANTED
        });
        let failed = large.expect_err("there is no room for it");
        // Some drivers say so, some are lost or crash, and some never end.
        let said = |error: &str| {
            let words = ["memory", "lost", "cannot be read"];
            words.iter().any(|word| error.contains(word))
        };
        let typed = match &failed {
            Failure::Refused(error) => said(&error.message),
            failed => matches!(failed, Failure::Crashed { .. }),
        };
        assert!(typed, "{interface}: {failed:?}");
        assert!(!failed.diagnostic(Some(interface)).notes.is_empty());
        let drawn = picture(WANTED);
        assert!(drawn.is_ok(), "{interface}: {drawn:?}");
    }
}

#[test]
fn a_child_that_crashes_or_is_none_is_an_error() {
    let subject = written("crash", PLAIN, "");
    let picture = |program: &str| {
        let mut worker = Worker::new(program.into(), None, Duration::from_secs(60));
        let failed = worker.picture(&subject, &Variant::default(), WANTED);
        failed.expect_err("there is no picture")
    };
    // Something that ends at once, and something that is not there.
    let crashed = picture(env!("CARGO"));
    assert!(matches!(&crashed, Failure::Crashed { .. }), "{crashed:?}");
    assert!(!crashed.diagnostic(Some("x")).notes.is_empty());
    let none = picture("/nowhere/lodc");
    assert!(matches!(&none, Failure::NotStarted(_)), "{none:?}");
}

#[test]
fn a_child_is_handed_single_inputs() {
    let Some(_) = open("vulkan") else { return };
    let guarded = include_str!("../../testdata/stability/normalize_of_what_can_vanish.wgsl");
    let subject = written("fed", guarded, "");
    let (source, scene) = read(&subject.shader);
    let base = normal_form(&source).unwrap_or_else(|e| panic!("{e}"));
    let (vertex, _) = programs(Stages::of_shader(&base, &scene).expect("it has both stages"));
    let stand = Stand {
        base: &base,
        vertex: &vertex,
        scene: &scene,
    };
    let battery = Battery::new(&stand).expect("it runs");
    let near = battery.judge_and_hunt(&base).expect("it runs").near;
    let bare = Variant {
        text: Some(guarded.replace("max(square, 0.00000001)", "square")),
        ..Variant::default()
    };
    let mut worker = worker("vulkan");
    let variants = [Variant::default(), bare];
    let bad = worker.feed(&subject, &variants, &near);
    let bad = bad.unwrap_or_else(|failure| panic!("{failure:?}"));
    let bad = bad.expect("they can be fed");
    let counts = [0, 1].map(|at| bad[at].iter().filter(|bad| **bad).count());
    assert!(
        counts[0] == 0 && counts[1] > 0,
        "{counts:?} of {}",
        near.count()
    );
}
