//! Times that are taken on a device. What they are depends on the machine: only what must hold on any is looked at.

use super::pictures::open;
use super::worker::worker;
use super::{INTERFACES, scratch, written};
use lodc::front::{Modules, Stages};
use lodc::gpu::worker::{Failure, Subject, Variant};
use lodc::time::{Effort, Timing, TimingWarning, Verdict};
use std::time::Duration;

/// A fragment stage that goes round a loop so many times.
fn rounds(count: u32) -> String {
    format!(
        "@fragment fn fs(@location(0) uv: vec2f) -> @location(0) vec4f {{
            var x = uv.x;
            for (var i = 0u; i < {count}u; i++) {{ x = fract(x * 1.7 + uv.y) + 0.1 * x * x; }}
            return vec4f(x, uv, 1.0);
        }}"
    )
}

fn variant(text: String) -> Variant {
    Variant {
        text: Some(text),
        ..Variant::default()
    }
}

const QUICK: Effort = Effort {
    rounds_at_least: 7,
    rounds_at_most: 15,
    half_width: 0.1,
    budget: Duration::from_millis(500),
};

#[test]
fn more_work_takes_longer_and_less_work_does_not() {
    for interface in INTERFACES {
        if open(interface).is_none() {
            continue;
        }
        let subject = written(
            &format!("timed-{interface}"),
            &rounds(3000),
            "object = \"plane\"",
        );
        let mut worker = worker(interface);
        let all = [
            Variant::default(),
            variant(rounds(9000)),
            variant("fn".to_owned()),
            variant(rounds(300)),
        ];
        let timed = worker.time(&subject, &all, 4.0, &QUICK);
        let timed = timed.unwrap_or_else(|failure| panic!("{failure:?}"));
        let [same, slow, broken, fast] = <[_; 4]>::try_from(timed).expect("as many as asked for");
        assert!(matches!(broken, Err(Failure::Refused(_))), "{broken:?}");
        let [same, slow, fast] = [same, slow, fast].map(|t| t.unwrap_or_else(|f| panic!("{f:?}")));
        for timing in [&same, &slow, &fast] {
            assert!(timing.ms > 0.0 && timing.compile_ms > 0.0, "{timing:?}");
            assert!(timing.low <= timing.ratio && timing.ratio <= timing.high);
            eprintln!("{interface}: {timing:?}");
        }
        // Beside other tests the noise floor may hold any difference; how often a verdict is right the benchmark says.
        assert!(
            slow.ratio > 1.3 && slow.verdict() != Verdict::Faster,
            "{slow:?}"
        );
        assert!(
            fast.ratio < 0.8 && fast.verdict() != Verdict::Slower,
            "{fast:?}"
        );
        let software = open(interface).is_some_and(|gpu| gpu.label().software);
        let warned = |timing: &Timing| timing.warnings.contains(&TimingWarning::SoftwareAdapter);
        assert!([&same, &slow, &fast].iter().all(|t| warned(t) == software));
        // Three frames of an object that is seen from the front, and helpers at most as many again.
        if let Some(counted) = same.statistics {
            assert!(counted.vertex_invocations >= 4.0, "{counted:?}");
            assert!(counted.fragment_invocations >= 16.0, "{counted:?}");
        }
    }
}

#[test]
fn autolod_is_set_whether_it_is_an_override_or_in_a_buffer() {
    if open("vulkan").is_none() {
        return;
    }
    let declared = [
        ("override autoLOD: f32 = 0.0;", "autoLOD"),
        (
            "struct Level { @size(16) autoLOD: f32 }\n@group(1) @binding(7) var<uniform> level: Level;",
            "level.autoLOD",
        ),
    ];
    let subject = written("timed-levels", &rounds(1000), "object = \"plane\"");
    let mut worker = worker("vulkan");
    for (declaration, value) in declared {
        let text = rounds(1000).replace("1000u", &format!("select(1000u, 20u, {value} >= 2.0)"));
        let all = [1.0, 3.0].map(|auto_lod| Variant {
            text: Some(format!("{declaration}\n{text}")),
            auto_lod: Some(auto_lod),
            ..Variant::default()
        });
        let timed = worker.time(&subject, &all, 4.0, &QUICK);
        let timed = timed.unwrap_or_else(|failure| panic!("{failure:?}"));
        let timed: Vec<Timing> = timed.into_iter().map(Result::unwrap).collect();
        assert!(timed[1].high < timed[0].low, "{value}: {timed:?}");
    }
}

#[test]
fn blended_and_deferred_scenes_are_timed_and_colours_of_less_than_four_components() {
    if open("vulkan").is_none() {
        return;
    }
    let narrow = "@fragment fn fs(@location(0) uv: vec2f) -> @location(0) vec2f { return uv; }";
    let subjects = [
        written("timed-blended", &rounds(50), "blend = \"alpha\""),
        written("timed-linear", &rounds(50), "output = \"linear\""),
        written("timed-narrow", narrow, ""),
    ];
    let mut worker = worker("vulkan");
    let once = Effort {
        rounds_at_least: 5,
        rounds_at_most: 1,
        ..QUICK
    };
    let deferred = super::fixtures::small_materials(&scratch("timed"), 16, &[]);
    let deferred = deferred
        .into_iter()
        .find(|path| path.ends_with("gbuffer.wgsl"));
    let deferred = deferred.expect("the material is there");
    let deferred = Subject::new(deferred, None, &Stages::default(), &Modules::default());
    for subject in subjects.iter().chain([&deferred]) {
        let timed = worker.time(subject, &[Variant::default()], 4.0, &once);
        let timed = timed.unwrap_or_else(|failure| panic!("{failure:?}"));
        let timing = timed[0].as_ref().unwrap_or_else(|f| panic!("{f:?}"));
        assert_eq!(timing.rounds, 4);
        assert!(timing.ms > 0.0 && timing.warnings.contains(&TimingWarning::FewSamples));
    }
}

/// A shader in a scene of so many pixels that a loop of 65,535 rounds, after which Mesa ends any, takes long.
fn large(name: &str, shader: &str) -> Subject {
    let subject = written(name, shader, "");
    let scene = "object = \"plane\"\nresolution = [512, 512]\n[views]\ncount = 1\n";
    std::fs::write(subject.shader.with_extension("toml"), scene).expect("it can be written");
    subject
}

#[test]
fn a_variant_that_never_ends_does_not_keep_the_others_from_being_timed() {
    if open("vulkan").is_none() {
        return;
    }
    let endless = "@fragment fn fs(@location(0) uv: vec2f) -> @location(0) vec4f {
            var x = uv.x;
            loop { x = fract(pow(x + 1.5, 1.7) + sin(x)); if x > 2.0 { break; } }
            return vec4f(x);
        }";
    let subject = large("timed-endless", &rounds(5));
    let mut worker = worker("vulkan");
    // Before, so that the patience below is not for reading the scene.
    let quick = Effort {
        rounds_at_most: 1,
        rounds_at_least: 1,
        budget: Duration::from_millis(100),
        ..QUICK
    };
    assert!(
        worker
            .time(&subject, &[Variant::default()], 4.0, &quick)
            .is_ok()
    );
    worker.set_patience(Duration::from_secs(3));
    let all = [variant(rounds(6)), variant(endless.to_owned())];
    let timed = worker.time(&subject, &all, 4.0, &quick);
    let timed = timed.unwrap_or_else(|failure| panic!("{failure:?}"));
    assert!(timed[0].is_ok(), "{timed:?}");
    assert!(matches!(timed[1], Err(Failure::Hung(_))), "{timed:?}");
    // The original too: then there is nothing to say of any.
    let subject = large("timed-endless-itself", endless);
    let failed = worker.time(&subject, &all[..1], 4.0, &quick);
    assert!(matches!(failed, Err(Failure::Hung(_))), "{failed:?}");
}
